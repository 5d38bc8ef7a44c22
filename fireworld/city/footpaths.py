"""Footpaths for a map without streets, so that brigades can go everywhere."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from fireworld.city.city import Footprints, Int64Array, StreetMap
from fireworld.city.outlines import Corner

N_NEAREST: Final = 6
ROWS_AT_ONCE: Final = 256
FAR: Final = np.iinfo(np.int64).max


def footpaths(footprints: Footprints, hydrants_mm: Sequence[Corner]) -> StreetMap:
    """Join the centroids of the buildings, and the hydrants, by straight footpaths.

    Every point is joined to its six nearest; where that leaves separate parts, the shortest path between two of them
    is added until all are one. Distances are compared as whole numbers; ties go to the lowest index. A building on
    its own gets a path to its first corner.
    """
    points = [tuple(point) for point in footprints.centroid_mm.tolist()] + list(hydrants_mm)
    n_hydrants = len(hydrants_mm)
    hydrant_node = np.arange(len(points) - n_hydrants, len(points), dtype=np.int32)
    if len(points) == 1:
        points.append(tuple(footprints.outline_mm[0].tolist()))
    node = np.array(points, dtype=np.int64)
    pairs = _nearest_pairs(node)
    paths = np.concatenate([pairs, _joins(node, _parts(len(node), pairs))])
    key = np.unique(np.minimum(paths[:, 0], paths[:, 1]) * len(node) + np.maximum(paths[:, 0], paths[:, 1]))
    return StreetMap(
        node_mm=node.astype(np.int32),
        street=np.stack([key // len(node), key % len(node)], axis=1).astype(np.int32),
        hydrant_node=hydrant_node,
    )


def _nearest_pairs(node: Int64Array) -> Int64Array:
    """List (node, one of its nearest), six for every node if there are as many others."""
    count = min(N_NEAREST, len(node) - 1)
    pairs = []
    for begin in range(0, len(node), ROWS_AT_ONCE):
        rows = np.arange(begin, min(begin + ROWS_AT_ONCE, len(node)))
        away = node[rows, None, :] - node[None, :, :]
        square = (away * away).sum(axis=2)
        square[np.arange(len(rows)), rows] = FAR  # from a node to itself
        farthest = np.partition(square, count - 1, axis=1)[:, count - 1]
        row, other = np.nonzero(square <= farthest[:, None])  # more than six where the sixth is a tie
        nearest = np.lexsort((other, square[row, other], row))
        row, other = row[nearest], other[nearest]
        rank = np.arange(len(row)) - np.searchsorted(row, row)
        pairs.append(np.stack([rows[row], other], axis=1)[rank < count])
    return np.concatenate(pairs)


def _parts(n_nodes: int, pairs: Int64Array) -> list[int]:
    """Give every node the lowest node that it is connected with."""
    root = list(range(n_nodes))

    def find(one: int) -> int:
        while root[one] != one:
            root[one] = root[root[one]]
            one = root[one]
        return one

    for first, second in pairs.tolist():
        low, high = sorted((find(first), find(second)))
        root[high] = low
    return [find(one) for one in range(n_nodes)]


def _joins(node: Int64Array, part: list[int]) -> Int64Array:
    """List the paths that connect separate parts: the nearest part joins the first one, again and again."""
    part_of = np.array(part)
    nearest_square = np.full(len(node), FAR)
    nearest = np.zeros(len(node), dtype=np.int64)
    outside = np.ones(len(node), dtype=np.bool_)
    joins: list[tuple[int, int]] = []
    newcomer = 0
    while True:
        members = np.flatnonzero(part_of == part_of[newcomer])
        outside[members] = False
        if not outside.any():
            return np.array(joins, dtype=np.int64).reshape(-1, 2)
        for one in members.tolist():
            away = node - node[one]
            square = (away * away).sum(axis=1)
            nearer = square < nearest_square
            nearest_square[nearer], nearest[nearer] = square[nearer], one
        newcomer = int(np.argmin(np.where(outside, nearest_square, FAR)))
        joins.append((int(nearest[newcomer]), newcomer))
