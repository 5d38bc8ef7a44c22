"""Courtyards as one outline: a slit of no width joins a hole to the outside at the narrowest place."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np

from fireworld.city.city import Float64Array, Int64Array
from fireworld.city.outlines import Corner, doubled_area_mm2

ROWS_AT_ONCE: Final = 256


class _Near(NamedTuple):
    """Where two rings are nearest: on each, a wall by its first corner, and a point of it in whole mm."""

    square: float
    wall: int
    point: Corner
    other_wall: int
    other_point: Corner


def with_courtyards(outer: Sequence[Corner], holes: Sequence[Sequence[Corner]]) -> tuple[list[Corner], float]:
    """Cut holes into an outline, one after another, the nearest first: the outline, counterclockwise, and mm of slits.

    A slit is the shortest way from the outline so far to a hole, so it crosses nothing. Its two walls lie on each
    other, there and back. Rings have no corner twice in a row, nor the first one again at the end.
    """
    outline = turned(outer, counterclockwise=True)
    left = [turned(hole, counterclockwise=False) for hole in holes]
    slits = 0.0
    while left:
        found = [_nearest(outline, hole) for hole in left]
        chosen = min(range(len(left)), key=lambda k: found[k].square)
        near, hole = found[chosen], left.pop(chosen)
        start, end = near.point, near.other_point
        ring = _from_point(hole, near.other_wall, end)
        before = outline[: near.wall + 1]
        after = outline[near.wall + 1 :]
        cut = [start, *ring, end, start]
        if before[-1] == start:
            cut = cut[1:]
        if after and after[0] == start:  # the slit begins at the next corner, which comes once more
            after = after[1:]
        outline = before + cut + after
        outline = [corner for k, corner in enumerate(outline) if corner != outline[k - 1]]
        slits += float(np.sqrt(near.square))
    return outline, slits


def turned(ring: Sequence[Corner], *, counterclockwise: bool) -> list[Corner]:
    """Return a ring that runs one way round, from the same corner."""
    if (doubled_area_mm2(ring) > 0) == counterclockwise:
        return list(ring)
    return [ring[0], *reversed(ring[1:])]


def _from_point(ring: list[Corner], wall: int, point: Corner) -> list[Corner]:
    """Return a ring that begins at a point of one of its walls."""
    around = ring[wall + 1 :] + ring[: wall + 1]
    if around[-1] == point:
        return [around[-1], *around[:-1]]
    return around if around[0] == point else [point, *around]


def _nearest(one: list[Corner], other: list[Corner]) -> _Near:
    """Find where two rings are nearest; ties go to the first wall and corner."""
    a, b = np.array(one, dtype=np.int64), np.array(other, dtype=np.int64)
    square, corner, wall, point = _corner_to_wall(a, b)
    back_square, back_corner, back_wall, back_point = _corner_to_wall(b, a)
    if square <= back_square:
        return _Near(square, corner, one[corner], wall, point)
    return _Near(back_square, back_wall, back_point, back_corner, other[back_corner])


def _corner_to_wall(corners: Int64Array, ring: Int64Array) -> tuple[float, int, int, Corner]:
    """Find the corner, (c, 2), that is nearest to a wall of a ring, (w, 2).

    Returns the squared distance, the corner, the wall and the point of the wall.
    """
    span = np.roll(ring, -1, axis=0) - ring
    length2 = np.maximum((span * span).sum(axis=1), 1)
    best = math.inf, 0, 0, 0.0
    for begin in range(0, len(corners), ROWS_AT_ONCE):
        away = corners[begin : begin + ROWS_AT_ONCE, None, :] - ring[None, :, :]
        part: Float64Array = np.clip((away * span).sum(axis=2) / length2, 0.0, 1.0)
        off = away - part[:, :, None] * span
        square = off[:, :, 0] * off[:, :, 0] + off[:, :, 1] * off[:, :, 1]
        row, wall = divmod(int(np.argmin(square)), len(ring))
        if square[row, wall] < best[0]:
            best = float(square[row, wall]), begin + row, wall, float(part[row, wall])
    square_mm2, corner, wall, along = best
    x, y = np.floor(ring[wall] + along * span[wall] + 0.5).astype(np.int64).tolist()
    return square_mm2, corner, wall, (x, y)
