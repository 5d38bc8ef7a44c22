"""Streets ready for driving: lengths, shortest ways between all nodes, and where each building is reached."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, Final

import numpy as np

from fireworld.city.city import Int32Array, Int64Array, StreetMap, Streets
from fireworld.errors import CityError, expected

UNREACHED: Final = 1 << 60
NODES_MAX: Final = 20_000
"""The ways between all of them take 5 GB."""


def streets_of(street_map: StreetMap, centroid_mm: Int32Array) -> Streets:
    """Work out the shortest ways on a street map and the access points of buildings, by their (n, 2) centroids.

    It has at least one street and need not be connected.
    """
    node = street_map.node_mm.astype(np.int64)
    street = street_map.street.astype(np.int64)
    span = node[street[:, 1]] - node[street[:, 0]]
    exact = np.sqrt((span * span).sum(axis=1).astype(np.float64))
    length = np.maximum(1, np.floor(exact + 0.5).astype(np.int64))
    distance, next_node = shortest_ways(node, street, length)
    access_street, access_offset, access_mm = _access_points(node, street, length, centroid_mm.astype(np.int64))
    return Streets(
        node_mm=street_map.node_mm,
        street=street_map.street,
        street_length_mm=length,
        distance_mm=distance,
        next_node=next_node,
        hydrant_node=street_map.hydrant_node,
        access_street=access_street.astype(np.int32),
        access_offset_mm=access_offset,
        access_mm=access_mm.astype(np.int32),
    )


def shortest_ways(node_mm: Int64Array, street: Int64Array, length_mm: Int64Array) -> tuple[Int64Array, Int32Array]:
    """Find the shortest way between any two of m nodes, by k streets that can be driven both ways.

    Every node in turn learns from its neighbours, in sweeps to and fro along the two diagonals of the map, until a
    round brings nothing new. On street maps a few rounds do, and each is a handful of operations on whole rows. Returns
    distance_mm (m, m) int64, -1 where there is no way; and next_node (m, m) int32, [from, to] the next node on a
    shortest way (ties: lowest index), -1 where there is none and from a node to itself.
    """
    m = len(node_mm)
    check_nodes(m)
    neighbours = _neighbours(m, street, length_mm)
    distance = np.full((m, m), UNREACHED, dtype=np.int64)
    np.fill_diagonal(distance, 0)
    rising = np.argsort(node_mm[:, 0] + node_mm[:, 1], kind="stable")
    falling = np.argsort(node_mm[:, 0] - node_mm[:, 1], kind="stable")
    learnt = True
    while learnt:
        learnt = False
        for sweep in (rising, rising[::-1], falling, falling[::-1]):
            for here in sweep.tolist():
                others, ways = neighbours[here]
                if len(others):
                    best = (distance[others] + ways[:, None]).min(axis=0)
                    if (best < distance[here]).any():
                        np.minimum(distance[here], best, out=distance[here])
                        learnt = True
    next_node = np.full((m, m), -1, dtype=np.int32)
    for here, (others, ways) in enumerate(neighbours):
        if len(others):
            on_shortest = distance[others] + ways[:, None] == distance[here]
            next_node[here] = np.where(on_shortest.any(axis=0), others[np.argmax(on_shortest, axis=0)], -1)
    unreached = distance >= UNREACHED
    next_node[unreached] = -1
    distance[unreached] = -1
    return distance, next_node


def check_nodes(n_nodes: int, *, where: str = "city") -> None:
    """Raise CityError for a map of more nodes than the ways between all of them have room for."""
    if n_nodes > NODES_MAX:
        raise CityError(expected(where, "streets", f"at most {NODES_MAX} nodes", n_nodes))


def _neighbours(m: int, street: Int64Array, length_mm: Int64Array) -> list[tuple[Int64Array, Int64Array]]:
    """List each node's neighbours, rising, with the length of the street to each."""
    start, end = np.concatenate([street[:, 0], street[:, 1]]), np.concatenate([street[:, 1], street[:, 0]])
    way = np.concatenate([length_mm, length_mm])
    rising = np.lexsort((way, end, start))
    start, end, way = start[rising], end[rising], way[rising]
    bounds = np.searchsorted(start, np.arange(m + 1)).tolist()
    return [(end[low:high], way[low:high]) for low, high in pairwise(bounds)]


def _access_points(
    node: Int64Array, street: Int64Array, length: Int64Array, centroid: Int64Array
) -> tuple[Int64Array, Int64Array, Int64Array]:
    """Find the point of any street nearest to each centroid; ties go to the lowest street.

    Returns the street (n,), the way from its first node (n,) mm, and the point (n, 2) mm.
    """
    import shapely

    lines: Any = shapely.linestrings(node[street])
    points = shapely.points(centroid)
    tree = shapely.STRtree(lines)
    (building, _), distance = tree.query_nearest(points, return_distance=True)
    reach = np.zeros(len(centroid))
    reach[building] = distance
    # Points are whole millimetres, so the nearest one of them may be on a street up to 2 mm farther away.
    building, candidate = tree.query(points, predicate="dwithin", distance=reach + 2.0)

    start, span = node[street[candidate, 0]], node[street[candidate, 1]] - node[street[candidate, 0]]
    part = ((centroid[building] - start) * span).sum(axis=1) / np.maximum((span * span).sum(axis=1), 1)
    part = np.clip(part, 0.0, 1.0)
    point = start + np.floor(span * part[:, None] + 0.5).astype(np.int64)
    offset = np.floor(length[candidate] * part + 0.5).astype(np.int64)
    away = point - centroid[building]
    best = np.lexsort((candidate, (away * away).sum(axis=1), building))
    best = best[np.unique(building[best], return_index=True)[1]]
    return candidate[best], offset[best], point[best]
