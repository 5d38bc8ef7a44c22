"""Compare two runs step by step, phase by phase, and find where they first differ."""

from __future__ import annotations

import dataclasses
import sys
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from fireworld.records import (
    PHASES,
    STEP_TOPICS,
    CityRecord,
    Decisions,
    Events,
    Observations,
    Recording,
    RunHeader,
    Snapshot,
    StepRecord,
)
from recorder import words
from recorder.match import Rules, Spot, find, first_unequal
from recorder.schema import Commit, Field, message_of
from recorder.totals import Totals, totals_at, totals_of

_IN_TURN: Final = (Observations.topic, Decisions.topic)
_ENDINGS: Final = tuple(item for item in message_of(Commit).fields if item.wire == "bool")


@dataclass(frozen=True)
class FirstDifference:
    """The first place where two runs differ."""

    step: int | None
    """None in the city."""
    phase: str
    """One of records.PHASES, "end" for how a run ended, "length" for steps that only one run has."""
    topic: str
    field: str
    entity: str | None
    """building, brigade, civilian, site, event or entry; None for a single value."""
    index: int | None
    """Of the entity."""
    a: Any
    b: Any
    sentence: str


@dataclass(frozen=True)
class Difference:
    """How two runs compare."""

    first: FirstDifference | None
    """None if they are the same."""
    totals: tuple[Totals, Totals]
    header: Mapping[str, tuple[str | int, str | int]]
    """What the runs were asked to do differently; no difference by itself."""
    n_steps_compared: int
    n_steps_differing: Mapping[str, int]
    """By topic; of another city's steps nothing is compared."""

    @property
    def same(self) -> bool:
        """Whether the runs are the same, whatever their headers say."""
        return self.first is None


def compare(
    a: Recording, b: Recording, *, tolerances: Mapping[str, float] | None = None, ignore: Collection[str] = ()
) -> Difference:
    """Compare two runs on the steps that both have, in the order in which things happen within a step.

    NaN equals NaN. Steps that only one run has are a difference too, reported if there is no other. Snapshots are
    compared array by array, unless there is a tolerance.

    Args:
        a: the run that is right, or came first.
        b: the run to hold against it.
        tolerances: by `topic.field` or `field`: the largest difference that counts as none.
        ignore: topics, `topic.field`s or `field`s to leave out.

    Raises:
        LogError: a tolerance or an ignored name is not a field, or a log cannot be read.
    """
    rules = Rules(tolerances or {}, ignore)
    header = _header_differences(a.header, b.header)
    digest = getattr(a, "digest", None)
    if digest is not None and digest == getattr(b, "digest", None):
        totals = totals_of(a)
        return Difference(None, (totals, totals), header, totals.n_steps, {})
    comparison = _Comparison(rules, a.city)
    comparison.take_city(b.city)
    if comparison.first is not None:
        return Difference(comparison.first, (totals_of(a), totals_of(b)), header, 0, {})
    comparison.take_steps(iter(a), iter(b))
    tally_a, tally_b = comparison.tallies
    return Difference(
        first=comparison.first,
        totals=(totals_at(tally_a.last, tally_a.n_steps), totals_at(tally_b.last, tally_b.n_steps)),
        header=header,
        n_steps_compared=comparison.n_compared,
        n_steps_differing=dict(comparison.n_differing),
    )


@dataclass
class _Tally:
    """What has come by of one run."""

    n_steps: int = 0
    last: StepRecord | None = None
    alone: list[int] = dataclasses.field(default_factory=list)  # steps that the other run does not have

    def add(self, record: StepRecord) -> None:
        self.n_steps += 1
        self.last = record


