"""The table of what rules make of the shipped scenarios, in docs/scenarios.md.

`python -m tests.docs.contested_table` renews it.
"""

from __future__ import annotations

from typing import Final

import fireworld as fw
from tests.docs.pages import ROOT, with_part

BEGIN: Final = "<!-- made by tests.docs.contested_table -->"
END: Final = "<!-- end of the table -->"
PAGE: Final = ROOT / "docs" / "scenarios.md"


def renew(page: str) -> str:
    """Return the page with its table made anew, as `fireworld scenarios check --markdown` writes it."""
    return with_part(page, BEGIN, END, f"\n\n{fw.check_scenarios().markdown}\n\n")


if __name__ == "__main__":
    PAGE.write_text(renew(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
