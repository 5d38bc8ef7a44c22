"""City files: JSON to Plan, every mistake named by file, building and key.

The layout is the one of the official traces: `buildings`, each with id, apexes and more; optional `streets` and
`hydrants`. What a trace's city has of a run (ignitions, water, brigades) is left to who replays it.
"""

from __future__ import annotations

import json
from typing import Any, Final, Never

import numpy as np

from fireworld.city.city import Footprints, Int32Array, Int64Array, Plan, RoadMap, StreetMap, freeze
from fireworld.city.crossings import crossing_outlines
from fireworld.city.fields import Fields
from fireworld.city.footpaths import footpaths
from fireworld.city.formats.json_roads import read_links, read_roads
from fireworld.city.outlines import Building, Corner, assemble, centroid_mm, doubled_area_mm2, without_repeats
from fireworld.city.roads import streets_of_roads
from fireworld.city.streets import check_nodes
from fireworld.errors import CityError, expected

READ_KEYS: Final = ("name", "source", "buildings", "streets", "hydrants", "roads", "passages", "links")
IGNORED_KEYS: Final = (
    "brigade_moves", "brigades", "civilians", "comment", "extinguish", "ignitions", "later_ignitions", "seed", "steps",
    "units", "water",
)  # fmt: skip
BUILDING_KEYS: Final = ("id", "type", "apexes", "floors", "code", "ground_area", "x", "y", "inflammable", "source")
BUILDING_TYPES: Final = ("building", "refuge", "firestation", "ambulancecentre", "policeoffice", "gasstation")
"""Official types, in any spelling of case, spaces and underscores; fireworld knows refuges from the rest."""
COORDINATE_MAX_MM: Final = 1_000_000_000
"""A thousand kilometres from the origin: squares of distances still fit 64 bits."""
ID_MAX: Final = 2**31 - 1
CORNERS_MAX: Final = 4_000
"""Of one outline; twice what a way of OpenStreetMap can have."""
FLOORS_MAX: Final = 500
GROUND_AREA_MAX_M2: Final = 10_000_000
BUILDINGS_MAX: Final = 500_000
"""As in generated cities; reading so many takes about 2 GB."""
SOURCE_MAX_BYTES: Final = 65_536
SOURCE_DEPTH_MAX: Final = 20
IDS_SHOWN_MAX: Final = 5


def parse_plan(text: bytes, *, where: str, name: str = "city") -> Plan:
    """Read the JSON of a city file, which may say another name; CityError, beginning with `where`, if it makes none."""
    document = Fields(where, "", _parse_json(text, where))
    document.allow_only(*READ_KEYS, *IGNORED_KEYS)
    items = document.array("buildings")
    if not items:
        document.refuse("buildings", "at least one building", "an empty array")
    if len(items) > BUILDINGS_MAX:
        document.refuse("buildings", f"at most {BUILDINGS_MAX} buildings", f"{len(items)} of them")
    buildings: list[Building] = []
    kinds: list[str] = []
    sources: list[str] = []
    taken: set[int] = set()
    for index, item in enumerate(items):
        building, kind = _building(Fields(where, f"buildings.{index}.", item))
        kinds.append(kind)
        sources.append(_source_id(document.where, building.building_id, item))
        if building.building_id in taken:
            document.refuse(f"buildings.{index}.id", "an identifier of its own", building.building_id)
        taken.add(building.building_id)
        buildings.append(building)
    footprints = assemble(buildings)
    roads = None
    if "roads" in document.object():
        roads = read_roads(document, footprints, span_mm=COORDINATE_MAX_MM, id_max=ID_MAX)
    elif "passages" in document.object():
        document.refuse("passages", "roads that they join", "no roads")
    return freeze(
        Plan(
            name=document.text("name", default=name),
            footprints=footprints,
            streets=_streets(document, footprints, roads),
            roads=roads,
            kind=np.array([BUILDING_TYPES.index(kind) for kind in kinds], dtype=np.uint8),
            source_id=tuple(sources) if any(sources) else (),
            links=read_links(document, len(buildings)),
            source=_source(document),
            notes=_notes(footprints),
        )
    )


