"""What a study of readings found, in docs/readings.md: from the runs that are kept in docs/readings.

`fireworld reproduce --readings --out docs/readings --resume` writes all else that is there from them;
`python -m tests.docs.readings_result` then renews the page.
"""

from __future__ import annotations

from typing import Final

from fireworld.reproduction.readings.report import MARKDOWN
from tests.docs.pages import ROOT, with_part

BEGIN: Final = "<!-- made by tests.docs.readings_result -->"
END: Final = "<!-- end of the result -->"
PAGE: Final = ROOT / "docs" / "readings.md"
KEPT: Final = ROOT / "docs" / "readings"


def renew(page: str, found: str) -> str:
    """Return the page with what was found, as a study writes it in its folder, the picture from there."""
    return with_part(page, BEGIN, END, f"\n\n{found.replace('](', '](readings/').strip()}\n\n")


if __name__ == "__main__":
    page = renew(PAGE.read_text(encoding="utf-8"), (KEPT / MARKDOWN).read_text(encoding="utf-8"))
    PAGE.write_text(page, encoding="utf-8")
