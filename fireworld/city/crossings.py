"""Which outlines cross or touch themselves: a sweep over the walls of one outline, and shapely for many short ones."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from fireworld.city.city import Array, Int32Array

Corner = tuple[int, int]
Wall = tuple[Corner, Corner]

SHORT_OUTLINE: Final = 200
"""Outlines of up to so many corners are left to shapely, which may compare every two walls of an outline."""


def crossing_outlines(ptr: Int32Array, corners_mm: Int32Array) -> Array:
    """Return which outlines cross or touch themselves, (n,) bool.

    `ptr` (n+1,) is the start of each one's corners, (c, 2), none of them listed twice in a row nor the first one again
    at the end; at least three each.
    """
    import shapely

    n_corners = np.diff(ptr)
    short = n_corners <= SHORT_OUTLINE
    crossing = np.zeros(len(n_corners), dtype=np.bool_)
    owner = np.repeat(np.arange(len(n_corners)), n_corners)
    of_short = short[owner]
    if short.any():
        indices = (np.cumsum(short) - 1)[owner[of_short]]
        rings: Any = shapely.linearrings(corners_mm[of_short].astype(np.float64), indices=indices)
        crossing[short] = ~shapely.is_valid(shapely.polygons(rings))
    for b in np.flatnonzero(~short).tolist():
        crossing[b] = crosses_itself([(x, y) for x, y in corners_mm[ptr[b] : ptr[b + 1]].tolist()])
    return crossing


def crosses_itself(corners: list[Corner]) -> bool:
    """Return whether an outline crosses or touches itself, exactly, in n log n steps for n corners.

    A line sweeps over the walls, corner by corner, by x and then y. It knows the walls that it meets in their order
    along it. Before two walls meet they are neighbours there, and of neighbours every two are compared once.
    """
    if len(set(corners)) < len(corners):
        return True
    walls = [_rising(start, end) for start, end in zip(corners, [*corners[1:], corners[0]], strict=True)]
    # At a corner walls that end there leave the line before others begin.
    events = [(end, 0, k) for k, (_, end) in enumerate(walls)] + [(start, 1, k) for k, (start, _) in enumerate(walls)]
    met: list[int] = []
    for corner, begins, k in sorted(events):
        place = _first_not_below(walls, met, corner, walls[k][1] if begins else None)
        if not begins:
            while met[place] != k:  # of two that end in this corner the other one may come first
                place += 1
            del met[place]
            if 0 < place < len(met) and _meet(walls[met[place - 1]], walls[met[place]]):
                return True
            continue
        if place < len(met) and _meet(walls[met[place]], walls[k]):
            return True
        if place > 0 and _meet(walls[met[place - 1]], walls[k]):
            return True
        met.insert(place, k)
    return False


def _rising(start: Corner, end: Corner) -> Wall:
    """Put the ends of a wall in order, by x and then y."""
    return (start, end) if start < end else (end, start)


def _first_not_below(walls: list[Wall], met: list[int], corner: Corner, onward: Corner | None) -> int:
    """Find the first wall on the line that is not below a corner: where a wall from there to `onward` belongs."""
    low, high = 0, len(met)
    while low < high:
        middle = (low + high) // 2
        start, end = walls[met[middle]]
        side = _turn(start, end, corner)
        if side == 0 and onward is not None:
            side = _turn(start, end, onward)  # from the same corner: the steeper one is above
        if side > 0:
            low = middle + 1
        else:
            high = middle
    return low


def _meet(one: Wall, other: Wall) -> bool:
    """Return whether two walls have a point in common, besides one corner that both have."""
    a, b = one
    c, d = other
    sides = _turn(a, b, c), _turn(a, b, d), _turn(c, d, a), _turn(c, d, b)
    if one[0] == other[0] or one[1] == other[1]:
        return sides[0] == sides[1] == 0  # one lies on the other
    if b == c or d == a:
        return False
    if sides[0] * sides[1] < 0 and sides[2] * sides[3] < 0:
        return True
    touching = ((sides[0], c, one), (sides[1], d, one), (sides[2], a, other), (sides[3], b, other))
    return any(side == 0 and wall[0] <= corner <= wall[1] for side, corner, wall in touching)


def _turn(a: Corner, b: Corner, c: Corner) -> int:
    """Return twice the signed area of a triangle: positive if the way a-b-c turns left."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