def _parse_json(text: bytes, where: str) -> Any:
    """Parse JSON, but not what Python would let pass: repeated keys, NaN and infinities."""

    def pairs(items: list[tuple[str, Any]]) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for key, item in items:
            if key in found:
                raise CityError(expected(where, key, "each key once", "two of them"))
            found[key] = item
        return found

    def constant(literal: str) -> Never:
        raise CityError(expected(where, "", "finite numbers", literal))

    try:
        return json.loads(text.decode("utf-8"), object_pairs_hook=pairs, parse_constant=constant)
    except json.JSONDecodeError as error:
        got = f"{error.msg} at line {error.lineno}, column {error.colno}"
        raise CityError(expected(where, "", "JSON", got)) from None
    except UnicodeDecodeError as error:
        raise CityError(expected(where, "", "JSON in UTF-8", f"another byte at offset {error.start}")) from None
    except (ValueError, RecursionError):  # an integer of thousands of digits, arrays in arrays in arrays
        raise CityError(expected(where, "", "JSON with numbers of sane size", "something larger")) from None


def _building(item: Fields) -> tuple[Building, str]:
    """Read one building and its type."""
    building_id = item.integer("id", low=0, high=ID_MAX)
    item = Fields(item.where, f"building {building_id}: ", item.value)
    item.allow_only(*BUILDING_KEYS)
    kind = item.text("type", default="building").lower().replace(" ", "").replace("_", "")
    if kind not in BUILDING_TYPES:
        item.refuse("type", f"one of {', '.join(BUILDING_TYPES)}", item.value["type"])
    refuge = kind == "refuge"
    corners = _corners(item)
    doubled_area = abs(doubled_area_mm2(corners))
    if doubled_area < 2_000_000:
        item.refuse("apexes", "an area of at least 1 m2", f"{doubled_area / 2_000_000:.6f} m2")
    middle = (0, 0) if {"x", "y"} <= item.object().keys() else centroid_mm(corners)
    span = (-COORDINATE_MAX_MM, COORDINATE_MAX_MM)
    building = Building(
        building_id=building_id,
        corners_mm=corners,
        centroid_mm=(
            item.integer("x", low=span[0], high=span[1], default=middle[0]),
            item.integer("y", low=span[0], high=span[1], default=middle[1]),
        ),
        floors=item.integer("floors", low=1, high=FLOORS_MAX, default=1),
        material=item.integer("code", low=0, high=2, default=0),
        ground_area_m2=item.integer(
            "ground_area", low=1, high=GROUND_AREA_MAX_M2, default=min(doubled_area // 2_000_000, GROUND_AREA_MAX_M2)
        ),
        inflammable=item.flag("inflammable", default=not refuge),
        refuge=refuge,
    )
    return building, kind


def _source_id(where: str, building_id: int, item: dict[str, Any]) -> str:
    """Read what a building is called in its source; "" where it is not said."""
    return Fields(where, f"building {building_id}: ", item).text("source") if "source" in item else ""


def _corners(item: Fields) -> list[Corner]:
    """Read an outline: [x0, y0, x1, y1, ...], just as it is listed."""
    n_numbers = len(item.array("apexes"))
    if n_numbers > 2 * CORNERS_MAX:
        item.refuse("apexes", f"at most {CORNERS_MAX} corners", f"{n_numbers // 2} of them")
    numbers = item.integers("apexes", low=-COORDINATE_MAX_MM, high=COORDINATE_MAX_MM)
    if len(numbers) % 2:
        item.refuse("apexes", "as many y as x", f"{len(numbers)} numbers")
    corners = list(zip(numbers[::2], numbers[1::2], strict=True))
    if len(set(corners)) < 3:
        item.refuse("apexes", "at least 3 distinct corners", f"{len(set(corners))} of them")
    return corners


def _source(document: Fields) -> dict[str, Any] | None:
    """Read what the file says of where it comes from: an object with anything in it."""
    if "source" not in document.object():
        return None
    source = Fields(document.where, "source", document.object()["source"]).object()
    if _is_deeper(source, SOURCE_DEPTH_MAX):
        document.refuse("source", f"at most {SOURCE_DEPTH_MAX} objects and arrays in each other", "more of them")
    n_bytes = len(json.dumps(source))
    if n_bytes > SOURCE_MAX_BYTES:
        document.refuse("source", f"at most {SOURCE_MAX_BYTES} bytes", f"{n_bytes} bytes")
    return source


def _is_deeper(value: Any, depth: int) -> bool:
    """Return whether a JSON value has more objects and arrays in each other than that."""
    parts = value.values() if isinstance(value, dict) else value if isinstance(value, list) else None
    return parts is not None and (depth == 0 or any(_is_deeper(part, depth - 1) for part in parts))


def _notes(footprints: Footprints) -> tuple[str, ...]:
    """Say which outlines cross or touch themselves: that is allowed, but may be a slip."""
    crossing = footprints.building_id[crossing_outlines(*without_repeats(footprints))].tolist()
    if not crossing:
        return ()
    shown = ", ".join(str(building_id) for building_id in crossing[:IDS_SHOWN_MAX])
    more = f" and {len(crossing) - IDS_SHOWN_MAX} more" if len(crossing) > IDS_SHOWN_MAX else ""
    those = f"building{'' if len(crossing) == 1 else 's'} {shown}{more}"
    return (f"outlines that cross or touch themselves: {those}; the even-odd rule says what is inside",)


def _streets(document: Fields, footprints: Footprints, roads: RoadMap | None) -> StreetMap:
    """Read the streets, make them of roads, or lay footpaths where the file has neither."""
    span = {"low": -COORDINATE_MAX_MM, "high": COORDINATE_MAX_MM}
    hydrants: list[Corner] = []
    places: list[int] = []
    for index, value in enumerate(document.array("hydrants", default=[])):
        item = Fields(document.where, f"hydrants.{index}.", value)
        item.allow_only("id", "x", "y")
        places.append(item.integer("id", low=0, high=ID_MAX, default=0))
        hydrants.append((item.integer("x", **span), item.integer("y", **span)))
    if roads is not None:
        if "streets" in document.object():
            document.refuse("streets", "no streets beside roads, of which they are made", "both")
        known = set(roads.road_id.tolist())
        unknown = [place for place in places if place not in known]
        if unknown:
            document.refuse("hydrants", "ids of roads", unknown[0])
        return streets_of_roads(roads, footprints, places)
    if "streets" not in document.object():
        check_nodes(len(footprints.building_id) + len(hydrants), where=document.where)
        return footpaths(footprints, hydrants)
    streets = Fields(document.where, "streets.", document.object()["streets"])
    streets.allow_only("nodes", "edges")
    nodes = streets.pairs("nodes", **span)
    check_nodes(len(nodes), where=document.where)
    edges = streets.pairs("edges", low=0, high=len(nodes) - 1)
    for index, (start, end) in enumerate(edges):
        if start == end:
            streets.refuse(f"edges.{index}", "two different nodes", [start, end])
    node = np.array(nodes, dtype=np.int64)
    return StreetMap(
        node_mm=node.astype(np.int32),
        street=np.array(edges, dtype=np.int32),
        hydrant_node=_nearest_nodes(node, np.array(hydrants, dtype=np.int64).reshape(-1, 2)),
    )


def _nearest_nodes(node: Int64Array, points: Int64Array) -> Int32Array:
    """Find the street node nearest to each point; ties go to the lowest."""
    import shapely

    places, first = np.unique(node, axis=0, return_index=True)
    at: Any = shapely.points(places)
    tree = shapely.STRtree(at)
    (point, _), distance = tree.query_nearest(shapely.points(points), return_distance=True)
    reach = np.zeros(len(points))
    reach[point] = distance
    # Distances are rounded there; among all that are as near within a millimetre, whole numbers decide.
    point, candidate = tree.query(shapely.points(points), predicate="dwithin", distance=reach + 1.0)
    away = places[candidate] - points[point]
    best = np.lexsort((first[candidate], (away * away).sum(axis=1), point))
    best = best[np.unique(point[best], return_index=True)[1]]
    return np.asarray(first[candidate[best]], dtype=np.int32)
