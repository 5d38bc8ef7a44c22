"""Shortest ways between all pairs of nodes in plain numpy: MODEL 4."""

from __future__ import annotations

from itertools import pairwise
from typing import Final

import numpy as np

from fireworld.city.city import Int32Array, Int64Array, Streets

UNREACHED: Final = 1 << 60


def shortest_ways(streets: Streets) -> tuple[Int64Array, Int32Array]:
    """Find the shortest way between any two of m nodes, by k streets that can be driven both ways.

    Every node in turn learns from its neighbours, in sweeps to and fro along the two diagonals of the map, until a
    round brings nothing new. On street maps a few rounds do, and each is a handful of operations on whole rows. Returns
    distance_mm (m, m) int64, -1 where there is no way; and next_node (m, m) int32, [from, to] the next node on a
    shortest way (ties: lowest index), -1 where there is none and from a node to itself.
    """
    node_mm, length_mm = streets.node_mm.astype(np.int64), streets.street_length_mm
    m = len(node_mm)
    neighbours = _neighbours(m, streets.street.astype(np.int64), length_mm)
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


def _neighbours(m: int, street: Int64Array, length_mm: Int64Array) -> list[tuple[Int64Array, Int64Array]]:
    """List each node's neighbours, rising, with the length of the street to each."""
    start, end = np.concatenate([street[:, 0], street[:, 1]]), np.concatenate([street[:, 1], street[:, 0]])
    way = np.concatenate([length_mm, length_mm])
    rising = np.lexsort((way, end, start))
    start, end, way = start[rising], end[rising], way[rising]
    bounds = np.searchsorted(start, np.arange(m + 1)).tolist()
    return [(end[low:high], way[low:high]) for low, high in pairwise(bounds)]
