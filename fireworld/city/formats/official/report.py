"""What an import repaired, inferred or left out: one finding each, with the ids it is about."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Final

from fireworld.errors import one_line

IDS_SHOWN_MAX: Final = 5


@dataclass(frozen=True)
class Finding:
    """One thing that whoever imports a map should know."""

    key: str
    """A name for programs."""
    text: str
    ids: tuple[int | str, ...] = ()
    """Areas that it is about, in the order of the file; numbers, or text where the map's ids are no numbers here."""
    n: int | None = None
    """How many it is about, which the text begins with; None where that is not counted."""

    def __str__(self) -> str:
        if not self.ids:
            return one_line(self.text)
        shown = ", ".join(str(one) for one in self.ids[:IDS_SHOWN_MAX])
        more = f" and {len(self.ids) - IDS_SHOWN_MAX} more" if len(self.ids) > IDS_SHOWN_MAX else ""
        return one_line(f"{self.text}: {shown}{more}")


@dataclass
class Report:
    """All findings of an import, in the order in which they came up."""

    findings: list[Finding] = field(default_factory=list)

    def note(self, key: str, text: str, ids: Iterable[int] = ()) -> None:
        """Add a finding."""
        self.findings.append(Finding(key, text, tuple(ids)))

    def note_number(self, key: str, text: str, n: int, *, always: bool = False) -> None:
        """Add a finding about so many of something, if there are any or `always`; `text` follows the number."""
        if n or always:
            self.findings.append(Finding(key, f"{n} {text}", n=n))

    def note_areas(self, key: str, text: str, ids: Iterable[int | str]) -> None:
        """Add a finding about areas, if there are any; `text` follows their number."""
        listed = tuple(ids)
        if listed:
            self.findings.append(Finding(key, f"{len(listed)} {text}", listed, len(listed)))

    @property
    def lines(self) -> list[str]:
        """One line for each finding."""
        return [str(finding) for finding in self.findings]

    def as_json(self) -> list[dict[str, Any]]:
        """Return the findings as JSON holds them."""
        return [{"key": one.key, "text": one.text, "n": one.n, "ids": list(one.ids)} for one in self.findings]
