"""The roads of an official log as streets: lines along the roads instead of their surfaces."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fireworld.recording.official_log import names
from fireworld.recording.official_log.parts import Edge, Entity
from fireworld.records import Array

Point = tuple[float, float]


def streets_of(roads: Sequence[Entity]) -> tuple[Array, Array]:
    """Return nodes in metres, (n, 2) doubles, and streets as pairs of nodes, (k, 2) int32.

    A node stands in the middle of each side that two roads share, and in the middle of each road that does not simply
    lead from one such side to another; streets join the nodes of a road.
    """
    known = {road.id for road in roads}
    index: dict[Point, int] = {}
    streets: dict[tuple[int, int], None] = {}

    def node(point: Point) -> int:
        return index.setdefault(point, len(index))

    for road in roads:
        edges = road.properties.get(names.EDGES)
        sides = [edge for edge in edges if edge.neighbour in known] if isinstance(edges, Sequence) else []
        doors = [node(_middle(edge)) for edge in dict.fromkeys(sides)]
        if len(doors) == 2:
            ends = [(doors[0], doors[1])]
        else:
            center = _center(road)
            ends = [(node(center), door) for door in doors] if center is not None else []
        for a, b in ends:
            if a != b:
                streets[min(a, b), max(a, b)] = None
    nodes = np.array([*index], dtype=np.float64).reshape(-1, 2) / 1000.0
    return nodes, np.array([*streets], dtype=np.int32).reshape(-1, 2)


def _middle(edge: Edge) -> Point:
    """Return the middle of a side, the same from either side of it; in mm."""
    return (edge.x + edge.end_x) / 2, (edge.y + edge.end_y) / 2


def _center(road: Entity) -> Point | None:
    x, y = (road.properties.get(axis) for axis in (names.X, names.Y))
    return (float(x), float(y)) if isinstance(x, int) and isinstance(y, int) else None
