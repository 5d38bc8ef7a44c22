"""Radiation rays: which wall a ray meets first, and how many of a building's rays hit which other building.

Ray ends are whole millimetres, so whether a ray meets a wall is decided in whole numbers, exactly. Only the walk from
cell to cell is in floating point, which is why every wall is registered one millimetre wider than it is.
"""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fireworld.draws import RAY
from fireworld.kernels.draws import hash_key, mix, uniform_of
from fireworld.kernels.jit import inner, making_arrays

Array = NDArray[Any]

MISS: Final = -1


class WallTable(NamedTuple):
    """The walls that rays leave from and meet, (w,) each, int64, building by building."""

    building: Array  # index of the owner
    rank: Array  # of two walls at the same distance the one with the lower rank is met
    x: Array  # first corner, mm
    y: Array
    dx: Array  # second corner minus first, mm
    dy: Array
    n_rays: Array  # rays that the wall sends out


class WallGrid(NamedTuple):
    """Square cells over all walls, and the walls in each cell as CSR; cell = x * ny + y.

    Each wall is in every cell that it comes within a millimetre of. `fireworld.city.links` lays the grid.
    """

    x_mm: int
    y_mm: int
    side_mm: int
    nx: int
    ny: int
    ptr: Array  # (nx * ny + 1,) int64
    wall: Array  # int64


@inner
def meet(walls: WallTable, w: int, px: int, py: int, rx: int, ry: int) -> float:
    """Return where wall w crosses the way from (px, py) to (px + rx, py + ry): 0 at its start, 1 at its end.

    Touching counts: a start on a wall, an end on a wall, a corner. Infinity if they do not meet or are parallel.
    """
    wx, wy = walls.x[w] - px, walls.y[w] - py
    determinant = rx * walls.dy[w] - ry * walls.dx[w]
    along_wall = wx * ry - wy * rx
    along_ray = wx * walls.dy[w] - wy * walls.dx[w]
    if determinant < 0:
        determinant, along_wall, along_ray = -determinant, -along_wall, -along_ray
    if determinant != 0 and 0 <= along_wall <= determinant and 0 <= along_ray <= determinant:
        return along_ray / determinant
    return math.inf


@inner
def first_hit(walls: WallTable, grid: WallGrid, source: int, px: int, py: int, rx: int, ry: int) -> tuple[int, int]:
    """Return the first wall other than `source` on the way from (px, py) to (px + rx, py + ry), MISS if there is none.

    Walks from cell to cell of the grid until a wall is met no farther than the edge of the cell. Returned is also how
    many walls the ray was compared with.
    """
    cell_x, cell_y = (px - grid.x_mm) // grid.side_mm, (py - grid.y_mm) // grid.side_mm
    step_x, step_y = (1 if rx > 0 else -1), (1 if ry > 0 else -1)
    # Places along the ray at which it leaves the cell across x and y, and how far apart such places are.
    leave_x, leave_y, across_x, across_y = math.inf, math.inf, math.inf, math.inf
    if rx != 0:
        leave_x = (grid.x_mm + (cell_x + (step_x + 1) // 2) * grid.side_mm - px) / rx
        across_x = grid.side_mm / abs(rx)
    if ry != 0:
        leave_y = (grid.y_mm + (cell_y + (step_y + 1) // 2) * grid.side_mm - py) / ry
        across_y = grid.side_mm / abs(ry)
    best, best_at, n_compared = MISS, math.inf, 0
    while 0 <= cell_x < grid.nx and 0 <= cell_y < grid.ny:
        cell = cell_x * grid.ny + cell_y
        n_compared += grid.ptr[cell + 1] - grid.ptr[cell]
        for k in range(grid.ptr[cell], grid.ptr[cell + 1]):
            w = grid.wall[k]
            at = meet(walls, w, px, py, rx, ry)
            if at <= best_at and at <= 1.0 and w != source and (at < best_at or walls.rank[w] < walls.rank[best]):
                best, best_at = w, at
        leave = min(leave_x, leave_y)
        if best_at <= leave or leave > 1.0:
            break
        if leave_x < leave_y:
            cell_x += step_x
            leave_x += across_x
        else:
            cell_y += step_y
            leave_y += across_y
    return best, n_compared


@inner
def random_ray(walls: WallTable, w: int, key: np.uint64, range_mm: int) -> tuple[int, int, int, int]:
    """Draw a ray from a random point of wall w in a random direction: its start and the way from there to its end, mm.

    The direction is a random point of the disc, stretched to the circle: no sine, which differs between processors.
    """
    place = uniform_of(key)
    px = walls.x[w] + math.floor(place * walls.dx[w])
    py = walls.y[w] + math.floor(place * walls.dy[w])
    while True:
        key = mix(key)
        x = 2.0 * uniform_of(key) - 1.0
        key = mix(key)
        y = 2.0 * uniform_of(key) - 1.0
        square = x * x + y * y
        if 1e-6 < square <= 1.0:
            stretch = range_mm / math.sqrt(square)
            return px, py, math.floor(x * stretch + 0.5), math.floor(y * stretch + 0.5)


@making_arrays
def count_hits(
    walls: WallTable, grid: WallGrid, building_id: Array, seed: int, range_mm: int, compared_max: int
) -> tuple[Array, Array, Array, int]:
    """Send the rays of all walls and count, for every building, which others they hit.

    A building's rays are numbered across its walls and keyed by its identifier, (n,) int64, so they are the same
    whatever else the city holds. Returns ptr (n+1,), building (links,) and hits (links,), all int64: as CSR, the
    buildings that each building's rays hit, in the order of the first hit, and how often. Rays that hit nothing or
    their own building are left out. Last comes the building at which rays had been compared with `compared_max` walls:
    there it ends; n if it ends with the last one.
    """
    n = len(building_id)
    n_rays = 0
    for w in range(len(walls.x)):
        n_rays += walls.n_rays[w]
    ptr = np.zeros(n + 1, dtype=np.int64)
    neighbour = np.empty(n_rays, dtype=np.int64)
    n_hits = np.empty(n_rays, dtype=np.int64)
    slot = np.full(n, -1, dtype=np.int64)  # where the current building's hits on another one are counted
    end = np.int64(0)
    ray = np.int64(0)
    n_compared = np.int64(0)
    for w in range(len(walls.x)):
        b = walls.building[w]
        if w > 0 and walls.building[w - 1] != b:
            ray = np.int64(0)
        for _ in range(walls.n_rays[w]):
            px, py, rx, ry = random_ray(walls, w, hash_key(seed, RAY, ray, building_id[b]), range_mm)
            ray += 1
            hit, n_here = first_hit(walls, grid, w, px, py, rx, ry)
            n_compared += n_here
            if n_compared > compared_max:
                return ptr, neighbour[:end], n_hits[:end], b
            if hit == MISS or walls.building[hit] == b:
                continue
            other = walls.building[hit]
            if slot[other] < ptr[b]:
                slot[other] = end
                neighbour[end] = other
                n_hits[end] = 0
                end += 1
            n_hits[slot[other]] += 1
        ptr[b + 1] = end
    return ptr, neighbour[:end], n_hits[:end], n
