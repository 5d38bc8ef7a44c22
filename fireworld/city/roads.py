"""Streets to drive on, made of roads that are areas; and where buildings are entered from them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

import numpy as np

from fireworld.city.city import Array, Footprints, Int32Array, Int64Array, RoadMap, StreetMap
from fireworld.city.footpaths import footpaths
from fireworld.city.outlines import Corner, numbered

SHORTER: Final = 0.99
"""A straight way from edge to edge is a street of its own if it is shorter than this share of the way by the middle."""


def road_map(
    ids: Sequence[int],
    outlines: Sequence[Sequence[Corner]],
    centroids: Sequence[Corner],
    passages: Iterable[tuple[tuple[int, int], tuple[int, int, int, int]]],
) -> RoadMap:
    """Lay out roads, and passages (their two areas; x1, y1, x2, y2 of their edge), as arrays."""
    listed = list(passages)
    corners = [corner for outline in outlines for corner in outline]
    return RoadMap(
        road_id=np.array(ids, dtype=np.int64),
        outline_ptr=np.cumsum([0, *map(len, outlines)]).astype(np.int32),
        outline_mm=np.array(corners, dtype=np.int32).reshape(-1, 2),
        centroid_mm=np.array(centroids, dtype=np.int32).reshape(-1, 2),
        passage_area=np.array([areas for areas, _ in listed], dtype=np.int64).reshape(-1, 2),
        passage_mm=np.array([edge for _, edge in listed], dtype=np.int32).reshape(-1, 4),
    )


def streets_of_roads(roads: RoadMap, footprints: Footprints, hydrant_roads: Sequence[int]) -> StreetMap:
    """Make a street map of roads; footpaths between the buildings if no road leads anywhere.

    Nodes are the centroids of the roads, in their order, then the middles of the passages to or from a road. In each
    road its centroid is joined with all its passages, and two passages with each other where the straight line between
    them stays in the road and is a way shorter by more than 1 %. A building is entered at the passage to a road that is
    nearest to its centroid (ties: the first). `hydrant_roads`: ids of the roads with a hydrant.
    """
    place = {int(road): at for at, road in enumerate(roads.road_id)}
    on_road = np.array([int(first) in place for first, _ in roads.passage_area], dtype=np.bool_)
    area, ends = roads.passage_area[on_road], roads.passage_mm[on_road].astype(np.int64)
    if len(area) == 0:
        return footpaths(footprints, [tuple(roads.centroid_mm[place[road]].tolist()) for road in hydrant_roads])
    middle = (ends[:, :2] + ends[:, 2:]) // 2
    n_roads = len(roads.road_id)
    passage_node = np.arange(len(area)) + n_roads
    first = np.array([place[int(one)] for one in area[:, 0]], dtype=np.int64)
    second = np.array([place.get(int(one), -1) for one in area[:, 1]], dtype=np.int64)
    road = np.concatenate([first, second[second >= 0]])
    passage = np.concatenate([passage_node, passage_node[second >= 0]])
    rising = np.lexsort((passage, road))
    road, passage = road[rising], passage[rising]
    node = np.concatenate([roads.centroid_mm.astype(np.int64), middle])
    spokes = np.stack([road, passage], axis=1)
    direct = _direct_ways(roads, node, road, passage)
    streets = np.concatenate([spokes, direct])
    return StreetMap(
        node_mm=node.astype(np.int32),
        street=streets.astype(np.int32),
        hydrant_node=np.array([place[one] for one in hydrant_roads], dtype=np.int32),
        entrance_node=_entrances(footprints, area, middle, n_roads, second),
    )


def _direct_ways(roads: RoadMap, node: Int64Array, road: Int64Array, passage: Int64Array) -> Int64Array:
    """List the pairs of passages of one road, (k, 2) nodes, that are joined by a straight way of their own.

    `road` and `passage`: (j,) road and node of every passage of every road, rising.
    """
    begin = np.searchsorted(road, road, side="left")
    n_before = np.arange(len(road)) - begin
    later = np.repeat(np.arange(len(road)), n_before)
    within = np.arange(len(later)) - np.repeat(np.cumsum(n_before) - n_before, n_before)
    earlier = np.repeat(begin, n_before) + within
    owner, one, other = road[later], passage[earlier], passage[later]
    straight = _distance(node[one], node[other])
    by_middle = _distance(node[one], node[owner]) + _distance(node[owner], node[other])
    worth = straight < SHORTER * by_middle
    owner, one, other = owner[worth], one[worth], other[worth]
    if len(owner) == 0:
        return np.zeros((0, 2), dtype=np.int64)
    kept = _stays_inside(roads, owner, node[one], node[other])
    return np.unique(np.stack([one, other], axis=1)[kept], axis=0)


def _stays_inside(roads: RoadMap, owner: Int64Array, start: Int64Array, end: Int64Array) -> Array:
    """Return which straight lines stay in their road, (k,) bool: none of its edges crosses one, its middle is inside.

    `owner`: (k,) position of the road; `start` and `end`: (k, 2) mm. The edge that an end lies on does not cross the
    line, though rounding to whole millimetres may have put that end beside it.
    """
    ptr = roads.outline_ptr.astype(np.int64)
    line, corner = numbered(ptr[owner], ptr[owner + 1] - 1)
    corners = roads.outline_mm.astype(np.int64)
    successor = np.arange(1, len(corners) + 1)
    successor[ptr[1:] - 1] = ptr[:-1]
    a, b, p, q = corners[corner], corners[successor[corner]], start[line], end[line]
    crossed = (_cross(b - a, p - a) * 1.0) * _cross(b - a, q - a) < 0
    crossed &= (_cross(q - p, a - p) * 1.0) * _cross(q - p, b - p) < 0
    crossed &= ~(_is_middle(p, a, b) | _is_middle(q, a, b))
    middle, a, b = p + q, 2 * a, 2 * b  # doubled, so that the middle is a whole number
    above = (a[:, 1] <= middle[:, 1]) != (b[:, 1] <= middle[:, 1])
    at_left = np.where(b[:, 1] > a[:, 1], 1, -1) * np.sign(_cross(b - a, middle - a)) > 0
    n_crossed = np.bincount(line[crossed], minlength=len(owner))
    n_walls = np.bincount(line[above & at_left], minlength=len(owner))
    inside: Array = (n_crossed == 0) & (n_walls % 2 == 1)
    return inside


def _is_middle(point: Int64Array, start: Int64Array, end: Int64Array) -> Array:
    """Return which points are the middles of edges, as passages have them."""
    same: Array = (point == (start + end) // 2).all(axis=1)
    return same


def _cross(first: Int64Array, second: Int64Array) -> Int64Array:
    """Return the cross products of two lists of vectors."""
    return first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]


def _distance(one: Int64Array, other: Int64Array) -> Array:
    away = (other - one).astype(np.float64)
    return np.sqrt(away[:, 0] * away[:, 0] + away[:, 1] * away[:, 1])


def _entrances(
    footprints: Footprints, area: Int64Array, middle: Int64Array, n_roads: int, second: Int64Array
) -> Int32Array:
    """Return the (n,) node where each building is entered, -1 where no road leads to it."""
    place = {int(building): at for at, building in enumerate(footprints.building_id)}
    entrance = np.full(len(place), -1, dtype=np.int32)
    nearest = np.full(len(place), -1, dtype=np.int64)
    centroid = footprints.centroid_mm.astype(np.int64)
    for at in np.flatnonzero(second < 0).tolist():
        building = place[int(area[at, 1])]
        x, y = (middle[at] - centroid[building]).tolist()
        square = x * x + y * y
        if entrance[building] < 0 or square < nearest[building]:
            entrance[building], nearest[building] = n_roads + at, square
    return entrance


def sizes_of_parts(street_map: StreetMap) -> list[int]:
    """Return how many nodes each separate part of a street map has, the largest first; lone nodes count too."""
    root = list(range(len(street_map.node_mm)))

    def find(one: int) -> int:
        while root[one] != one:
            root[one] = root[root[one]]
            one = root[one]
        return one

    for first, second in street_map.street.tolist():
        low, high = sorted((find(first), find(second)))
        root[high] = low
    part = np.array([find(one) for one in range(len(root))])
    return sorted(np.unique(part, return_counts=True)[1].tolist(), reverse=True)
