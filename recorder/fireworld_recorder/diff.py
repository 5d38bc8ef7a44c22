"""Compare two runs step by step, phase by phase: find where they first differ, and how that spread."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from functools import partial

from fireworld.errors import LogError, expected
from fireworld.records import CityRecord, Recording, Snapshot, StepRecord, Steps, StoredRun
from fireworld_recorder.header import header_differences
from fireworld_recorder.match import Rules
from fireworld_recorder.schema import Commit
from fireworld_recorder.spread import Spread, SpreadRow, SpreadTally
from fireworld_recorder.step_difference import (
    FirstDifference,
    describe,
    find_city_difference,
    find_differences,
    find_ending_difference,
    find_snapshot_difference,
)
from fireworld_recorder.totals import Totals, totals_at, totals_of, totals_over

__all__ = ["FirstDifference", "RunComparison", "StepRange", "compare"]


@dataclass(frozen=True)
class RunComparison:
    """How two runs compare."""

    first: FirstDifference | None
    """None if they are the same."""
    totals: tuple[Totals, Totals]
    """At the last step of each that was looked at."""
    header: Mapping[str, tuple[str | int, str | int]]
    """What the runs were asked to do differently; no difference by itself."""
    n_steps_compared: int
    n_steps_differing: Mapping[str, int]
    """By topic, in the order in which they began to differ; steps of different cities are not compared."""
    first_by_topic: Mapping[str, FirstDifference] = dataclasses.field(default_factory=dict)
    """By the same topics: the first difference of each."""
    spread: Spread = dataclasses.field(default_factory=Spread)
    """Empty for runs of one digest, which are not read, and of different cities."""

    @property
    def same(self) -> bool:
        """Whether the runs are the same, whatever their headers are."""
        return self.first is None


@dataclass(frozen=True, kw_only=True)
class StepRange:
    """Which steps are compared, both ends included; None is as far as there are any."""

    first: int | None = None
    last: int | None = None

    def __contains__(self, step: int) -> bool:
        return (self.first is None or step >= self.first) and (self.last is None or step <= self.last)


def compare(
    a: Steps,
    b: Steps,
    *,
    tolerances: Mapping[str, float] | None = None,
    ignore: Collection[str] = (),
    steps: StepRange | None = None,
    watch: Callable[[SpreadRow], None] | None = None,
) -> RunComparison:
    """Compare two runs on the steps that both have, in the order in which things happen within a step.

    NaN equals NaN. Steps that only one run has are a difference too, reported if there is no other. Snapshots are
    compared array by array, unless there are tolerances or ignored names.

    Args:
        a: the run that is right, or came first; each run is iterated over once.
        b: the run to compare with it.
        tolerances: by `topic.field` or `field`: the largest difference that counts as none.
        ignore: topics, `topic.field`s or `field`s to leave out.
        steps: the steps to compare; all if left out.
        watch: called for every step that either run has with how far the difference has come, unless the digests are
            the same or the cities are not.

    Raises:
        LogError: a tolerance or an ignored name is not a field, neither run has a step that is to be compared, or a
            log cannot be read.
    """
    rules = Rules(tolerances or {}, ignore)
    steps = steps or StepRange()
    _check_steps(a, b, steps)
    header = header_differences(a.header, b.header)
    if isinstance(a, StoredRun) and isinstance(b, StoredRun) and a.digest and a.digest == b.digest:
        totals = totals_of(a) if steps == StepRange() else totals_over(_within(a, steps), a.city)
        return RunComparison(None, (totals, totals), header, totals.n_steps, {})
    first = find_city_difference(a.city, b.city, rules)
    if first is not None:
        return RunComparison(first, (totals_of(a), totals_of(b)), header, 0, {})
    comparison = _Comparison(rules, SpreadTally(a.city, watch), a.city)
    comparison.take_steps(_within(a, steps), _within(b, steps))
    tally_a, tally_b = comparison.tallies
    return RunComparison(
        first=comparison.first,
        totals=(totals_at(tally_a.last, tally_a.n_steps, a.city), totals_at(tally_b.last, tally_b.n_steps, b.city)),
        header=header,
        n_steps_compared=comparison.n_compared,
        n_steps_differing=dict(comparison.n_differing),
        first_by_topic=comparison.first_by_topic,
        spread=comparison.spread.spread(),
    )


@dataclass
class _Tally:
    """What was read of one run."""

    n_steps: int = 0
    last: StepRecord | None = None
    alone: list[int] = dataclasses.field(default_factory=list)  # steps that the other run does not have

    def add(self, record: StepRecord) -> None:
        self.n_steps += 1
        self.last = record


class _Comparison:
    """A comparison under way."""

    def __init__(self, rules: Rules, spread: SpreadTally, city: CityRecord) -> None:
        self.first: FirstDifference | None = None
        self.first_by_topic: dict[str, FirstDifference] = {}
        self.n_compared = 0
        self.n_differing: Counter[str] = Counter()
        self.tallies = (_Tally(), _Tally())
        self.spread = spread
        self._rules = rules
        self._city = city

    def take_steps(self, a: Iterator[StepRecord], b: Iterator[StepRecord]) -> None:
        """Compare all steps; those of one run only count as a difference if there is no other."""
        for x, y in _aligned(a, b):
            for tally, record, other in zip(self.tallies, (x, y), (y, x), strict=True):
                if record is not None:
                    tally.add(record)
                    if other is None:
                        tally.alone.append(record.step)
            if x is not None and y is not None:
                self._take_step(x, y)
            else:
                self.spread.take_one(x, y)
        if self.first is None:
            self.first = _length_difference(*self.tallies)

    def _take_step(self, a: StepRecord, b: StepRecord) -> None:
        self.n_compared += 1
        found = find_differences(a, b, self._rules)
        in_words = partial(describe, a=a, b=b, city=self._city)
        for fields in found:
            topic = fields[0].topic
            self._note(topic, in_words(fields[0]) if topic not in self.first_by_topic else None)
        if self._rules.snapshots and a.snapshot is not None and b.snapshot is not None:
            difference = find_snapshot_difference(a.step, a.snapshot, b.snapshot)
            if difference is not None:
                self._note(Snapshot.topic, difference)
        ending = find_ending_difference(a, b, self._rules, self._city)
        if ending is not None:
            self._note(Commit.topic, ending)
        self.spread.take_both(a, b, found, in_words, differs=self.first is not None)

    def _note(self, topic: str, difference: FirstDifference | None) -> None:
        """Count a step in which a topic differs; a difference is given the first time only."""
        self.n_differing[topic] += 1
        if difference is not None:
            self.first_by_topic.setdefault(topic, difference)
            self.first = self.first or difference


def _check_steps(a: Steps, b: Steps, steps: StepRange) -> None:
    """Check that one of the runs has something of a range of steps, if both know which they have.

    Raises:
        LogError: with the steps that there are.
    """
    if steps == StepRange() or not (isinstance(a, Recording) and isinstance(b, Recording)):
        return
    held = {int(step) for run in (a, b) for step in run.steps}
    if any(step in steps for step in held):
        return
    wanted = f"a range of the steps {min(held)} to {max(held)}" if held else "recordings with steps"
    low, high = ("the first" if steps.first is None else steps.first, "the last" if steps.last is None else steps.last)
    raise LogError(expected("--from and --to", "", wanted, f"steps {low} to {high}"))


def _within(run: Steps, steps: StepRange) -> Iterator[StepRecord]:
    """Yield the steps that are to be compared, and read no further than the last of them."""
    for record in run:
        if steps.last is not None and record.step > steps.last:
            return
        if record.step in steps:
            yield record


def _aligned(a: Iterator[StepRecord], b: Iterator[StepRecord]) -> Iterator[tuple[StepRecord | None, StepRecord | None]]:
    """Pair the steps of two runs by number; None stands for a step that a run does not have."""
    x, y = next(a, None), next(b, None)
    while x is not None or y is not None:
        if y is None or (x is not None and x.step < y.step):
            yield x, None
            x = next(a, None)
        elif x is None or y.step < x.step:
            yield None, y
            y = next(b, None)
        else:
            yield x, y
            x, y = next(a, None), next(b, None)


def _length_difference(a: _Tally, b: _Tally) -> FirstDifference | None:
    """Report steps that only one run has."""
    if not a.alone and not b.alone:
        return None
    first_is_longer = bool(a.alone)
    steps = a.alone if first_is_longer else b.alone
    span = f"step {steps[0]} is" if len(steps) == 1 else f"{len(steps)} steps, {steps[0]} to {steps[-1]}, are"
    text = f"{span} only in the {'first' if first_is_longer else 'second'} run; all others are the same"
    return FirstDifference(steps[0], "length", "", "", None, None, a.n_steps, b.n_steps, text)
