"""The table of the suites, in docs/leaderboard.md.

`python -m tests.docs.suites_table` renews it.
"""

from __future__ import annotations

from typing import Final

import fireworld as fw
from tests.docs.pages import ROOT, with_part

BEGIN: Final = "<!-- made by tests.docs.suites_table -->"
END: Final = "<!-- end of the suites -->"
PAGE: Final = ROOT / "docs" / "leaderboard.md"


def renew(page: str) -> str:
    """Return the page with its table made anew."""
    rows = (f"| `{one.name}` | {len(one.scenarios)} | {one.description} | `{one.digest[:12]}` |" for one in fw.suites())
    table = "\n".join(["| suite | scenarios | what it is | digest |", "|---|---|---|---|", *rows])
    return with_part(page, BEGIN, END, f"\n\n{table}\n\n")


if __name__ == "__main__":
    PAGE.write_text(renew(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
