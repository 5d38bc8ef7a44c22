"""Where one step of two runs differs: field by field, in the order in which things happened, and in words."""

from __future__ import annotations

import dataclasses
import sys
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

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
from fireworld_recorder import words
from fireworld_recorder.match import Rules, Spot, find, unequal_entries
from fireworld_recorder.schema import Commit, Field

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


class Place(NamedTuple):
    """A field that differs in a step, and its first entry that does."""

    topic: str
    item: Field
    spot: Spot


def find_places(a: StepRecord, b: StepRecord, rules: Rules) -> list[list[Place]]:
    """Find all fields that differ in a step.

    Returns:
        A list for each topic that differs, in the order in which things happened: a brigade sees what those before it
        chose. The first place of each list is where the difference in that topic begins: at the first field; of what
        brigades see and choose, one after another, at the first brigade.
    """
    found = [places for topic in STEP_TOPICS if (places := _places_in(topic.topic, a, b, rules))]
    topics = [places[0].topic for places in found]
    if {*_IN_TURN} <= {*topics}:
        seen = topics.index(Observations.topic)
        if _turn(found[seen + 1][0]) < _turn(found[seen][0]):
            found[seen], found[seen + 1] = found[seen + 1], found[seen]
    return found


def _places_in(topic: str, a: StepRecord, b: StepRecord, rules: Rules) -> list[Place]:
    """Find the fields of one topic that differ, the one where the difference begins first."""
    x, y = getattr(a, topic[1:]), getattr(b, topic[1:])
    places = [
        Place(topic, item, spot)
        for item, tolerance in rules.fields[topic]
        if (spot := find(item, getattr(x, item.name), getattr(y, item.name), tolerance)) is not None
    ]
    return sorted(places, key=_turn) if topic in _IN_TURN else places


def _turn(place: Place) -> int:
    """Return the brigade whose turn a difference in observations or decisions belongs to.

    -1 for what is there before anyone's turn; the errors of learning, and lengths, come after everyone's.
    """
    if place.item.name == "td_error" or place.spot.lengths:
        return sys.maxsize
    if place.spot.position is None or place.item.per != "brigade":
        return -1
    return place.spot.position // place.item.width


def find_city_difference(a: CityRecord, b: CityRecord, rules: Rules) -> FirstDifference | None:
    """Find the first difference between two cities."""
    for item, tolerance in rules.fields[CityRecord.topic]:
        spot = find(item, getattr(a, item.name), getattr(b, item.name), tolerance)
        if spot is not None:
            return _describe(None, Place(CityRecord.topic, item, spot), a)
    return None


def find_ending_difference(a: StepRecord, b: StepRecord, rules: Rules, city: CityRecord) -> FirstDifference | None:
    """Find out whether a step was the last one of one run only."""
    for item in rules.endings:
        spot = find(item, getattr(a, item.name), getattr(b, item.name))
        if spot is not None:
            return _describe(a, Place(Commit.topic, item, spot), city)
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


def describe(place: Place, a: StepRecord, b: StepRecord, city: CityRecord) -> FirstDifference:
    """Put a difference in a step into words; `b` is told against `a`."""
    difference = _describe(a, place, city)
    if place.topic == Events.topic:
        return _with_sentence(difference, words.events_sentence(a.events, b.events))
    if place.topic == Decisions.topic and place.item.name == "action" and place.spot.position is not None:
        why = words.reason(a, b, place.spot.position)
        return _with_sentence(difference, f"{difference.sentence}; {why}" if why else difference.sentence)
    return difference


def _describe(step: StepRecord | None, found: Place, city: CityRecord) -> FirstDifference:
    """Put a difference into words; `step` is the first run's, None for the city."""
    topic, item, spot = found
    phase = PHASES.get(topic, "end")
    index = None if spot.position is None else spot.position // item.width
    if spot.lengths:
        text = words.length_sentence(item, spot.a // item.width, spot.b // item.width)
    else:
        entity = None if index is None else words.entity_words(item.per, index, city=city, step=step)
        text = words.sentence(topic, item, entity, spot)
    place = phase if step is None else f"step {step.step}, {phase}"
    return FirstDifference(
        step=None if step is None else step.step,
        phase=phase,
        topic=topic,
        field=item.name,
        entity=item.per or None,
        index=index,
        a=spot.a,
        b=spot.b,
        sentence=f"{place}: {text}",
    )


def _with_sentence(difference: FirstDifference, text: str) -> FirstDifference:
    prefix = f"step {difference.step}, {difference.phase}: "
    return dataclasses.replace(difference, sentence=prefix + text.removeprefix(prefix))
