"""Which buildings are linked or have outlines closer than a gap: exact, cell by cell, in the memory of the result."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fireworld.kernels.arrays import Array
from fireworld.kernels.jit import inner, kernel


class BoxGrid(NamedTuple):
    """Square cells over all buildings, and the buildings whose bounding boxes reach into each cell, as CSR.

    cell = x * ny + y. `fireworld.city.near` lays the grid.
    """

    x_mm: int
    y_mm: int
    side_mm: int
    nx: int
    ny: int
    ptr: Array  # (nx * ny + 1,) int64
    building: Array  # int32


@inner
def point_closer(px: int, py: int, x: int, y: int, dx: int, dy: int, gap_mm: int) -> bool:
    """Return whether a point is closer than a gap to the wall from (x, y) to (x + dx, y + dy).

    Without a square root or a division: in whole numbers but for points beside the middle of a wall, where the numbers
    may not fit 64 bits; as floats both sides of an equality still round alike.
    """
    to_x, to_y = px - x, py - y
    place, length_square = dx * to_x + dy * to_y, dx * dx + dy * dy
    if place <= 0:
        return to_x * to_x + to_y * to_y < gap_mm * gap_mm
    if place >= length_square:
        return (to_x - dx) * (to_x - dx) + (to_y - dy) * (to_y - dy) < gap_mm * gap_mm
    across = float(dx * to_y - dy * to_x)
    return across * across < float(gap_mm * gap_mm) * float(length_square)


@inner
def walls_closer(ax: int, ay: int, bx: int, by: int, cx: int, cy: int, dx: int, dy: int, gap_mm: int) -> bool:
    """Return whether the walls from a to b and from c to d are closer than a gap: at an end of one, or they cross."""
    if (
        point_closer(ax, ay, cx, cy, dx - cx, dy - cy, gap_mm)
        or point_closer(bx, by, cx, cy, dx - cx, dy - cy, gap_mm)
        or point_closer(cx, cy, ax, ay, bx - ax, by - ay, gap_mm)
        or point_closer(dx, dy, ax, ay, bx - ax, by - ay, gap_mm)
    ):
        return True
    c_side = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    d_side = (bx - ax) * (dy - ay) - (by - ay) * (dx - ax)
    a_side = (dx - cx) * (ay - cy) - (dy - cy) * (ax - cx)
    b_side = (dx - cx) * (by - cy) - (dy - cy) * (bx - cx)
    return ((c_side < 0 < d_side) or (d_side < 0 < c_side)) and ((a_side < 0 < b_side) or (b_side < 0 < a_side))


@inner
def boxes_closer(low_x: int, low_y: int, high_x: int, high_y: int, low: Array, high: Array, gap_mm: int) -> bool:
    """Return whether a box and another one, low and high (2,), are closer than a gap."""
    apart_x = max(low_x - high[0], low[0] - high_x, 0)
    apart_y = max(low_y - high[1], low[1] - high_y, 0)
    # First each axis alone, so that the squares stay small.
    return apart_x < gap_mm and apart_y < gap_mm and apart_x * apart_x + apart_y * apart_y < gap_mm * gap_mm


@inner
def outlines_closer(one: Array, other: Array, low: Array, high: Array, gap_mm: int, n_compared: Array) -> bool:
    """Return whether two outlines, corners (c, 2), are closer than a gap; `low` and `high` (2,) bound the other one.

    Counts the walls that it compares, in `n_compared` (1,).
    """
    for i in range(len(one)):
        before = i - 1 if i > 0 else len(one) - 1
        ax, ay, bx, by = np.int64(one[before, 0]), np.int64(one[before, 1]), np.int64(one[i, 0]), np.int64(one[i, 1])
        if not boxes_closer(min(ax, bx), min(ay, by), max(ax, bx), max(ay, by), low, high, gap_mm):
            continue
        n_compared[0] += len(other)
        cx, cy = np.int64(other[-1, 0]), np.int64(other[-1, 1])
        for j in range(len(other)):
            dx, dy = np.int64(other[j, 0]), np.int64(other[j, 1])
            if walls_closer(ax, ay, bx, by, cx, cy, dx, dy, gap_mm):
                return True
            cx, cy = dx, dy
    return False


@inner
def append_closer(
    a: int, outline_ptr: Array, outline_mm: Array, low: Array, high: Array, grid: BoxGrid, gap_mm: int, met: Array,
    upper: Array, end: int, n_compared: Array,
) -> int:  # fmt: skip
    """Append the buildings with higher numbers whose outlines are closer to building a than a gap; return the new end.

    Those that it has met are left out, and met[b] = a for all that it was compared with. `n_compared` (1,) counts
    walls.
    """
    x0, x1 = (low[a, 0] - gap_mm - grid.x_mm) // grid.side_mm, (high[a, 0] + gap_mm - grid.x_mm) // grid.side_mm
    y0, y1 = (low[a, 1] - gap_mm - grid.y_mm) // grid.side_mm, (high[a, 1] + gap_mm - grid.y_mm) // grid.side_mm
    corners = outline_mm[outline_ptr[a] : outline_ptr[a + 1]]
    for x in range(max(x0, 0), min(x1, grid.nx - 1) + 1):
        for y in range(max(y0, 0), min(y1, grid.ny - 1) + 1):
            for k in range(grid.ptr[x * grid.ny + y], grid.ptr[x * grid.ny + y + 1]):
                b = grid.building[k]
                if b <= a or met[b] == a:
                    continue
                met[b] = a
                if boxes_closer(low[a, 0], low[a, 1], high[a, 0], high[a, 1], low[b], high[b], gap_mm):
                    others = outline_mm[outline_ptr[b] : outline_ptr[b + 1]]
                    if outlines_closer(corners, others, low[b], high[b], gap_mm, n_compared):
                        upper[end] = b
                        end += 1
    return end


@kernel
def find_upper(
    begin: int,
    outline_ptr: Array,
    outline_mm: Array,
    low: Array,
    high: Array,
    grid: BoxGrid,
    linked_ptr: Array,
    linked: Array,
    gap_mm: int,
    met: Array,
    upper_ptr: Array,
    upper: Array,
    compared_max: int,
    n_compared: Array,
) -> int:
    """List, building by building, those with higher numbers that it is linked with or closer to than a gap.

    Args:
        begin: the first building; lists of those before it are kept.
        outline_ptr: (n+1,) start of each building's corners.
        outline_mm: (corners, 2).
        low: (n, 2) lower left of each bounding box, int64.
        high: (n, 2) upper right, int64.
        grid: the bounding boxes by cells.
        linked_ptr: (n+1,) start of the buildings that each one is linked with, in either direction.
        linked: (links,) those buildings; some may be named twice.
        gap_mm: strictly.
        met: (n,) int32, scratch: the last building that each one was compared with, -1 at first.
        upper_ptr: (n+1,) int64, out: start of each list.
        upper: (any,) int32, out: the lists, each in any order.
        compared_max: walls that may be compared.
        n_compared: (1,) int64, in and out: those that were compared, pair by pair.

    Returns:
        The building before which there was too little room in `upper`, or more had been compared than may be; n where
        all is done.
    """
    n = len(low)
    for a in range(begin, n):
        end = upper_ptr[a]
        if end + (n - a) > len(upper) or n_compared[0] > compared_max:
            return a
        for k in range(linked_ptr[a], linked_ptr[a + 1]):
            b = linked[k]
            if b > a and met[b] != a:
                met[b] = a
                upper[end] = b
                end += 1
        upper_ptr[a + 1] = append_closer(
            a, outline_ptr, outline_mm, low, high, grid, gap_mm, met, upper, end, n_compared
        )
    return n


@kernel
def fill_rows(upper_ptr: Array, upper: Array, ptr: Array, place: Array, related: Array) -> None:
    """Turn the lists of higher neighbours into rows of all neighbours, rising.

    Of every row first the lower ones, which come rising as the lists are gone through; then, going through these, the
    upper ones, rising too. `ptr` (n+1,) is the start of the rows in `related`, `place` (n,) a copy of its beginning,
    which becomes the end of each row.
    """
    for a in range(len(place)):
        for k in range(upper_ptr[a], upper_ptr[a + 1]):
            b = upper[k]
            related[place[b]] = a
            place[b] += 1
    for b in range(len(place)):
        for k in range(ptr[b], place[b]):
            a = related[k]
            related[place[a]] = b
            place[a] += 1
