"""Plain tables in the terminal: a head, a line, rows; what does not fit is folded."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fireworld.shown import Block

NARROW_FROM = 7
"""Columns above which there is little space between them."""


def print_table(
    head: Sequence[str],
    rows: Sequence[Sequence[str]],
    *,
    left: Collection[int] = (0,),
    whole: Collection[int] = (),
    narrow: bool = False,
) -> None:
    """Print a table.

    Args:
        head: what stands above the columns.
        rows: cells.
        left: places of the columns that are set to the left; the others are set to the right.
        whole: places of the columns whose cells stay on one line as long as possible.
        narrow: with little space between the columns, as there is in any case where the terminal is too narrow.
    """
    from rich import box
    from rich.console import Console
    from rich.table import Table

    console = Console(highlight=False, markup=False)
    widths = [max(map(len, column)) + 3 for column in zip(head, *rows, strict=True)]
    narrow = narrow or sum(widths) - 3 > console.width
    table = Table(box=box.SIMPLE, show_edge=False, pad_edge=False, padding=(0, 0 if narrow else 1))
    for place, name in enumerate(head):
        table.add_column(name, justify="left" if place in left else "right", no_wrap=place in whole, overflow="fold")
    for row in rows:
        table.add_row(*row)
    console.print(table)


def print_lines(lines: Iterable[str]) -> None:
    """Print lines, broken between words where the terminal ends; what continues a line stands further in.

    Where no terminal is, and COLUMNS does not ask for a width, they stay whole.
    """
    import os
    import shutil
    import sys
    from textwrap import TextWrapper

    import click

    is_wide = not (sys.stdout.isatty() or "COLUMNS" in os.environ)
    width = max(shutil.get_terminal_size().columns, 40)
    for line in lines:
        further = " " * (len(line) - len(line.lstrip()) + 2)
        wrapper = TextWrapper(width, subsequent_indent=further, break_long_words=False, break_on_hyphens=False)
        click.echo(line.rstrip() if is_wide or len(line) <= width else wrapper.fill(line))


def print_blocks(blocks: Iterable[Block]) -> None:
    """Print what an object shows of itself: lines and tables."""
    import click

    for block in blocks:
        if isinstance(block, str):
            click.echo(block)
        else:
            narrow = len(block.heads) > NARROW_FROM
            print_table(block.heads, block.rows, left=range(block.n_left), whole=(0,), narrow=narrow)
