"""Whether what a log holds fits its city: numbers of entries, indices, codes, and that numbers are numbers."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, Final

import numpy as np

from fireworld.errors import LogError
from fireworld.records import Brigades, Buildings, CityRecord, Civilians, Decisions
from fireworld_recorder.schema import Field, message_of

_FLOATS: Final = frozenset({"double", "float"})
ALWAYS: Final = (Brigades, Buildings, Civilians, CityRecord)
"""Topics whose columns are there in every step, and whose numbers all have names; others have no columns in step 0, and
later versions may add names."""
BUILDING: Final = frozenset({"link_building", "refuge_building", "civilian_building", "in_building"})
"""Fields that hold indices of buildings, -1 for none."""
PLACES: Final = frozenset({"x_m", "y_m", "outline_x_m", "outline_y_m", "node_x_m", "node_y_m"})
PLACE_MAX_M: Final = 1e8
"""Farther away is nothing: more than twice around the earth."""

Lacks = Callable[[str], bool]
"""Says whether a log does not have a field, as in "buildings.energy"."""


def _lacks_nothing(_: str) -> bool:
    return False


def counts_of(city: CityRecord) -> dict[str, int]:
    """Return how many entries there are for each of what a city has."""
    return {
        "building": len(city.building_id),
        "brigade": len(city.brigade_tank_litres),
        "civilian": len(city.civilian_hp),
        "offset": len(city.building_id) + 1,
    }


def check_city(city: CityRecord, lacks: Lacks = _lacks_nothing) -> None:
    """Raise LogError if the columns of a city do not fit each other; `lacks`: what the log does not have."""
    counts = counts_of(city)
    for item in _fields(CityRecord):
        check_field(CityRecord, item, getattr(city, item.name), counts, lacks)
    for offsets, entries in (("outline_ptr", city.outline_x_m), ("link_ptr", city.link_building)):
        column = getattr(city, offsets)
        if lacks(f"city.{offsets}") and not len(column) and not len(entries):
            continue
        if column[0] != 0 or (np.diff(column) < 0).any() or column[-1] != len(entries):
            raise LogError(f"/city: {offsets}: it does not divide {len(entries)} entries")
    same = {"corners": (city.outline_x_m, city.outline_y_m), "links": (city.link_building, city.link_share)}
    same |= {"nodes": (city.node_x_m, city.node_y_m), "streets": (city.street_from, city.street_to)}
    same |= {"hydrants": (city.hydrant_x_m, city.hydrant_y_m)}
    for what, (first, second) in same.items():
        if len(first) != len(second):
            raise LogError(f"/city: columns of {what} of {len(first)} and {len(second)} entries")
    for ends in (city.street_from, city.street_to):
        if len(ends) and not 0 <= ends.min() <= ends.max() < len(city.node_x_m):
            raise LogError("/city: a street ends at a node that there is not")


_FIELDS: Final[dict[type[Any], tuple[Field, ...]]] = {}


def _fields(kind: type[Any]) -> tuple[Field, ...]:
    """Return the fields of a record type; worked out once."""
    if kind not in _FIELDS:
        _FIELDS[kind] = message_of(kind).fields
    return _FIELDS[kind]


def check_record(record: Any, counts: Mapping[str, int], lacks: Lacks = _lacks_nothing) -> None:
    """Raise LogError if a topic of a step does not fit the city; `lacks`: what the log does not have."""
    kind = type(record)
    lengths: dict[str, int] = {}
    for item in _fields(kind):
        value = getattr(record, item.name)
        check_field(kind, item, value, counts, lacks)
        if item.per in {"site", "event"}:
            first = lengths.setdefault(item.per, len(value))
            if len(value) != first:
                raise LogError(f"{kind.topic}: {item.name}: {len(value)} entries, where others have {first}")
    if isinstance(record, Decisions) and len(record.action) != len(record.target):
        raise LogError(f"{kind.topic}: {len(record.action)} actions and {len(record.target)} targets")


def check_field(
    kind: type[Any], item: Field, value: Any, counts: Mapping[str, int], lacks: Lacks = _lacks_nothing
) -> None:
    """Raise LogError if a field does not fit the city; `lacks`: what the log does not have."""
    if not item.repeated:
        if item.wire in _FLOATS and not math.isfinite(value):
            raise LogError(f"{kind.topic}: {item.name}: {value} is no number")
        return
    if item.per in counts:
        wanted = counts[item.per] * item.width
        always = kind in ALWAYS and not item.imported
        if len(value) != wanted and (len(value) or (always and not lacks(f"{kind.topic[1:]}.{item.name}"))):
            raise LogError(f"{kind.topic}: {item.name}: {len(value)} entries, where the city has {wanted}")
    if not len(value):
        return
    if item.wire in _FLOATS:
        _check_numbers(kind, item, value)
        return
    if item.names and kind in ALWAYS and not -1 <= int(value.min()) <= int(value.max()) < len(item.names):
        raise LogError(f"{kind.topic}: {item.name}: {int(value.max())} is none of {len(item.names)} names")
    if item.name in BUILDING and not -1 <= int(value.min()) <= int(value.max()) < counts["building"]:
        raise LogError(f"{kind.topic}: {item.name}: a building that there is not")


def _check_numbers(kind: type[Any], item: Field, value: Any) -> None:
    """Raise LogError if a column holds what is no number, or no place on earth."""
    # a sum is infinite or no number if one of them is, and takes half the time
    if not math.isfinite(value.sum()) and not np.isfinite(value).all():
        raise LogError(f"{kind.topic}: {item.name}: a value is no number")
    if item.name in PLACES and not -PLACE_MAX_M <= value.min() <= value.max() <= PLACE_MAX_M:
        raise LogError(f"{kind.topic}: {item.name}: a place more than {PLACE_MAX_M:g} m away")
