"""Roads for cities that have none: areas laid along streets, with an entrance to every building."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Final

import numpy as np

from fireworld.city.city import Int64Array, Plan, RoadMap, Streets
from fireworld.city.outlines import Corner
from fireworld.city.roads import road_map

WIDTH_MM: Final = 6000
ENTRANCE_MM: Final = 2000
"""Width of an entrance; less where a street has many."""
RADIUS_SHARE: Final = 0.3
"""Of the shortest street at a crossing: how far the crossing reaches into it at most."""
GAP_MM: Final = 10

Vector = tuple[float, float]
Edge = tuple[Corner, Corner]


def roads_of_streets(plan: Plan, streets: Streets, *, first_id: int) -> RoadMap:
    """Return roads along the streets of a city: a crossing for each node, slices of streets, entrances.

    Roads come in that order, with ids from `first_id` on: so the road of a node is `first_id` and its number.
    """
    return _Layout(plan, streets, first_id).roads()


class _Layout:
    """Lays roads along streets; lengths in mm."""

    def __init__(self, plan: Plan, streets: Streets, first_id: int) -> None:
        self._plan, self._first_id = plan, first_id
        self._node: list[Vector] = [(float(x), float(y)) for x, y in streets.node_mm.tolist()]
        self._street: list[list[int]] = streets.street.tolist()
        self._access = streets.access_street.tolist(), streets.access_offset_mm.tolist()
        self._entered: list[list[int]] = [[] for _ in self._street]
        for building, street in enumerate(self._access[0]):
            self._entered[street].append(building)
        self._outlines: list[list[Corner]] = []
        self._passages: list[tuple[tuple[int, int], Edge]] = []
        self._gates: dict[tuple[int, int], tuple[float, float]] = {}
        """By node and street: how far from the node the street begins, and half its width there."""

    def roads(self) -> RoadMap:
        """Lay all of them."""
        at_node: list[list[int]] = [[] for _ in self._node]
        for street, ends in enumerate(self._street):
            for node in ends:
                at_node[node].append(street)
        for node, streets in enumerate(at_node):
            self._outlines.append(self._crossing(node, streets))
        entrances = [pair for street in range(len(self._street)) for pair in self._slices(street)]
        for building, (side, road) in entrances:
            self._entrance(building, side, road)
        ids = [self._first_id + at for at in range(len(self._outlines))]
        centroids = [_middle(outline) for outline in self._outlines]
        place = {road: at for at, road in enumerate([*ids, *self._plan.footprints.building_id.tolist()])}
        found = [
            ((one, other) if place[one] < place[other] else (other, one), (min(edge), max(edge)))
            for (one, other), edge in self._passages
        ]
        found.sort(key=lambda passage: (place[passage[0][0]], place[passage[0][1]], passage[1]))
        return road_map(ids, self._outlines, centroids, ((areas, (*start, *end)) for areas, (start, end) in found))

    def _along(self, node: int, street: int) -> tuple[Vector, float]:
        """Return the direction of a street from one of its nodes, of length 1, and the street's length."""
        first, second = self._street[street]
        (x, y), (end_x, end_y) = self._node[node], self._node[second if node == first else first]
        length = math.sqrt((end_x - x) ** 2 + (end_y - y) ** 2)
        return ((end_x - x) / length, (end_y - y) / length) if length else (1.0, 0.0), length

    def _crossing(self, node: int, streets: Sequence[int]) -> list[Corner]:
        """Return the outline of a crossing: an edge across each street, and note where the streets begin."""
        x, y = self._node[node]
        ways = [(self._along(node, street), street) for street in streets]
        if not ways:
            return [_round(x - 1000, y - 1000), _round(x + 1000, y - 1000), _round(x, y + 1000)]
        radius = min([WIDTH_MM / 2, *(RADIUS_SHARE * length for (_, length), _ in ways)])
        ways.sort(key=lambda way: _turn(way[0][0]))
        corners: list[Corner] = []
        for at, ((along, _), street) in enumerate(ways):
            gaps = [_tangent_of_half(along, ways[(at + step) % len(ways)][0][0]) for step in (-1, 1)]
            half = WIDTH_MM / 2 if len(ways) == 1 else min(WIDTH_MM / 2, *(radius * gap for gap in gaps))
            self._gates[node, street] = radius, half
            corners += _across((x, y), along, radius, half)
        if len(ways) == 1:
            (along, _), street = ways[0]
            left, right = _across((x, y), along, -radius, self._gates[node, street][1])
            corners += [right, left]
        return corners

    def _slices(self, street: int) -> Iterator[tuple[int, tuple[Edge, int]]]:
        """Lay the roads of a street, one behind another, and yield each building with the side it is entered from."""
        first, second = self._street[street]
        along, length = self._along(first, street)
        (begin, half), (end_radius, end_half) = self._gates[first, street], self._gates[second, street]
        end, middle_half = length - end_radius, min(half, end_half)
        entered = self._entered[street]
        entered.sort(key=lambda building: (self._access[1][building], building))
        cuts = _cuts(begin, end, [float(self._access[1][building]) for building in entered])
        places = sorted({begin, end, *(place for cut in cuts for place in cut)})
        sections = {place: _across(self._node[first], along, place, middle_half) for place in places}
        sections[begin] = _across(self._node[first], along, begin, half)
        to_second = (-along[0], -along[1])
        left_at_second, right_at_second = _across(self._node[second], to_second, end_radius, end_half)
        sections[end] = (right_at_second, left_at_second)
        before, gate = self._first_id + first, sections[begin]
        of_cut: dict[float, tuple[int, tuple[Corner, Corner], tuple[Corner, Corner]]] = {}
        for start, stop in pairwise(places):
            (right, left), (next_right, next_left) = sections[start], sections[stop]
            road = self._first_id + len(self._outlines)
            self._outlines.append([right, next_right, next_left, left])
            self._passages.append(((before, road), gate))
            of_cut[start] = (road, (right, next_right), (left, next_left))
            before, gate = road, sections[stop]
        self._passages.append(((before, self._first_id + second), gate))
        for building, (start, _) in zip(entered, cuts, strict=True):
            road, right_side, left_side = of_cut[start]
            x, y = self._plan.footprints.centroid_mm[building].tolist()
            origin = self._node[first]
            at_left = along[0] * (y - origin[1]) - along[1] * (x - origin[0]) > 0
            yield building, (left_side if at_left else right_side, road)

    def _entrance(self, building: int, side: Edge, road: int) -> None:
        """Lay the road from the side of a street to the nearest wall of a building."""
        ptr = self._plan.footprints.outline_ptr
        outline = [
            tuple(corner) for corner in self._plan.footprints.outline_mm[ptr[building] : ptr[building + 1]].tolist()
        ]
        walls = [(one, other) for one, other in pairwise([*outline, outline[0]]) if one != other]
        (x, y), (end_x, end_y) = side
        wall = min(
            walls, key=lambda one: (one[0][0] + one[1][0] - x - end_x) ** 2 + (one[0][1] + one[1][1] - y - end_y) ** 2
        )
        near, far = (
            wall
            if _square(side[1], wall[0]) + _square(side[0], wall[1])
            <= (_square(side[1], wall[1]) + _square(side[0], wall[0]))
            else wall[::-1]
        )
        entrance = self._first_id + len(self._outlines)
        self._outlines.append([side[0], side[1], near, far])
        self._passages.append(((road, entrance), side))
        self._passages.append(((entrance, int(self._plan.footprints.building_id[building])), wall))


