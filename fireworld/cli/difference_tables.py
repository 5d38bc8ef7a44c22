"""A comparison of two recordings in the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from fireworld.cli.tables import print_table
from fireworld.recording.difference_text import (
    SPREAD_HEADS,
    SPREAD_NOTE,
    header_lines,
    spread_cells,
    spread_sentences,
    topic_rows,
    totals_rows,
    verdict,
)

if TYPE_CHECKING:
    from fireworld_recorder.diff import RunComparison


def show_difference(difference: RunComparison, *, names: tuple[str, str]) -> None:
    """Print the first difference, how both runs came out, when each topic came to differ, and how that spread."""
    click.echo("\n".join([verdict(difference), *header_lines(difference.header), ""]))
    print_table(("", *names), list(totals_rows(*difference.totals)))
    topics = list(topic_rows(difference))
    if topics:
        click.echo()
        print_table(("topic", "first at step", f"steps that differ, of {difference.n_steps_compared}"), topics)
    if difference.spread.rows:
        click.echo()
        print_table(SPREAD_HEADS, [spread_cells(row) for row in difference.spread.rows], left=(), narrow=True)
        click.echo("\n".join(["", SPREAD_NOTE, *spread_sentences(difference)]))
