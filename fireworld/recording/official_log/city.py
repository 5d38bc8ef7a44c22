"""The city of an official log, as a recording has it: outlines, streets and who is where at the start."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from fireworld.city.formats.official.keys import PREFIX, SYNONYMS
from fireworld.errors import LogError, expected
from fireworld.recording.official_log import names
from fireworld.recording.official_log.parts import Entity
from fireworld.recording.official_log.streets import streets_of
from fireworld.records import Array, CityRecord

FULL_HP: Final = 10_000
"""Health points of an unhurt person in the official program."""
_BEYOND_MM: Final = 1_000_000_000
"""Nothing of a city is farther from the origin."""
_TANK, _POWER, _RANGE = (
    (SYNONYMS[key], PREFIX + key) for key in ("water_capacity", "max_extinguish_power_sum", "water_distance")
)
"""Keys of the configuration, of which a log has one or both."""


@dataclass(frozen=True)
class Cast:
    """Who and what a log is about, in the order of the recording: as the log lists them.

    Attributes:
        buildings, brigades, civilians: those that are recorded.
        index: of each of them among its like, by its number in the log.
        hydrants: their entities.
        n_left_out: rescuers of other kinds, which a recording has no place for.
    """

    buildings: Sequence[Entity]
    brigades: Sequence[Entity]
    civilians: Sequence[Entity]
    hydrants: Sequence[Entity]
    n_left_out: int


def cast_of(entities: Sequence[Entity]) -> Cast:
    """Sort the entities of the start.

    Raises:
        LogError: two of them have one number, or there is no building.
    """
    taken = {entity.id for entity in entities}
    if len(taken) != len(entities):
        raise LogError(expected("initial conditions", "", "entities with numbers of their own", "a number twice"))
    buildings = [entity for entity in entities if entity.kind in names.BUILDINGS]
    if not buildings:
        raise LogError(expected("initial conditions", "", "at least one building", "none of them"))
    return Cast(
        buildings=buildings,
        brigades=[entity for entity in entities if entity.kind == names.FIRE_BRIGADE],
        civilians=[entity for entity in entities if entity.kind == names.CIVILIAN],
        hydrants=[entity for entity in entities if entity.kind == names.HYDRANT],
        n_left_out=sum(entity.kind in names.PEOPLE - {names.FIRE_BRIGADE, names.CIVILIAN} for entity in entities),
    )


def city_of(
    entities: Sequence[Entity], cast: Cast, settings: Mapping[str, str], *, name: str, civilians: Mapping[str, Array]
) -> tuple[CityRecord, set[str]]:
    """Return the city, and the fields of it that the log does not have.

    Args:
        entities: all entities of the start.
        cast: those that are recorded.
        settings: the kernel's configuration, empty if the log has none.
        name: what to call the city.
        civilians: where they are at the start, as `World.civilians`.

    Raises:
        LogError: a building has no outline, or a number that makes no sense.
    """
    outlines = [_outline(building) for building in cast.buildings]
    corner = np.concatenate(outlines) / 1000.0
    centers = np.array([_center(one) for one in cast.buildings], dtype=np.float64).reshape(-1, 2) / 1000.0
    hydrant = np.array([_center(one) for one in cast.hydrants], dtype=np.float64).reshape(-1, 2) / 1000.0
    low, high = corner.min(axis=0), corner.max(axis=0)
    node_m, streets = streets_of([one for one in entities if one.kind in names.AREAS])
    n = len(cast.brigades)
    given = {key: _setting(settings, keys) for key, keys in (("tank", _TANK), ("power", _POWER), ("range", _RANGE))}
    absent = {f"brigade_{key}_{unit}" for key, unit in (("tank", "litres"), ("power", "litres"), ("range", "m"))
              if given[key] is None}  # fmt: skip
    none = np.zeros(0)
    city = CityRecord(
        name=name,
        building_id=_column(cast.buildings, lambda one: one.id, np.int32),
        outline_ptr=np.cumsum([0, *map(len, outlines)]).astype(np.int32),
        outline_x_m=corner[:, 0].copy(),
        outline_y_m=corner[:, 1].copy(),
        center_x_m=centers[:, 0].copy(),
        center_y_m=centers[:, 1].copy(),
        floors=_column(cast.buildings, lambda one: _number(one, names.FLOORS, 1, 1, 1000), np.int32),
        material=_column(cast.buildings, lambda one: _number(one, names.BUILDING_CODE, 0, 0, 2), np.uint8),
        inflammable=_column(cast.buildings, lambda one: _is_inflammable(one, settings), np.uint8),
        ground_area_m2=_column(cast.buildings, _ground_area, np.float32),
        volume_m3=none,
        initial_fuel=none,
        heat_capacity=none,
        ignition_point=none,
        wall_area_m2=none,
        link_ptr=none,
        link_building=none,
        link_share=none,
        node_x_m=node_m[:, 0].copy(),
        node_y_m=node_m[:, 1].copy(),
        street_from=streets[:, 0].copy(),
        street_to=streets[:, 1].copy(),
        refuge_building=np.array([k for k, one in enumerate(cast.buildings) if one.kind == names.REFUGE], np.int32),
        hydrant_x_m=hydrant[:, 0].copy(),
        hydrant_y_m=hydrant[:, 1].copy(),
        civilian_x_m=civilians["x_m"],
        civilian_y_m=civilians["y_m"],
        civilian_building=civilians["in_building"],
        civilian_hp=np.full(len(cast.civilians), FULL_HP, dtype=np.int32),
        brigade_tank_litres=np.full(n, given["tank"] or 0, dtype=np.int32),  # its length is the number of brigades
        brigade_power_litres=none if given["power"] is None else np.full(n, given["power"], dtype=np.int32),
        brigade_range_m=none if given["range"] is None else np.full(n, given["range"] / 1000.0),
        air_origin_x_m=0.0,
        air_origin_y_m=0.0,
        air_cell_m=0.0,
        air_nx=0,
        air_ny=0,
        middle_x_m=float(low[0] + high[0]) / 2,
        middle_y_m=float(low[1] + high[1]) / 2,
    )
    return city, {f"city.{key}" for key in absent}


def _outline(building: Entity) -> Array:
    """Return the corners of a building, (corners, 2) whole millimetres: where its edges start."""
    edges = building.properties.get(names.EDGES)
    corners = [(edge.x, edge.y) for edge in edges] if isinstance(edges, Sequence) else []
    if len(set(corners)) < 3:
        raise LogError(expected(f"building {building.id}", "edges", "at least 3 distinct corners", len(set(corners))))
    _check_near(building, (number for corner in corners for number in corner))
    return np.array(corners, dtype=np.int64)


def _center(area: Entity) -> tuple[int, int]:
    """Return the middle of an area as the log has it, in mm."""
    x, y = (area.properties.get(axis) for axis in (names.X, names.Y))
    if not isinstance(x, int) or not isinstance(y, int):
        raise LogError(expected(f"{names.ENTITIES[area.kind]} {area.id}", "x, y", "its position", "no position"))
    _check_near(area, (x, y))
    return x, y


def _check_near(entity: Entity, numbers: Iterable[int]) -> None:
    if any(not -_BEYOND_MM <= number <= _BEYOND_MM for number in numbers):
        what = f"{names.ENTITIES[entity.kind]} {entity.id}"
        raise LogError(expected(what, "", f"positions within {_BEYOND_MM // 10**6} km", "one farther away"))


def _ground_area(building: Entity) -> float:
    return float(_number(building, names.GROUND_AREA, None, 0, 10**9))


def _number(entity: Entity, name: int, default: int | None, low: int, high: int) -> int:
    """Return a whole number of an entity; LogError if it makes no sense, or is not there without a default."""
    value = entity.properties.get(name)
    value = default if value is None else value
    if not isinstance(value, int) or not low <= value <= high:
        where = f"{names.ENTITIES[entity.kind]} {entity.id}"
        raise LogError(expected(where, names.PROPERTIES[name], f"a number from {low} to {high}", value))
    return value


def _is_inflammable(building: Entity, settings: Mapping[str, str]) -> bool:
    key = names.NOT_INFLAMMABLE.get(building.kind)
    return key is None or settings.get(key) == "true"


def _setting(settings: Mapping[str, str], keys: Sequence[str]) -> int | None:
    """Return the first whole number that the configuration has at some keys; None if there is none."""
    for key in keys:
        text = settings.get(key, "").strip()
        if text.isdecimal() and len(text) < 10:
            return int(text)
    return None


def _column(entities: Sequence[Entity], value: Any, dtype: Any) -> Array:
    return np.array([value(entity) for entity in entities], dtype=dtype)
