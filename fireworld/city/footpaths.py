"""Footpaths for a map without streets, so that brigades can go everywhere."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from fireworld.city.city import Footprints, Int64Array, StreetMap
from fireworld.city.outlines import Corner

N_NEAREST: Final = 6
PAIRS_AT_ONCE: Final = 1 << 19
LARGE_PART: Final = 500
"""From so many points on, a tree finds the nearest of them sooner than comparing with each."""
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
    """List (node, one of its nearest), six for every node if there are as many others.

    Looked for in the square cells around each node, two nodes a cell on average: in a block of three by three, and in
    larger ones for the nodes to which a node outside of the block could be nearer than those found.
    """
    count = min(N_NEAREST, len(node) - 1)
    low = node.min(axis=0)
    width, height = (node.max(axis=0) - low + 1).tolist()
    side = max(1, math.isqrt(2 * width * height // len(node)), width // len(node), height // len(node))
    cell = (node - low) // side
    n_columns, n_rows = (cell.max(axis=0) + 1).tolist()
    key = cell[:, 0] * n_rows + cell[:, 1]
    inside = np.argsort(key, kind="stable")  # nodes, cell after cell
    key = key[inside]
    pairs, waiting, reach = [], np.arange(len(node)), 1
    while len(waiting):
        column, row = cell[waiting, 0, None] + np.arange(-reach, reach + 1), cell[waiting, 1, None]
        first = column * n_rows + np.maximum(row - reach, 0)
        last = column * n_rows + np.minimum(row + reach, n_rows - 1)
        begin, end = np.searchsorted(key, first), np.searchsorted(key, last, side="right")
        size = np.where((column >= 0) & (column < n_columns), end - begin, 0)
        again = []
        part = np.cumsum(size.sum(axis=1)) // PAIRS_AT_ONCE
        for chosen in np.split(np.arange(len(waiting)), np.flatnonzero(np.diff(part)) + 1):
            start = np.repeat(waiting[chosen], size[chosen].sum(axis=1))
            other = inside[_ranges(begin[chosen].ravel(), size[chosen].ravel())]
            start, other = start[start != other], other[start != other]
            away = node[start] - node[other]
            square = (away * away).sum(axis=1)
            nearest = np.lexsort((other, square, start))
            start, other, square = start[nearest], other[nearest], square[nearest]
            rank = np.arange(len(start)) - np.searchsorted(start, start)
            start, other, square, rank = (one[rank < count] for one in (start, other, square, rank))
            sure = start[(rank == count - 1) & (square <= min((reach * side) ** 2, FAR))]
            if reach >= max(n_columns, n_rows):
                sure = waiting[chosen]
            kept = np.isin(start, sure)
            pairs.append(np.stack([start[kept], other[kept]], axis=1))
            again.append(np.setdiff1d(waiting[chosen], sure))
        waiting, reach = np.concatenate(again), 2 * reach
    return np.concatenate(pairs)


def _ranges(begin: Int64Array, size: Int64Array) -> Int64Array:
    """List begin, begin + 1, ... for each range, so many of each."""
    ends = np.cumsum(size)
    offset: Int64Array = np.repeat(begin - (ends - size), size)
    return np.arange(len(offset)) + offset


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
        left = np.flatnonzero(outside)
        square, closest = _nearest_of(node, members, left)
        nearer = square < nearest_square[left]
        nearest_square[left[nearer]], nearest[left[nearer]] = square[nearer], closest[nearer]
        newcomer = int(np.argmin(np.where(outside, nearest_square, FAR)))
        joins.append((int(nearest[newcomer]), newcomer))


def _nearest_of(node: Int64Array, members: Int64Array, left: Int64Array) -> tuple[Int64Array, Int64Array]:
    """Find the nearest of some members, rising, to each node that is left: squared distance, and which (the lowest)."""
    best_square, best = np.full(len(left), FAR), np.zeros(len(left), dtype=np.int64)
    if len(members) < LARGE_PART:
        for one in members.tolist():
            away = node[left] - node[one]
            square = (away * away).sum(axis=1)
            nearer = square < best_square
            best_square[nearer], best[nearer] = square[nearer], one
        return best_square, best
    import shapely

    places: Any = shapely.points(node[members])
    tree, points = shapely.STRtree(places), shapely.points(node[left])
    (position, _), distance = tree.query_nearest(points, return_distance=True)
    reach = np.zeros(len(left))
    reach[position] = distance
    position, member = tree.query(points, predicate="dwithin", distance=reach + 1.0)  # floats may be off by a little
    away = node[left[position]] - node[members[member]]
    square = (away * away).sum(axis=1)
    nearest = np.lexsort((member, square, position))
    nearest = nearest[np.unique(position[nearest], return_index=True)[1]]
    best_square[position[nearest]], best[position[nearest]] = square[nearest], members[member[nearest]]
    return best_square, best
