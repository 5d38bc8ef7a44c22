"""Places of a plan by the ids that its map gives them: buildings and roads, refuges and hydrants."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Protocol

import numpy as np

from fireworld.city.city import Plan, RoadMap, freeze
from fireworld.city.formats.json_plan import BUILDING_TYPES
from fireworld.city.outlines import Corner

UNKNOWN_SHOWN_MAX: Final = 5
PLAIN, REFUGE, GAS_STATION = (BUILDING_TYPES.index(name) for name in ("building", "refuge", "gasstation"))


class Refuse(Protocol):
    """Raises the error for what a plan does not have."""

    def __call__(self, wanted: str, got: object) -> Any:
        """Raise it."""


class RefuseKey(Protocol):
    """Raises the error for a key that names what a plan does not have."""

    def __call__(self, key: str, wanted: str, got: object) -> Any:
        """Raise it."""


@dataclass(frozen=True)
class Place:
    """A building, or a place on a road."""

    building: int  # index, -1 outdoors
    node: int  # of the streets, -1 in a building
    point_mm: Corner


def in_building(plan: Plan, building: int) -> Place:
    """Return the place in a building, by its index: its centroid."""
    x, y = plan.footprints.centroid_mm[building].tolist()
    return Place(building, -1, (x, y))


def find_buildings(plan: Plan, building_ids: Sequence[int], *, refuse: Refuse) -> list[int]:
    """Return the indices of buildings by their ids; `refuse` raises for unknown ones."""
    index = _index(plan)
    unknown = [building_id for building_id in building_ids if building_id not in index]
    if unknown:
        refuse(f"ids of buildings of {plan.name}", _unknown(unknown))
    return [index[building_id] for building_id in building_ids]


def find_places(plan: Plan, ids: Sequence[int], *, refuse: Refuse) -> list[Place]:
    """Return places by the ids of buildings and roads; `refuse` raises for unknown ones."""
    buildings, roads = _index(plan), _road_index(plan)
    unknown = [one for one in ids if one not in buildings and one not in roads]
    if unknown:
        what = "buildings and roads" if roads else "buildings"
        refuse(f"ids of {what} of {plan.name}", _unknown(unknown))
    return [
        in_building(plan, buildings[one])
        if plan.roads is None or one in buildings
        else _on_road(plan, plan.roads, roads[one])
        for one in ids
    ]


def with_places(
    plan: Plan,
    *,
    refuges: Sequence[int] | None,
    hydrants: Sequence[int] | None,
    gas_stations: Sequence[int] | None,
    refuse: RefuseKey,
) -> Plan:
    """Return a plan with other refuges, hydrants or gas stations than its map has; None leaves them as they are.

    Refuges and gas stations are ids of buildings, hydrants of roads. A refuge does not burn; what was one and is none
    any more does. `refuse` raises for unknown ids; it takes the key first.
    """
    for key, name, ids in (("city.refuges", "refuge", refuges), ("city.gas_stations", "gasstation", gas_stations)):
        if ids is not None:
            plan = _with_kind(plan, BUILDING_TYPES.index(name), find_buildings(plan, ids, refuse=_at(refuse, key)))
    if hydrants is None:
        return plan
    roads = _road_index(plan)
    unknown = [one for one in hydrants if one not in roads]
    if unknown:
        refuse("city.hydrants", f"ids of roads of {plan.name}", _unknown(unknown))
    node = [_on_road(plan, plan.roads, roads[one]).node for one in hydrants] if plan.roads is not None else []
    return freeze(replace(plan, streets=replace(plan.streets, hydrant_node=np.array(node, dtype=np.int32))))


def _at(refuse: RefuseKey, key: str) -> Refuse:
    return lambda wanted, got: refuse(key, wanted, got)


def _with_kind(plan: Plan, kind: int, buildings: Sequence[int]) -> Plan:
    """Return a plan in which just these buildings, by index, are of a kind."""
    footprints = plan.footprints
    kinds = (footprints.refuge if plan.kind is None else plan.kind).copy()  # 0 building, 1 refuge in either
    inflammable = footprints.inflammable.copy()
    before = kinds == kind
    kinds[before], inflammable[before] = PLAIN, 1
    kinds[buildings], inflammable[buildings] = kind, kind != REFUGE
    refuge = (kinds == REFUGE).astype(np.uint8)
    return freeze(replace(plan, footprints=replace(footprints, refuge=refuge, inflammable=inflammable), kind=kinds))


def _on_road(plan: Plan, roads: RoadMap, road: int) -> Place:
    """Return the place in the middle of a road, by its index; the nearest node, where streets are footpaths."""
    x, y = roads.centroid_mm[road].tolist()
    if len(plan.streets.entrance_node):
        return Place(-1, road, (x, y))
    away = plan.streets.node_mm.astype(np.int64) - (x, y)
    return Place(-1, int(np.argmin((away * away).sum(axis=1))), (x, y))


def _index(plan: Plan) -> dict[int, int]:
    return {building_id: at for at, building_id in enumerate(plan.footprints.building_id.tolist())}


def _road_index(plan: Plan) -> dict[int, int]:
    return {} if plan.roads is None else {road_id: at for at, road_id in enumerate(plan.roads.road_id.tolist())}


def _unknown(ids: Sequence[int]) -> str:
    return f"unknown ids: {', '.join(str(one) for one in ids[:UNKNOWN_SHOWN_MAX])}"
