"""What a check found, as CI servers show it: in Markdown and as annotations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, Final, Literal

Verdict = Literal["same", "different", "cannot"]
VERDICTS: Final[Sequence[Verdict]] = ("cannot", "different", "same")


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One check: what was changed, where it first shows, and how it came out. All of it is plain text.

    Attributes:
        name: of what was checked.
        verdict: how it ended; "cannot" is neither the same nor different, and needs somebody to look.
        headline: what is wrong in a line, which begins with what changed.
        cause: what changed, line by line.
        first: the first difference in a sentence, or the verdict of a comparison.
        heads: the heads of the table.
        rows: of the table: how both came out.
        file: the file that an annotation points to.
        line: in that file, from 1.
        links: files that show more, by what they are.
        picture: a file with a picture, "" if there is none.
    """

    name: str
    verdict: Verdict
    headline: str = ""
    cause: Sequence[str] = ()
    first: str = ""
    heads: Sequence[str] = ()
    rows: Sequence[Sequence[str]] = ()
    file: str = ""
    line: int = 1
    links: Mapping[str, str] = field(default_factory=dict)
    picture: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Return plain values, of which `Finding(**values)` is made again."""
        return asdict(self)
