"""From the files of an official map to a plan, exactly as the official reader turns them into its world."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from fireworld.city.city import Plan, RoadMap, StreetMap, freeze
from fireworld.city.formats.json_plan import BUILDING_TYPES, COORDINATE_MAX_MM
from fireworld.city.formats.official.cfg import Config
from fireworld.city.formats.official.floors import floors_and_codes
from fireworld.city.formats.official.gml import Area, GmlMap, Point
from fireworld.city.formats.official.keys import INFLAMMABLE_KEYS, PREFIX
from fireworld.city.formats.official.measuring import exact_measures
from fireworld.city.formats.official.order import map_order, world_order
from fireworld.city.formats.official.passages import Outlined, find_passages
from fireworld.city.formats.official.report import Report
from fireworld.city.formats.official.scenario_xml import BUILDING_KINDS, ScenarioXml, check_places
from fireworld.city.outlines import Building, Corner, assemble
from fireworld.city.roads import road_map, sizes_of_parts, streets_of_roads
from fireworld.city.table_order import fullest_place
from fireworld.errors import CityError, expected

SPAN_MIN: Final = 5.0
"""A map less wide and less high than this is in degrees: no city is 5 m wide, and none 500 km."""
MM: Final = 1000.0
PLAIN: Final = "building"
PLACE_MAX: Final = 8
"""Entries that the official program lists in one place of a table; of more it makes a tree."""


@dataclass(frozen=True)
class Measured:
    """An area in the official program's numbers: truncated after they were computed in double precision."""

    corners: list[Corner]
    ends: list[Corner]
    centroid: Corner
    area_m2: int


def build_plan(gml: GmlMap, config: Config, scenario: ScenarioXml | None, *, name: str, report: Report) -> Plan:
    """Return the plan of a map; what was repaired, inferred or left out goes into the report.

    Raises:
        CityError: a map in degrees, places that are not on it, a configuration that makes no sense, a building without
            an area.
    """
    origin = _origin(gml)
    measured = {area.area_id: _measure(gml, area, origin) for area in (*gml.buildings, *gml.roads)}
    _note_outlines(gml, report)
    kinds = _kinds(gml, scenario, report)
    buildings = {area.area_id: area for area in gml.buildings}
    table = map_order(list(buildings))
    floors, codes = floors_and_codes([buildings[one] for one in table], config, report)
    n_people = scenario.n_people if scenario else 0
    plain = [one for one in table if one not in kinds]
    n_entities = len(gml.buildings) + len(gml.roads) + n_people
    order = world_order(plain, list(kinds), n_entities)
    if fullest_place(list(measured), n_entries=n_entities) > PLACE_MAX:
        text = f"more than {PLACE_MAX} areas in one place of the table: their order may differ from the official one"
        report.note("crowded-table", text)

    footprints = assemble(
        [
            Building(
                building_id=one,
                corners_mm=measured[one].corners,
                centroid_mm=measured[one].centroid,
                floors=floors[one],
                material=codes[one],
                ground_area_m2=measured[one].area_m2,
                inflammable=_is_inflammable(kinds.get(one, PLAIN), config),
                refuge=kinds.get(one) == "refuge",
            )
            for one in order
            if _has_area(gml, one, measured[one])
        ]
    )
    roads = _roads(gml, [buildings[one] for one in order], measured, report)
    streets = streets_of_roads(roads, footprints, _hydrants(gml, scenario, report))
    if len(streets.entrance_node) == 0:
        report.note("no-streets", "no road leads anywhere: footpaths are laid between the buildings")
    else:
        _note_streets(order, streets, report)
    return freeze(
        Plan(
            name=name,
            footprints=footprints,
            streets=streets,
            roads=roads,
            kind=np.array([BUILDING_TYPES.index(kinds.get(one, PLAIN)) for one in order], dtype=np.uint8),
        )
    )


def _origin(gml: GmlMap) -> Point:
    """Return the least x and y of all nodes; CityError if the unit of the map cannot be the metre."""
    xs, ys = [x for x, _ in gml.node.values()], [y for _, y in gml.node.values()]
    wide, high = max(xs) - min(xs), max(ys) - min(ys)
    if wide < SPAN_MIN and high < SPAN_MIN:
        got = f"{wide:.6g} by {high:.6g} over all nodes, as if in degrees"
        hint = "try a map that was converted to metres"
        raise CityError(expected(gml.where, "nodelist", "coordinates in metres", got, hint))
    if max(wide, high) * MM > COORDINATE_MAX_MM:
        wanted = f"a map of at most {COORDINATE_MAX_MM // 1_000_000} km a side"
        raise CityError(expected(gml.where, "nodelist", wanted, f"{max(wide, high) / MM:.6g} km"))
    return min(xs), min(ys)


