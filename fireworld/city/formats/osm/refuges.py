"""Which buildings of an extract are refuges: fire stations, else one near the middle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from fireworld.city.city import Int64Array
from fireworld.city.formats.osm.area import Area
from fireworld.city.formats.osm.overlaps import polygons_of
from fireworld.city.formats.osm.reader import Extract, OsmNode, OsmRelation, OsmWay
from fireworld.city.formats.osm.rings import Shape
from fireworld.city.outlines import doubled_area_mm2
from fireworld.errors import CityError, expected

STATION_REACH_MM: Final = 50_000
"""A fire station that is drawn in no building is in one at most so far away."""
REFUGES_AT: Final = (15, 85)
"""Per cent of the city's width and height."""
REFUGE_MIN_M2: Final = 100


def stations_of(extract: Extract, shapes: Sequence[Shape], area: Area) -> tuple[list[int], int]:
    """Return the buildings that are fire stations, by index, rising, and how many stations in the area have none.

    A building may be one itself; else it is the building that a station's node, or the middle of its ground, is in, or
    the nearest one.
    """
    found = {k for k, shape in enumerate(shapes) if shape.tags.get("amenity") == "fire_station"}
    places = [middle for one in extract.stations if (middle := _middle(one, extract.members, area)) is not None]
    n_lost = 0
    if places:
        points = np.array(places, dtype=np.int64)
        nearest, away = nearest_buildings(shapes, points)
        for building, distance in zip(nearest.tolist(), away.tolist(), strict=True):
            if distance <= STATION_REACH_MM:
                found.add(building)
            else:
                n_lost += 1
    return sorted(found), n_lost


def nearest_buildings(shapes: Sequence[Shape], points_mm: Int64Array) -> tuple[Any, Any]:
    """Return the building nearest to each point, (k, 2), and how far it is, mm: 0 inside. Ties: the first building."""
    import shapely

    polygons, _ = polygons_of(shapes)
    tree = shapely.STRtree(polygons)
    points = shapely.points(points_mm.astype(np.float64))
    (point, building), distance = tree.query_nearest(points, return_distance=True)
    order = np.lexsort((building, point))
    first = order[np.unique(point[order], return_index=True)[1]]
    return building[first], distance[first]


def chosen_refuges(shapes: Sequence[Shape], far: Sequence[int]) -> list[int]:
    """Choose refuges for a city without fire stations: nearest to two points of it, as in generated cities.

    Not the buildings `far` from streets, nor small ones, if there are others; and one building always is left to burn.
    """
    small = {k for k, shape in enumerate(shapes) if abs(doubled_area_mm2(shape.outer)) < 2_000_000 * REFUGE_MIN_M2}
    fit = [k for k in range(len(shapes)) if k not in small and k not in set(far)] or list(range(len(shapes)))
    corners = np.array([corner for shape in shapes for corner in shape.outer], dtype=np.int64)
    low, high = corners.min(axis=0), corners.max(axis=0)
    points = np.array(
        [[low[axis] + (high[axis] - low[axis]) * percent // 100 for axis in (0, 1)] for percent in REFUGES_AT]
    )
    nearest, _ = nearest_buildings([shapes[k] for k in fit], points)
    found = sorted({fit[k] for k in nearest.tolist()})
    return found if len(found) < len(shapes) else found[:1]


def named_refuges(wanted: Sequence[int | str], shapes: Sequence[Shape]) -> list[int]:
    """Return the buildings that are named by number or by the id of OpenStreetMap, as w123 or r45, by index."""
    return sorted({building_named(one, shapes, name="--refuge") for one in wanted})


def building_named(wanted: int | str, shapes: Sequence[Shape], *, name: str) -> int:
    """Return the building of a number, from 1, or of an id of OpenStreetMap, by index; CityError if there is none."""
    text = str(wanted).strip()
    if text.isascii() and text.isdecimal() and len(text) < 10 and 1 <= int(text) <= len(shapes):
        return int(text) - 1
    for k, shape in enumerate(shapes):
        if shape.source == text:
            return k
    wanted_text = (
        f"the number of a building, 1 to {len(shapes)}, or its id in OpenStreetMap, such as {shapes[0].source}"
    )
    raise CityError(expected(name, "", wanted_text, text))


def _middle(one: OsmWay | OsmRelation | OsmNode, members: Mapping[int, OsmWay], area: Area) -> tuple[int, int] | None:
    """Return where a fire station is; None if it is outside the area or lost all its nodes."""
    if isinstance(one, OsmNode):
        places = [one.place]
    elif isinstance(one, OsmWay):
        places = [place for place in one.places if place is not None]
    else:
        ways = [members[ref] for kind, ref, _ in one.members if kind == "w" and ref in members]
        places = [place for way in ways for place in way.places if place is not None]
    if not places:
        return None
    points = area.projection.to_mm(sorted(set(places)))
    middle = points.sum(axis=0) // len(points)
    return (int(middle[0]), int(middle[1])) if bool(area.holds(middle[None, :])[0]) else None
