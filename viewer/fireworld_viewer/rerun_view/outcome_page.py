"""The page of the outcome: how one or two runs came out, and where two first differ, as computed elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class OutcomePage:
    """What the page of the outcome contains."""

    heads: Sequence[str]
    """What the recordings are called, one or two."""
    rows: Sequence[tuple[str, ...]]
    """What is counted, then its value in each recording."""
    first_step: int | None = None
    """The step of the first difference of two runs, None where there is none."""
    first_sentence: str = ""
    """The first difference in words."""

    @property
    def markdown(self) -> str:
        """The first difference, if there are two runs, and a table."""
        heads, lines = list(self.heads), []
        if len(heads) > 1:
            first = f"First difference: {self.first_sentence}." if self.first_sentence else "The runs are the same."
            lines += [first, ""]
            heads = [f"{letter}: {head}" for letter, head in zip("AB", heads, strict=True)]
        lines += [_row(("", *heads)), _row(["---"] * (len(heads) + 1)), *map(_row, self.rows)]
        return "\n".join(lines) + "\n"


def _row(cells: Sequence[str]) -> str:
    """Write a row of a table; a bar would end the cell."""
    return f"| {' | '.join(cell.replace('|', '/') for cell in cells)} |"