class _Comparison:
    """The comparison while the steps come by."""

    def __init__(self, rules: Rules, city: CityRecord) -> None:
        self.first: FirstDifference | None = None
        self.n_compared = 0
        self.n_differing: Counter[str] = Counter()
        self.tallies = (_Tally(), _Tally())
        self._rules = rules
        self._city = city

    def take_city(self, other: CityRecord) -> None:
        """Compare the cities."""
        for item, tolerance in self._rules.fields[CityRecord.topic]:
            spot = find(item, getattr(self._city, item.name), getattr(other, item.name), tolerance)
            if spot is not None and self.first is None:
                self.first = _describe(None, CityRecord.topic, item, spot, self._city)

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
        if self.first is None:
            self.first = _length_difference(*self.tallies)

    def _take_step(self, a: StepRecord, b: StepRecord) -> None:
        self.n_compared += 1
        found = [(topic.topic, self._first_spot(topic.topic, a, b)) for topic in STEP_TOPICS]
        for name, item, spot in _as_it_happened([(topic, *place) for topic, place in found if place is not None]):
            self._note(name, self._tell(name, item, spot, a, b))
        if self._rules.snapshots and a.snapshot is not None and b.snapshot is not None:
            self._take_snapshot(a.step, a.snapshot, b.snapshot)
        for item in _ENDINGS:
            ending = find(item, getattr(a, item.name), getattr(b, item.name))
            if ending is not None:
                self._note(Commit.topic, _describe(a, Commit.topic, item, ending, self._city))
                break

    def _first_spot(self, topic: str, a: StepRecord, b: StepRecord) -> tuple[Field, Spot] | None:
        """Find the first difference in one topic of a step.

        That is the first field's; of what brigades see and choose, one after another, the first brigade's.
        """
        x, y = getattr(a, topic[1:]), getattr(b, topic[1:])
        spots = (
            (item, spot)
            for item, tolerance in self._rules.fields[topic]
            if (spot := find(item, getattr(x, item.name), getattr(y, item.name), tolerance)) is not None
        )
        if topic not in _IN_TURN:
            return next(spots, None)
        return min(spots, key=lambda place: _turn(*place), default=None)

    def _tell(self, topic: str, item: Field, spot: Spot, a: StepRecord, b: StepRecord) -> FirstDifference:
        """Put a difference in one topic of a step into words."""
        difference = _describe(a, topic, item, spot, self._city)
        if topic == Events.topic:
            return _with_sentence(difference, words.events_sentence(a.events, b.events))
        if topic == Decisions.topic and item.name == "action" and spot.position is not None:
            why = words.reason(a, b, spot.position)
            return _with_sentence(difference, f"{difference.sentence}; {why}" if why else difference.sentence)
        return difference

    def _take_snapshot(self, step: int, x: Snapshot, y: Snapshot) -> None:
        """Compare the arrays that both snapshots hold."""
        for name in sorted(x.arrays.keys() & y.arrays.keys()):
            a, b = x.arrays[name], y.arrays[name]
            if a.shape != b.shape:
                place, shown_a, shown_b, index = name, str(a.shape), str(b.shape), None
            else:
                index = first_unequal(a.ravel(), b.ravel())
                if index is None:
                    continue
                place = f"{name}[{index}]"
                shown_a, shown_b = a.flat[index].item(), b.flat[index].item()
            text = f"step {step}, {PHASES[Snapshot.topic]}: {place} is {shown_b}, was {shown_a}"
            difference = FirstDifference(
                step, PHASES[Snapshot.topic], Snapshot.topic, name, "entry", index, shown_a, shown_b, text
            )
            self._note(Snapshot.topic, difference)
            return

    def _note(self, topic: str, difference: FirstDifference) -> None:
        self.n_differing[topic] += 1
        if self.first is None:
            self.first = difference


def _turn(item: Field, spot: Spot) -> int:
    """Return the brigade whose turn a difference in observations or decisions belongs to.

    -1 for what is there before anyone's turn; the errors of learning, and lengths, come after everyone's.
    """
    if item.name == "td_error" or spot.lengths:
        return sys.maxsize
    if spot.position is None or words.entity_kind(item) != "brigade":
        return -1
    return words.entity_index(item, spot.position)


def _as_it_happened(places: list[tuple[str, Field, Spot]]) -> list[tuple[str, Field, Spot]]:
    """Order a step's differences, given by topic, as they came about: a brigade sees what those before it chose."""
    topics = [topic for topic, _, _ in places]
    if topics.count(Observations.topic) and topics.count(Decisions.topic):
        seen, chosen = topics.index(Observations.topic), topics.index(Decisions.topic)
        if _turn(*places[chosen][1:]) < _turn(*places[seen][1:]):
            places[seen], places[chosen] = places[chosen], places[seen]
    return places


def _describe(step: StepRecord | None, topic: str, item: Field, spot: Spot, city: CityRecord) -> FirstDifference:
    """Put a difference into words; `step` is the first run's, None for the city."""
    phase = PHASES.get(topic, "end")
    kind = words.entity_kind(item) if item.repeated else None
    index = None if spot.position is None else words.entity_index(item, spot.position)
    if spot.lengths:
        text = words.length_sentence(item, kind or "entry", spot.a, spot.b)
    else:
        entity = None if index is None else words.entity_words(kind or "entry", index, city=city, step=step)
        text = words.sentence(topic, item, entity, spot)
    place = phase if step is None else f"step {step.step}, {phase}"
    return FirstDifference(
        step=None if step is None else step.step,
        phase=phase,
        topic=topic,
        field=item.name,
        entity=kind,
        index=index,
        a=spot.a,
        b=spot.b,
        sentence=f"{place}: {text}",
    )


def _with_sentence(difference: FirstDifference, text: str) -> FirstDifference:
    prefix = f"step {difference.step}, {difference.phase}: "
    return dataclasses.replace(difference, sentence=prefix + text.removeprefix(prefix))


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


def _header_differences(a: RunHeader, b: RunHeader) -> dict[str, tuple[str | int, str | int]]:
    names = [item.name for item in dataclasses.fields(RunHeader) if item.name != "attachments"]
    return {name: (getattr(a, name), getattr(b, name)) for name in names if getattr(a, name) != getattr(b, name)}
