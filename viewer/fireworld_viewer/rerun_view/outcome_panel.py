"""What one or two runs came to, and where two first differ: worked out elsewhere, shown here as text and as marks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    import rerun

OUTCOME_PATH: Final = "/outcome"


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What the page of the outcome says."""

    heads: Sequence[str]
    """What the recordings are called, one or two."""
    rows: Sequence[tuple[str, ...]]
    """What is counted, then its value in each recording."""
    first_step: int | None = None
    """The step of the first difference of two runs, None where there is none."""
    first_sentence: str = ""
    """The first difference in words."""


def log_outcome(stream: rerun.RecordingStream, outcome: Outcome) -> None:
    """Send the outcome as a page."""
    import rerun

    page = rerun.TextDocument(markdown(outcome), media_type=rerun.MediaType.MARKDOWN)
    stream.log(OUTCOME_PATH, page, static=True)


def markdown(outcome: Outcome) -> str:
    """Write the outcome as the first difference, if there are two runs, and a table."""
    pair = len(outcome.heads) > 1
    lines = []
    if pair:
        lines += [
            f"First difference: {outcome.first_sentence}." if outcome.first_sentence else "The runs are the same."
        ]
        lines += [""]
    named = [f"{letter}: {head}" for letter, head in zip("AB", outcome.heads, strict=False)] if pair else outcome.heads
    lines += [_row(("", *named)), _row(["---"] * (len(named) + 1)), *map(_row, outcome.rows)]
    return "\n".join(lines) + "\n"


def _row(cells: Sequence[str]) -> str:
    """Write a row of a table; a bar would end the cell."""
    return f"| {' | '.join(cell.replace('|', '/') for cell in cells)} |"
