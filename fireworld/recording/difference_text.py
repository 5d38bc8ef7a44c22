"""A comparison of two recordings in words and cells, for the terminal and for pages."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, Final

from fireworld.outcome import QUANTITIES

if TYPE_CHECKING:
    from fireworld_recorder.diff import RunComparison
    from fireworld_recorder.spread import SpreadRow, ValuePair
    from fireworld_recorder.totals import Totals

DIGEST_SHOWN: Final = 12
SPREAD_HEADS: Final = ("step", "buildings", "fieryness", "brigades", "civilians", "score", "burning", "burnt out")
SPREAD_NOTE: Final = "how many differ; fieryness: buildings in another state; score, burning, burnt out: B - A"


def header_lines(header: Mapping[str, tuple[str | int, str | int]]) -> list[str]:
    """List what the runs were asked to do differently."""
    return [f"{key.replace('_', ' ')}: {shortened(key, b)}, was {shortened(key, a)}" for key, (a, b) in header.items()]


def shortened(key: str, value: str | int) -> str:
    """Return a value of a header; of a digest as much as identifies it."""
    return str(value)[:DIGEST_SHOWN] if key.endswith("digest") else str(value)


def totals_rows(*totals: Totals) -> Iterator[tuple[str, ...]]:
    """Yield how runs came out, line by line: what is counted, then its value in each run."""
    yield "steps", *(str(one.n_steps) for one in totals)
    for quantity in QUANTITIES:
        unit = f", {quantity.unit}" if quantity.unit and quantity.unit not in quantity.label else ""
        yield quantity.label + unit, *(_number(getattr(one.outcome, quantity.name, None)) for one in totals)
    yield "score, at most", *(_number(getattr(one.outcome, "score_max", None)) for one in totals)


def change_lines(difference: RunComparison) -> list[str]:
    """List what else is different: in what was asked for, and in how the runs came out."""
    rows = totals_rows(*difference.totals)
    return [*header_lines(difference.header), *(f"{label}: {b}, was {a}" for label, a, b in rows if a != b)]


def topic_rows(difference: RunComparison) -> Iterator[tuple[str, str, str]]:
    """Yield topic, the step at which it came to differ, and the number of steps in which it differs."""
    for topic, n in difference.n_steps_differing.items():
        yield topic, str(difference.first_by_topic[topic].step), str(n)


def spread_cells(row: SpreadRow) -> tuple[str, ...]:
    """Write one row of the table of how a difference spread."""
    counts = (row.step, row.n_buildings, row.n_states, row.n_brigades, row.n_civilians)
    return (*map(_number, counts), *map(_change, (row.score, row.n_burning, row.n_burnt_out)))


def spread_sentences(difference: RunComparison) -> Iterator[str]:
    """Yield how many entities of each kind a difference reached, and which was the first."""
    spread = difference.spread
    for kind, total in spread.n_entities.items():
        found, n_reached = spread.first_by_entity[kind], spread.n_reached[kind]
        if found is not None:
            yield f"{kind}s: {n_reached} of {total} differed at some step, the first at {found.sentence}"
        elif total:
            yield f"{kind}s: none of {total} differed"


def verdict(difference: RunComparison) -> str:
    """Return the first difference in words, or how many steps are the same."""
    first = difference.first
    return f"the same: {difference.n_steps_compared} steps" if first is None else first.sentence


def _change(pair: ValuePair) -> str:
    if pair.a is None or pair.b is None:
        return "-"
    difference = pair.b - pair.a
    return f"{difference:+.4g}" if difference else "0"


def _number(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.6g}" if isinstance(value, float) else str(value)
