"""Fair timing: two contenders take turns, so that whatever else the machine does meets both alike."""

from __future__ import annotations

import gc
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

ROUNDS_MIN: Final = 5
ROUNDS_MAX: Final = 2000
UNITS: Final = ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns"))


@dataclass(frozen=True)
class Contender:
    """A piece of work, and how to make a fresh start for each repetition (which is not timed)."""

    name: str
    run: Callable[[Any], object]
    prepare: Callable[[], Any] = lambda: None
    parts: int = 1
    """Into how many equal parts the time is divided: steps or calls of one repetition."""


@dataclass(frozen=True)
class Row:
    """One line of the table. Times are medians over the rounds; the ratio is the median of the rounds' ratios."""

    group: str
    what: str
    size: str
    ours: str
    seconds: float
    baseline: str = ""
    baseline_seconds: float | None = None
    ratio: float | None = None
    """Baseline's time / our time: above 1, ours is faster."""
    ratio_low: float | None = None  # first quartile
    ratio_high: float | None = None  # third quartile
    rounds: int = 0
    note: str = ""


def duration(seconds: float | None) -> str:
    """Write a time with three digits and a fitting unit.

    >>> duration(0.0123456)
    '12.3 ms'
    """
    if seconds is None:
        return ""
    scale, unit = next((item for item in UNITS if seconds >= item[0]), UNITS[-1])
    return f"{seconds / scale:.3g} {unit}"


def once(contender: Contender) -> float:
    """Time one repetition; seconds of one of its parts."""
    work = contender.prepare()
    start = time.perf_counter()
    contender.run(work)
    return (time.perf_counter() - start) / contender.parts


def measure(group: str, what: str, size: str, contender: Contender, *, seconds: float) -> Row:
    """Time one contender alone for about that long."""
    times, _ = _rounds((contender,), seconds)
    return Row(group, what, size, contender.name, statistics.median(times[0]), rounds=len(times[0]))


def compare(group: str, what: str, size: str, ours: Contender, baseline: Contender, *, seconds: float) -> Row:
    """Time two contenders in turns for about that long; who goes first changes every round."""
    (ours_times, baseline_times), ratios = _rounds((ours, baseline), seconds)
    low, middle, high = statistics.quantiles(ratios, n=4)
    return Row(
        group=group,
        what=what,
        size=size,
        ours=ours.name,
        seconds=statistics.median(ours_times),
        baseline=baseline.name,
        baseline_seconds=statistics.median(baseline_times),
        ratio=middle,
        ratio_low=low,
        ratio_high=high,
        rounds=len(ratios),
    )


def _rounds(contenders: tuple[Contender, ...], seconds: float) -> tuple[list[list[float]], list[float]]:
    """Run rounds of all contenders; return their times and, per round, last time / first time."""
    for contender in contenders:
        once(contender)  # compile, fill caches
    times: list[list[float]] = [[] for _ in contenders]
    collecting = gc.isenabled()
    gc.disable()
    try:
        end = time.perf_counter() + seconds
        for k in range(ROUNDS_MAX):
            if k >= ROUNDS_MIN and time.perf_counter() > end:
                break
            turns = range(len(contenders)) if k % 2 == 0 else reversed(range(len(contenders)))
            for turn in turns:
                times[turn].append(once(contenders[turn]))
    finally:
        if collecting:
            gc.enable()
    return times, [last / first for first, last in zip(times[0], times[-1], strict=True)]
