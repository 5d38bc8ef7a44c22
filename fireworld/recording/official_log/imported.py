"""What became of an official log, in lines of text and as plain values."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fireworld_recorder.totals import plain

from fireworld.outcome import QUANTITIES, Outcome
from fireworld.recording.official_log.official_score import OfficialScore

if TYPE_CHECKING:
    from fireworld.recording.run import Run


@dataclass(frozen=True, repr=False)
class Imported:
    """What became of an official log.

    Attributes:
        source: the log.
        path: the recording.
        form: how it was written: its form, its numbering, its compression.
        n_steps: steps in the recording.
        last_step: the last of them.
        digest: of the recording.
        damage: why the log ends too early, and up to where it was imported; None if it is whole.
        n_left_out: rescuers other than fire brigades, which a recording has no place for.
        outcome: how the run came out.
        official: the score after the last step by the kernel's own function; None if the log names none.
    """

    source: Path
    path: Path
    form: str
    n_steps: int
    last_step: int
    digest: str
    damage: str | None
    n_left_out: int
    outcome: Outcome
    official: OfficialScore | None

    def open(self) -> Run:
        """Open the recording."""
        from fireworld.recording.run import open_log

        return open_log(self.path)

    def to_dict(self) -> dict[str, Any]:
        """Return what is known as plain values, as `fireworld import-log --json` writes it."""
        outcome = {one.name: getattr(self.outcome, one.name) for one in QUANTITIES if one.is_known(self.outcome)}
        facts = {key: value for key, value in vars(self).items() if key not in {"outcome", "source", "path"}}
        found: dict[str, Any] = plain({"source": str(self.source), "path": str(self.path), **facts, "outcome": outcome})
        return found

    def lines(self) -> list[str]:
        """Return what is known in lines of text."""
        left_out = f"; {self.n_left_out} other rescuers are left out" if self.n_left_out else ""
        score = f"{self.outcome.score:.3f} of {self.outcome.score_max:.0f}"
        found = [
            f"{self.source}: {self.form}",
            f"{self.path}: {self.n_steps} steps, up to step {self.last_step}, digest {self.digest}",
            f"{self.outcome.n_buildings} buildings, {self.outcome.n_civilians} civilians{left_out}",
            f"score {score}, by today's rule {self.outcome.score_now:.3f}",
        ]
        if self.official is not None and self.official.value is not None:
            found.append(f"{self.official.value:.3f} by the kernel's own {self.official.function} and its factors")
        elif self.official is not None:
            found.append(f"the kernel's own {self.official.function} cannot be computed here")
        return found

    def __repr__(self) -> str:
        return "\n".join(self.lines())
