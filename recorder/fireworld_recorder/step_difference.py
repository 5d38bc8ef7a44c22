"""Where one step of two runs differs: field by field, in the order in which things happened, and in words."""

from __future__ import annotations

import dataclasses
import sys
from dataclasses import dataclass
from typing import Any, Final

from fireworld.records import (
    PHASES,
    STEP_TOPICS,
    CityRecord,
    Decisions,
    Events,
    Observations,
    Snapshot,
    StepRecord,
)
from fireworld_recorder import sentences
from fireworld_recorder.match import FieldDifference, Rules, find, unequal_entries
from fireworld_recorder.schema import Commit

_IN_TURN: Final = (Observations.topic, Decisions.topic)


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
    """As in `records.Entity`, or an entry of a snapshot's array; None for a single value."""
    index: int | None
    """Of the entity."""
    a: Any
    b: Any
    sentence: str


def find_differences(a: StepRecord, b: StepRecord, rules: Rules) -> list[list[FieldDifference]]:
    """Find all fields that differ in a step.

    Returns:
        A list for each topic that differs, in the order in which things happened: a brigade sees what those before it
        chose. Each list begins with the field in which the topic first differs: of what brigades see and choose, one
        after another, that of the first brigade.
    """
    found = [fields for topic in STEP_TOPICS if (fields := _differences_in(topic.topic, a, b, rules))]
    topics = [fields[0].topic for fields in found]
    if {*_IN_TURN} <= {*topics}:
        seen = topics.index(Observations.topic)
        if _turn(found[seen + 1][0]) < _turn(found[seen][0]):
            found[seen], found[seen + 1] = found[seen + 1], found[seen]
    return found


def _differences_in(topic: str, a: StepRecord, b: StepRecord, rules: Rules) -> list[FieldDifference]:
    """Find the fields of one topic that differ, the one where the difference begins first."""
    x, y = getattr(a, topic[1:]), getattr(b, topic[1:])
    found = [
        difference
        for item, tolerance in rules.fields[topic]
        if (difference := find(topic, item, getattr(x, item.name), getattr(y, item.name), tolerance)) is not None
    ]
    return sorted(found, key=_turn) if topic in _IN_TURN else found


def _turn(found: FieldDifference) -> int:
    """Return the brigade whose turn a difference in observations or decisions belongs to.

    -1 for what is there before anyone's turn; the errors of learning, and lengths, come after everyone's.
    """
    if found.item.name == "td_error" or found.lengths:
        return sys.maxsize
    return -1 if found.entity_index is None or found.item.per != "brigade" else found.entity_index


def find_city_difference(a: CityRecord, b: CityRecord, rules: Rules) -> FirstDifference | None:
    """Find the first difference between two cities."""
    for item, tolerance in rules.fields[CityRecord.topic]:
        found = find(CityRecord.topic, item, getattr(a, item.name), getattr(b, item.name), tolerance)
        if found is not None:
            return _describe(None, found, a)
    return None


def find_ending_difference(a: StepRecord, b: StepRecord, rules: Rules, city: CityRecord) -> FirstDifference | None:
    """Find out whether a step was the last one of one run only."""
    for item in rules.endings:
        found = find(Commit.topic, item, getattr(a, item.name), getattr(b, item.name))
        if found is not None:
            return _describe(a, found, city)
    return None


def find_snapshot_difference(step: int, a: Snapshot, b: Snapshot) -> FirstDifference | None:
    """Find the first difference between the arrays that both snapshots hold."""
    for name in sorted(a.arrays.keys() & b.arrays.keys()):
        x, y = a.arrays[name], b.arrays[name]
        if x.shape != y.shape:
            place, shown_a, shown_b, index = name, str(x.shape), str(y.shape), None
        else:
            unequal = unequal_entries(x.ravel(), y.ravel())
            if unequal is None:
                continue
            index = int(unequal.argmax())
            place, shown_a, shown_b = f"{name}[{index}]", x.flat[index].item(), y.flat[index].item()
        phase = PHASES[Snapshot.topic]
        text = f"step {step}, {phase}: {place} is {shown_b}, was {shown_a}"
        return FirstDifference(step, phase, Snapshot.topic, name, "entry", index, shown_a, shown_b, text)
    return None


def describe(found: FieldDifference, a: StepRecord, b: StepRecord, city: CityRecord) -> FirstDifference:
    """Put a difference in a step into words: what `b` has, and what `a` had."""
    difference = _describe(a, found, city)
    if found.topic == Events.topic:
        return _with_sentence(difference, sentences.events_sentence(a.events, b.events))
    if found.topic == Decisions.topic and found.item.name == "action" and found.entity_index is not None:
        why = sentences.reason(a, b, found.entity_index)
        return _with_sentence(difference, f"{difference.sentence}; {why}" if why else difference.sentence)
    return difference


def _describe(step: StepRecord | None, found: FieldDifference, city: CityRecord) -> FirstDifference:
    """Put a difference into words; `step` is the first run's, None for the city."""
    item, index = found.item, found.entity_index
    phase = PHASES.get(found.topic, "end")
    entity = None if index is None else sentences.entity_words(item.per, index, city=city, step=step)
    place = phase if step is None else f"step {step.step}, {phase}"
    return FirstDifference(
        step=None if step is None else step.step,
        phase=phase,
        topic=found.topic,
        field=item.name,
        entity=item.per or None,
        index=index,
        a=found.a,
        b=found.b,
        sentence=f"{place}: {sentences.sentence(found, entity)}",
    )


def _with_sentence(difference: FirstDifference, text: str) -> FirstDifference:
    prefix = f"step {difference.step}, {difference.phase}: "
    return dataclasses.replace(difference, sentence=prefix + text.removeprefix(prefix))