def _measure(gml: GmlMap, area: Area, origin: Point) -> Measured:
    """Turn an area into whole millimetres and square metres.

    Area and centroid follow from the corners as they are before they are cut to whole millimetres.
    """
    node, edge = gml.node, gml.edge
    low_x, low_y = origin

    def place(at: int) -> Point:
        x, y = node[at]
        return (x - low_x) * MM, (y - low_y) * MM

    exact = [place(edge[one][0 if forward else 1]) for one, forward, _ in area.edges]
    ends = [place(edge[one][1 if forward else 0]) for one, forward, _ in area.edges]
    centroid, area_m2 = exact_measures(exact)
    return Measured(
        corners=[(int(x), int(y)) for x, y in exact],
        ends=[(int(x), int(y)) for x, y in ends],
        centroid=area.centroid_mm or centroid,
        area_m2=area_m2,
    )


def _has_area(gml: GmlMap, building: int, measured: Measured) -> bool:
    """Return True; CityError for a building that is too small to burn."""
    if measured.area_m2 < 1 or len(set(measured.corners)) < 3:
        got = f"{measured.area_m2} m2 and {len(set(measured.corners))} distinct corners"
        raise CityError(expected(gml.where, f"building {building}", "an area of at least 1 m2, 3 corners", got))
    return True


def _note_outlines(gml: GmlMap, report: Report) -> None:
    """Note outlines whose edges do not join, that are not closed, or that list their first corner again."""
    broken: dict[str, list[int]] = {"unjoined": [], "open": [], "closed": []}
    for area in (*gml.buildings, *gml.roads):
        ends = [gml.edge[edge] if forward else gml.edge[edge][::-1] for edge, forward, _ in area.edges]
        points = [(gml.node[start], gml.node[end]) for start, end in ends]
        if any(one[1] != other[0] for one, other in pairwise(points)):
            broken["unjoined"].append(area.area_id)
        if len(points) > 1 and points[0][0] == points[-1][0]:
            broken["closed"].append(area.area_id)
        if points[-1][1] != points[0][0]:
            broken["open"].append(area.area_id)
    text = "outlines with edges that do not join: corners are where edges start, joined by straight walls"
    report.note_areas("unjoined-edges", text, broken["unjoined"])
    text = "outlines that do not end where they begin: closed by a straight wall"
    report.note_areas("open-outlines", text, broken["open"])
    report.note_areas("closed-outlines", "outlines that list their first corner again: kept", broken["closed"])


def _kinds(gml: GmlMap, scenario: ScenarioXml | None, report: Report) -> dict[int, str]:
    """Return the kind of each building that is no plain one, in the order in which they are made of plain ones."""
    if scenario is None:
        report.note("no-scenario", "no scenario: all buildings are plain ones, and nobody is in the order of visits")
        return {}
    check_places(
        scenario,
        buildings={area.area_id for area in gml.buildings},
        roads={area.area_id for area in gml.roads},
    )
    kinds: dict[int, str] = {}
    for kind in BUILDING_KINDS:
        for place in scenario.at[kind]:
            kinds.pop(place, None)
            kinds[place] = kind
    return kinds


def _hydrants(gml: GmlMap, scenario: ScenarioXml | None, report: Report) -> list[int]:
    """Return the roads with a hydrant, each once."""
    roads = {area.area_id for area in gml.roads}
    places = dict.fromkeys(scenario.at["hydrant"] if scenario else ())
    indoors = [one for one in places if one not in roads]
    report.note_areas("hydrants-indoors", "hydrants on buildings: left out", indoors)
    return [one for one in places if one in roads]


def _is_inflammable(kind: str, config: Config) -> bool:
    key = INFLAMMABLE_KEYS.get(kind)
    return key is None or config.flag(PREFIX + key, default=False)


def _roads(gml: GmlMap, buildings: Sequence[Area], measured: dict[int, Measured], report: Report) -> RoadMap:
    """Return the roads and the passages between them and into buildings."""
    outlined = Outlined(
        areas=[*gml.roads, *buildings],
        corners={one: found.corners for one, found in measured.items()},
        ends={one: found.ends for one, found in measured.items()},
        n_roads=len(gml.roads),
    )
    return road_map(
        [road.area_id for road in gml.roads],
        [_without_repeats(measured[road.area_id].corners) for road in gml.roads],
        [measured[road.area_id].centroid for road in gml.roads],
        ((one.areas, (*one.edge[0], *one.edge[1])) for one in find_passages(outlined, report)),
    )


def _without_repeats(corners: Sequence[Corner]) -> list[Corner]:
    """Leave out corners that are listed twice in a row: roads send no rays."""
    kept = [one for at, one in enumerate(corners) if at == 0 or one != corners[at - 1]]
    return kept[:-1] if len(kept) > 1 and kept[0] == kept[-1] else kept


def _note_streets(order: Sequence[int], streets: StreetMap, report: Report) -> None:
    """Note buildings without entrance, and streets that are not connected."""
    lost = [one for one, node in zip(order, streets.entrance_node.tolist(), strict=True) if node < 0]
    text = "buildings without an entrance from a road: reached from the nearest point of any street"
    report.note_areas("no-entrance", text, lost)
    sizes = sizes_of_parts(streets)
    if len(sizes) > 1:
        rest = sum(sizes[1:])
        text = f"{len(sizes)} separate parts of the streets: the largest has {sizes[0]} nodes, the others {rest}"
        report.note("separate-parts", text)
