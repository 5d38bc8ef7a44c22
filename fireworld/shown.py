"""Objects that show themselves: as lines and tables, as plain text and as the HTML of a notebook."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Sequence
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


def text_table(heads: Sequence[str], rows: Iterable[Sequence[str]], align: str) -> str:
    """Return a table as lines of text.

    Args:
        heads: of the columns.
        rows: cells; a row may be shorter than the heads, and a row of one cell may run over all columns.
        align: a character for each column: < to the left, > to the right.
    """
    lines = [heads, *rows]
    whole = [line for line in lines if len(line) > 1]
    widths = [max(len(line[k]) for line in whole if k < len(line)) for k in range(len(heads))]

    def write(line: Sequence[str]) -> str:
        if len(line) == 1:
            return line[0]
        return "  ".join(f"{cell:{align[k]}{widths[k]}}" for k, cell in enumerate(line)).rstrip()

    head, *body = map(write, lines)
    return "\n".join([head, "-" * (sum(widths) + 2 * (len(widths) - 1)), *body])


def block_text(block: Block) -> str:
    """Return a line or a table as text."""
    if isinstance(block, str):
        return block
    return text_table(block.heads, block.rows, "<" * block.n_left + ">" * (len(block.heads) - block.n_left))


def _html(block: Block) -> str:
    if isinstance(block, str):
        return f"<div>{escape(block)}</div>"
    rows = [
        [text_cell(escape(cell)) if place < block.n_left else escape(cell) for place, cell in enumerate(row)]
        for row in block.rows
    ]
    return html_table([escape(head) for head in block.heads], rows, n_text=block.n_left)


def at_most(lines: Sequence[str], most: int) -> list[str]:
    """Return the first lines, and how many more there are."""
    return [*lines[:most], *([f"and {len(lines) - most} more"] if len(lines) > most else [])]
