"""Rows of the fire model: steps inside the compiled kernels against plain numpy, and the bare call of a kernel."""

from __future__ import annotations

from collections.abc import Iterator

from benchmarks.fires import KINDS, LOTS, STEPS_TIMED, Kind, after_timed_steps, blaze, n_burning
from benchmarks.loops import do_nothing
from benchmarks.timing import Contender, Row, compare, measure

CALLS = 100


def step_row(size: int, kind: Kind, *, seconds: float) -> Row:
    """Time a step of a fire that has burnt for a while: ten of them in one compiled call, ten in numpy."""
    start = blaze(size, kind)
    first, last = n_burning(start.plain_fire.fieryness), n_burning(after_timed_steps(start))
    label = f"{len(start.rate)} buildings, {first}..{last} burning"
    ours = Contender("compiled", start.advance_compiled, start.compiled_copy, parts=STEPS_TIMED)
    baseline = Contender("numpy", start.advance_plain, start.plain_copy, parts=STEPS_TIMED)
    return compare("fire", f"one of {STEPS_TIMED} steps, {kind} fire", label, ours, baseline, seconds=seconds)


def call_row(*, seconds: float) -> Row:
    """Time the call from Python of a kernel that takes what a step takes and does nothing."""
    start = blaze(min(LOTS), "small")
    tables, fire = start.tables, start.compiled_fire
    groups = (tables.buildings, tables.cover, tables.links, fire, start.constants)
    n_arrays = sum(len(group) for group in groups[:-1])

    def call(_: None) -> None:
        for _call in range(CALLS):
            do_nothing(*groups)

    contender = Contender("compiled", call, parts=CALLS)
    return measure("fire", "call from Python", f"{n_arrays} arrays", contender, seconds=seconds)


def rows(*, quick: bool) -> Iterator[Row]:
    """Yield the rows of the fire model."""
    seconds = 0.3 if quick else 2.0
    for size in list(LOTS)[:2] if quick else LOTS:
        for kind in KINDS:
            yield step_row(size, kind, seconds=seconds)
    yield call_row(seconds=seconds)
