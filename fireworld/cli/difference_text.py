"""A comparison of two recordings for people: sentences, and tables in the terminal."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, Final

import click

from fireworld.cli.tables import print_table

if TYPE_CHECKING:
    from fireworld_recorder.diff import Difference
    from fireworld_recorder.spread import SpreadRow, ValuePair

DIGEST_SHOWN: Final = 12
TOTALS: Final = {
    "n_steps": "steps",
    "time_to_complete": "fire out at step",
    "score": "score",
    "score_max": "score, at most",
    "n_burnt_out": "burnt out",
    "n_civilians_alive": "civilians alive",
    "sum_of_rewards": "return",
    "water_used_litres": "water used, litres",
}
"""What a run came to, and how it is called."""
SPREAD_HEADS: Final = ("step", "buildings", "fieryness", "brigades", "civilians", "score", "burning", "burnt out")
SPREAD_NOTE: Final = (
    "how many differ; fieryness: buildings that burn or are damaged otherwise; score, burning, burnt out: B less A"
)


def show(difference: Difference, *, names: tuple[str, str]) -> None:
    """Write a comparison: first difference, totals, when each topic came to differ, and how that spread."""
    first = difference.first
    click.echo(f"the same: {difference.n_steps_compared} steps" if first is None else first.sentence)
    show_header(difference.header)
    click.echo()
    print_table(("", *names), list(totals_rows(difference)))
    if difference.n_steps_differing:
        counts = [
            (topic, str(difference.first_by_topic[topic].step), str(n))
            for topic, n in difference.n_steps_differing.items()
        ]
        heads = ("topic", "first at step", f"steps that differ, of {difference.n_steps_compared}")
        click.echo()
        print_table(heads, counts)
    if difference.spread.rows:
        click.echo()
        print_table(SPREAD_HEADS, [spread_cells(row) for row in difference.spread.rows], left=(), narrow=True)
        click.echo(f"\n{SPREAD_NOTE}")
        for sentence in reached(difference):
            click.echo(sentence)


def show_header(header: Mapping[str, tuple[str | int, str | int]]) -> None:
    """Write what the runs were asked to do differently."""
    for key, (a, b) in header.items():
        click.echo(f"{key.replace('_', ' ')}: {shortened(key, b)}, was {shortened(key, a)}")


def shortened(key: str, value: str | int) -> str:
    """Show a value of a header; of a digest as much as tells it from others."""
    return str(value)[:DIGEST_SHOWN] if key.endswith("digest") else str(value)


def totals_rows(difference: Difference) -> Iterator[tuple[str, str, str]]:
    """Yield what both runs came to, line by line."""
    for key, label in TOTALS.items():
        a, b = (_number(totals.as_json()[key]) for totals in difference.totals)
        yield label, a, b


def spread_cells(row: SpreadRow) -> tuple[str, ...]:
    """Write one row of the table of how a difference spread."""
    counts = (row.step, row.n_buildings, row.n_states, row.n_brigades, row.n_civilians)
    return (*map(_number, counts), *map(_change, (row.score, row.n_burning, row.n_burnt_out)))


def reached(difference: Difference) -> Iterator[str]:
    """Say how many entities of each kind a difference reached, and which was the first."""
    spread = difference.spread
    for kind, total in spread.n_entities.items():
        found, n_reached = spread.first_by_entity[kind], spread.n_reached[kind]
        if found is not None:
            yield f"{kind}s: {n_reached} of {total} differed at some step, the first at {found.sentence}"
        elif total:
            yield f"{kind}s: none of {total} differed"


def _change(pair: ValuePair) -> str:
    if pair.a is None or pair.b is None:
        return "-"
    difference = pair.b - pair.a
    return f"{difference:+.4g}" if difference else "0"


def _number(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.6g}" if isinstance(value, float) else str(value)