def _cuts(begin: float, end: float, at: Sequence[float]) -> list[tuple[float, float]]:
    """Return where the entrances along a street begin and end: as near as may be to their places, one after another."""
    if not at:
        return []
    width = min(ENTRANCE_MM, 0.8 * (end - begin) / len(at))
    starts: list[float] = []
    for place in at:
        least = starts[-1] + width if starts else begin + GAP_MM * (end - begin > 4 * GAP_MM)
        starts.append(max(least, place - width / 2))
    latest = end - width - GAP_MM * (end - begin > 4 * GAP_MM)
    for index in range(len(starts) - 1, -1, -1):
        starts[index] = min(starts[index], latest)
        latest = starts[index] - width
    return [
        (start, starts[k + 1] if k + 1 < len(starts) and starts[k + 1] - start - width < GAP_MM else start + width)
        for k, start in enumerate(starts)
    ]


def _across(origin: Vector, along: Vector, distance: float, half: float) -> tuple[Corner, Corner]:
    """Return the right and the left end of a line across a street, at a distance from where it begins."""
    x, y = origin[0] + along[0] * distance, origin[1] + along[1] * distance
    return _round(x + along[1] * half, y - along[0] * half), _round(x - along[1] * half, y + along[0] * half)


def _round(x: float, y: float) -> Corner:
    return math.floor(x + 0.5), math.floor(y + 0.5)


def _square(one: Corner, other: Corner) -> int:
    return (one[0] - other[0]) ** 2 + (one[1] - other[1]) ** 2


def _turn(along: Vector) -> tuple[int, float]:
    """Return what sorts directions counterclockwise, from east on: the half of the circle, then minus the cosine."""
    x, y = along
    upper = y > 0 or (y == 0 and x > 0)
    return (0, -x) if upper else (1, x)


def _tangent_of_half(one: Vector, other: Vector) -> float:
    """Return the tangent of half the angle between two directions; large for opposite ones."""
    cross, dot = abs(one[0] * other[1] - one[1] * other[0]), one[0] * other[0] + one[1] * other[1]
    return cross / (1.0 + dot) if 1.0 + dot > 1e-9 else math.inf


def _middle(outline: Sequence[Corner]) -> Corner:
    """Return the centroid that the official reader gives an outline, of corners in whole millimetres."""
    from fireworld.city.formats.official.measuring import exact_measures

    return exact_measures([(float(x), float(y)) for x, y in outline])[0]


def as_positions(nodes: Int64Array, roads: RoadMap) -> list[int]:
    """Return the ids of the roads of nodes, where roads were laid along streets."""
    return [int(roads.road_id[node]) for node in np.asarray(nodes).tolist()]
