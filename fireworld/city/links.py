"""Radiation links: the share of a building's radiation that reaches each other building, found by sending rays."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from fireworld.city.city import Footprints, Int32Array, Links
from fireworld.city.outlines import numbered, walls_of
from fireworld.errors import CityError, expected
from fireworld.kernels.rays import WallGrid, WallTable, count_hits
from fireworld.parameters import FireParameters

MARGIN_MM: Final = 1
"""A wall is registered in every cell that it comes this close to."""
CELL_SIDE_MIN_MM: Final = 1000
RAYS_FREE: Final = 10_000_000
RAYS_PER_BUILDING: Final = 1000
N_RAYS_MAX: Final = 200_000_000
"""Buildings send at most as many rays as the first two make together, and no more than the last: a house sends 130."""
COMPARED_FREE: Final = 500_000_000
COMPARED_PER_RAY: Final = 50
"""All rays are compared with at most as many walls as these make together; in cities a ray with 7 to 10, where parts of
them lie far apart with some hundreds."""


def radiation_links(
    footprints: Footprints, order: Int32Array, fire: FireParameters, *, seed: int, where: str = "city"
) -> Links:
    """Send every building's rays; a link's share is its hits over all rays, self-hits and misses included.

    `order` (n,): in which the official program visits the buildings. `fire` has the number and the length of the rays.
    Raises CityError, which begins with `where`, for walls so long that they send too many rays, or so close together
    that each is compared with too many.
    """
    walls = wall_table(footprints, order, fire)
    n_rays = np.bincount(walls.building, weights=walls.n_rays)
    total, n = int(walls.n_rays.sum()), len(footprints.building_id)
    rays_max = min(RAYS_FREE + RAYS_PER_BUILDING * n, N_RAYS_MAX)
    if total > rays_max:
        most = int(np.argmax(n_rays))
        key = f"building {int(footprints.building_id[most])}: apexes"
        wanted = f"at most {rays_max} rays from all walls, at {fire.ray_rate_per_mm:g} a mm"
        got = f"{total}, {int(n_rays[most])} of them from this one"
        raise CityError(expected(where, key, wanted, got, "try a smaller parameters.fire.ray_rate_per_mm"))
    compared_max = COMPARED_FREE + COMPARED_PER_RAY * total
    ptr, building, n_hits, end = count_hits(
        walls, wall_grid(walls), footprints.building_id, seed, fire.ray_range_mm, compared_max
    )
    if end < n:
        key = f"building {int(footprints.building_id[end])}: apexes"
        wanted = f"at most {compared_max} comparisons of {total} rays with walls"
        raise CityError(expected(where, key, wanted, "more: too many walls lie on one another"))
    emitter = np.repeat(np.arange(len(n_rays)), np.diff(ptr))
    rising = np.lexsort((building, emitter))
    return Links(
        ptr=ptr.astype(np.int32),
        building=building[rising].astype(np.int32),
        share=(n_hits[rising] / n_rays[emitter]).astype(np.float32),
    )


def wall_table(footprints: Footprints, order: Int32Array, fire: FireParameters) -> WallTable:
    """Lay out the walls for the ray caster; a wall sends ceil(length * rate) rays.

    The rate is a number of single precision, as in the official program: at 0.002, which is a bit more then, a wall of
    2 m sends 5 rays. Where walls of two buildings coincide, a ray meets the one whose building the official program
    visits first.
    """
    walls = walls_of(footprints)
    visited = np.empty(len(order), dtype=np.int64)
    visited[order] = np.arange(len(order))
    index = np.arange(len(walls.building))
    span = walls.end_mm - walls.start_mm
    return WallTable(
        building=walls.building.astype(np.int64),
        rank=visited[walls.building] * len(index) + index,
        x=np.ascontiguousarray(walls.start_mm[:, 0]),
        y=np.ascontiguousarray(walls.start_mm[:, 1]),
        dx=np.ascontiguousarray(span[:, 0]),
        dy=np.ascontiguousarray(span[:, 1]),
        n_rays=np.ceil(walls.length_mm * float(np.float32(fire.ray_rate_per_mm))).astype(np.int64),
    )


def wall_grid(walls: WallTable) -> WallGrid:
    """Sort the walls into square cells, about as many cells as walls.

    A slanted wall is entered column by column of cells, so that a long one costs its length and not its square.
    """
    low_x, high_x = np.minimum(walls.x, walls.x + walls.dx), np.maximum(walls.x, walls.x + walls.dx)
    low_y, high_y = np.minimum(walls.y, walls.y + walls.dy), np.maximum(walls.y, walls.y + walls.dy)
    x_mm, y_mm = int(low_x.min()) - MARGIN_MM, int(low_y.min()) - MARGIN_MM
    width, height = int(high_x.max()) + MARGIN_MM - x_mm, int(high_y.max()) + MARGIN_MM - y_mm
    side = max(CELL_SIDE_MIN_MM, math.isqrt(width * height // len(walls.x)))

    wall, column = numbered((low_x - MARGIN_MM - x_mm) // side, (high_x + MARGIN_MM - x_mm) // side)
    left = np.maximum(low_x[wall], x_mm + column * side - MARGIN_MM)
    right = np.minimum(high_x[wall], x_mm + (column + 1) * side + MARGIN_MM)
    run = np.where(walls.dx[wall] == 0, 1, walls.dx[wall])
    rise = np.where(walls.dx[wall] == 0, 0, walls.dy[wall])
    y_left = walls.y[wall] + (left - walls.x[wall]) * rise // run
    y_right = walls.y[wall] + (right - walls.x[wall]) * rise // run
    upright = walls.dx[wall] == 0
    low = np.where(upright, low_y[wall], np.minimum(y_left, y_right))
    high = np.where(upright, high_y[wall], np.maximum(y_left, y_right) + 1)
    piece, row = numbered((low - MARGIN_MM - y_mm) // side, (high + MARGIN_MM - y_mm) // side)

    nx, ny = width // side + 1, height // side + 1
    cell = column[piece] * ny + row
    ptr = np.zeros(nx * ny + 1, dtype=np.int64)
    np.cumsum(np.bincount(cell, minlength=nx * ny), out=ptr[1:])
    return WallGrid(x_mm, y_mm, side, nx, ny, ptr, wall[piece][np.argsort(cell, kind="stable")])
