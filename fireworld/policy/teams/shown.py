"""Objects that show themselves: as lines and tables, which the terminal prints and a notebook shows as HTML."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape
from typing import Final

from fireworld.html_page import html_table, text_cell

SHOWN_MAX: Final = 20
"""Entries of a list that are shown unless more are asked for."""


@dataclass(frozen=True)
class TextTable:
    """A table of text."""

    heads: Sequence[str]
    rows: Sequence[Sequence[str]]
    n_left: int = 1
    """The first so many columns are words, set to the left."""


Block = str | TextTable
"""A line, which may be empty, or a table."""


class Shown(ABC):
    """Something that shows itself."""

    @abstractmethod
    def describe(self, *, limit: int = SHOWN_MAX) -> Iterator[Block]:
        """Yield what there is to see.

        Args:
            limit: entries of a list at most.
        """

    def _repr_html_(self) -> str:
        return "\n".join(_html(block) for block in self.describe() if block)


def more(n_all: int, limit: int) -> Iterator[str]:
    """Yield a line about the entries of a list that are not shown, if there are any."""
    if n_all > limit:
        yield f"... and {n_all - limit} more; --limit shows more of them"


def _html(block: Block) -> str:
    if isinstance(block, str):
        return f"<div>{escape(block)}</div>"
    rows = [
        [text_cell(escape(cell)) if place < block.n_left else escape(cell) for place, cell in enumerate(row)]
        for row in block.rows
    ]
    return html_table([escape(head) for head in block.heads], rows, n_text=block.n_left)
