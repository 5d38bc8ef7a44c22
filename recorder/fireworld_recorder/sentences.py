"""Write in words where two runs differ: the entity, the field and both values."""

from __future__ import annotations

import math
from typing import Any

from fireworld.records import (
    ACTIONS,
    EVENT_ENTITIES,
    EVENT_KINDS,
    Array,
    CityRecord,
    Decisions,
    Draws,
    Events,
    StepRecord,
    name_of,
)
from fireworld_recorder.match import FieldDifference
from fireworld_recorder.schema import Field


def entity_words(kind: str, index: int, *, city: CityRecord, step: StepRecord | None) -> str:
    """Name an entity by kind and index, and by its identifier where it has one."""
    if kind == "building" and index < len(city.building_id):
        return f"building {index} (id {city.building_id[index]})"
    if kind == "site" and step is not None and index < len(step.observations.site_id):
        return f"site {step.observations.site_id[index]}"
    return f"{kind} {index}"


def show(topic: str, item: Field, value: Any) -> str:
    """Write a value: by its name if it stands for one, else as a number."""
    if item.names and 0 <= value < len(item.names):
        return item.names[int(value)]
    if topic == Decisions.topic and item.name in {"action", "target"} and value == -1:
        return "none"
    return str(value)


def apart(a: Any, b: Any) -> str:
    """Write how far two numbers are apart; empty for values that have no distance."""
    if isinstance(a, str | bool) or isinstance(b, str | bool) or not (math.isfinite(a) and math.isfinite(b)):
        return ""
    return f"{abs(a - b):.3g}"


def sentence(found: FieldDifference, entity: str | None) -> str:
    """Write what a value is in the second run (b) and was in the first (a)."""
    topic, item = found.topic, found.item
    if found.lengths:
        return f"{_words(item)} is there for {found.b // item.width} {item.per}s, was for {found.a // item.width}"
    shown_a, shown_b = show(topic, item, found.a), show(topic, item, found.b)
    if topic == Decisions.topic and item.name == "action":
        return f"{entity} chose {shown_b}, was {shown_a}"
    if topic == Draws.topic and item.name == "key":
        return "the runs have different random draws: another seed, or another way to draw"
    field = _words(item)
    if topic == Decisions.topic and item.name == "q_values" and found.position is not None:
        field = f"Q of {ACTIONS[found.position % item.width]}"
    distance = "" if item.names else apart(found.a, found.b)
    subject = f"{entity}: {field}" if entity else field
    return f"{subject} is {shown_b}, was {shown_a}" + (f" (differs by {distance})" if distance else "")


def _words(item: Field) -> str:
    return item.name.replace("_", " ")


def reason(a: StepRecord, b: StepRecord, brigade: int) -> str:
    """Return why a brigade chose another action: another Q-value, or an exploring draw; empty if it is neither."""
    n = len(ACTIONS)
    q_a, q_b = (step.decisions.q_values[brigade * n : (brigade + 1) * n] for step in (a, b))
    if len(q_a) == len(q_b) == n:
        chosen = (int(b.decisions.action[brigade]), int(a.decisions.action[brigade]), *range(n))
        for action in chosen:
            if 0 <= action < n and q_a[action] != q_b[action]:
                state = _at(a.observations.state_index, brigade)
                distance = apart(float(q_a[action]), float(q_b[action]))
                return f"Q of {ACTIONS[action]} in state {state} differs by {distance}"
    explored_a, explored_b = _at(a.decisions.explored, brigade), _at(b.decisions.explored, brigade)
    if explored_a == explored_b:
        return ""
    return "it explored" if explored_b else "it did not explore"


def events_sentence(a: Events, b: Events) -> str:
    """Name the first event that differs."""
    index = 0
    while index < min(len(a.kind), len(b.kind)) and _event_words(a, index) == _event_words(b, index):
        index += 1
    return f"event {index} is {_event_words(b, index)}, was {_event_words(a, index)}"


def _event_words(events: Events, index: int) -> str:
    """Name one event, such as "burnt-out building 7"; "nothing" beyond the last."""
    if index >= len(events.kind):
        return "nothing"
    code = int(events.kind[index])
    kind = name_of(EVENT_KINDS, code, "event of kind")
    return f"{kind} {EVENT_ENTITIES.get(kind, 'building')} {_at(events.entity, index)}"


def _at(values: Array, index: int) -> Any:
    return values[index].item() if index < len(values) else None
