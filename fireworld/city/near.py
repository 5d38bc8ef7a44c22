"""Which buildings belong to one fire site when both burn: linked by radiation, or outlines close together."""

from __future__ import annotations

from typing import Final

import numpy as np

from fireworld.city.city import Array, Footprints, Int64Array, Links
from fireworld.city.outlines import Walls, bounding_boxes, numbered, walls_of

SITE_GAP_MM: Final = 30_000
"""Outlines closer than this, strictly, make one fire site."""
PAIRS_AT_ONCE: Final = 500_000


def near_relation(footprints: Footprints, links: Links) -> Links:
    """Relate the buildings that are linked in either direction, or whose outlines are closer than 30 m.

    The relation is symmetric, as CSR, neighbours rising, all shares 1; no building is near itself.
    """
    n = len(footprints.building_id)
    emitter = np.repeat(np.arange(n, dtype=np.int64), np.diff(links.ptr))
    linked = np.unique(np.minimum(emitter, links.building) * n + np.maximum(emitter, links.building))
    first, second = _boxes_closer(footprints, SITE_GAP_MM)
    unlinked = ~np.isin(first * n + second, linked, assume_unique=True)
    first, second = first[unlinked], second[unlinked]
    close = _outlines_closer(walls_of(footprints), footprints, first, second, SITE_GAP_MM)
    one = np.concatenate([linked // n, first[close]])
    other = np.concatenate([linked % n, second[close]])
    key = np.sort(np.concatenate([one * n + other, other * n + one]))
    return Links(
        ptr=np.concatenate([[0], np.cumsum(np.bincount(key // n, minlength=n))]).astype(np.int32),
        building=(key % n).astype(np.int32),
        share=np.ones(len(key), dtype=np.float32),
    )


def _boxes_closer(footprints: Footprints, gap_mm: int) -> tuple[Int64Array, Int64Array]:
    """List the pairs (first < second) whose bounding boxes are closer than a gap.

    Sweeps along the longer side of the city: a building is compared with those that begin before it ends.
    """
    low, high = bounding_boxes(footprints)
    axis = int(np.argmax(high.max(axis=0) - low.min(axis=0)))
    sweep = np.argsort(low[:, axis], kind="stable")
    begins, ends = low[sweep, axis], high[sweep, axis]
    here, there = numbered(np.arange(1, len(sweep) + 1), np.searchsorted(begins, ends + gap_mm, side="left") - 1)
    one, other = sweep[here], sweep[there]
    apart = np.maximum(np.maximum(low[one] - high[other], low[other] - high[one]), 0)
    close = (apart < gap_mm).all(axis=1)  # first each axis alone, so that the squares below stay small
    one, other, apart = one[close], other[close], apart[close]
    close = (apart * apart).sum(axis=1) < gap_mm * gap_mm
    return np.minimum(one, other)[close], np.maximum(one, other)[close]


def _outlines_closer(walls: Walls, footprints: Footprints, first: Int64Array, second: Int64Array, gap_mm: int) -> Array:
    """Return which pairs of buildings have walls closer than a gap, (p,) bool."""
    n_walls = np.bincount(walls.building, minlength=len(footprints.building_id))
    starts = np.concatenate([[0], np.cumsum(n_walls)])
    n_pairs = n_walls[first] * n_walls[second]
    close = np.zeros(len(first), dtype=np.bool_)
    total = np.cumsum(n_pairs)
    begin = 0
    while begin < len(first):  # a few hundred thousand pairs of walls at a time
        done = int(total[begin] - n_pairs[begin])
        end = max(begin + 1, int(np.searchsorted(total, done + PAIRS_AT_ONCE, side="right")))
        part = slice(begin, end)
        pair, within = numbered(np.zeros(end - begin, dtype=np.int64), n_pairs[part] - 1)
        pair += begin
        one = starts[first[pair]] + within // n_walls[second[pair]]
        other = starts[second[pair]] + within % n_walls[second[pair]]
        close[pair[_walls_closer(walls, one, other, gap_mm)]] = True
        begin = end
    return close


def _walls_closer(walls: Walls, one: Int64Array, other: Int64Array, gap_mm: int) -> Array:
    """Return which pairs of walls are closer than a gap: an end of one near the other, or the two cross."""
    a, b = walls.start_mm[one], walls.end_mm[one]
    c, d = walls.start_mm[other], walls.end_mm[other]
    touching = (
        _point_closer(a, c, d, gap_mm)
        | _point_closer(b, c, d, gap_mm)
        | _point_closer(c, a, b, gap_mm)
        | _point_closer(d, a, b, gap_mm)
    )
    splits_other = np.sign(_cross(b - a, c - a)) * np.sign(_cross(b - a, d - a)) < 0
    splits_one = np.sign(_cross(d - c, a - c)) * np.sign(_cross(d - c, b - c)) < 0
    closer: Array = touching | (splits_other & splits_one)
    return closer


def _point_closer(point: Int64Array, start: Int64Array, end: Int64Array, gap_mm: int) -> Array:
    """Return which points are closer to their segments than a gap, without a square root or a division."""
    along, to_point = end - start, point - start
    place = (along * to_point).sum(axis=1)
    length_square = (along * along).sum(axis=1)
    gap_square = gap_mm * gap_mm
    near_start = (to_point * to_point).sum(axis=1) < gap_square
    near_end = ((point - end) ** 2).sum(axis=1) < gap_square
    # Whole numbers that may not fit 64 bits; as floats both sides of an equality still round alike.
    across = _cross(along, to_point).astype(np.float64)
    near_inside = across * across < float(gap_square) * length_square
    closer: Array = np.where(place <= 0, near_start, np.where(place >= length_square, near_end, near_inside))
    return closer


def _cross(first: Int64Array, second: Int64Array) -> Int64Array:
    """Return the cross products of two lists of vectors."""
    return first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
