"""The ray caster's baseline in plain numpy: every ray against every wall, a bundle of rays at a time."""

from __future__ import annotations

from typing import Final

import numpy as np

from fireworld.city.city import Array, Float64Array, Int64Array
from fireworld.city.outlines import Walls

BUNDLE: Final = 256
MISS: Final = -1


def random_rays(walls: Walls, *, rays_per_mm: float, range_mm: float, seed: int) -> tuple[Array, Array, Array]:
    """Draw the rays of a city: (r,) walls they leave from, (r, 2) starts and (r, 2) ends, whole mm."""
    random = np.random.default_rng(seed)
    n_rays = np.ceil(walls.length_mm * rays_per_mm).astype(np.int64)
    source = np.repeat(np.arange(len(n_rays)), n_rays)
    place = random.random((len(source), 1))
    start = walls.start_mm[source] + np.floor(place * (walls.end_mm - walls.start_mm)[source]).astype(np.int64)
    angle = random.uniform(0.0, 2.0 * np.pi, len(source))
    way = range_mm * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return source, start, start + np.round(way).astype(np.int64)


def walls_hit(walls: Walls, rank: Int64Array, *, source: Array, start_mm: Array, end_mm: Array) -> Int64Array:
    """Find the first wall that each of r rays meets, MISS if there is none; the rule of `fireworld.kernels.rays`.

    Args:
        walls: w walls.
        rank: (w,) of two walls at the same distance the one with the lower rank is met.
        source: (r,) wall that each ray leaves from, which it does not meet.
        start_mm: (r, 2).
        end_mm: (r, 2).
    """
    by_rank = np.argsort(rank)  # argmin takes the first of equals
    place = np.argsort(by_rank)
    corner = walls.start_mm[by_rank].astype(np.float64)
    span = (walls.end_mm - walls.start_mm)[by_rank].astype(np.float64)
    hits = np.empty(len(source), dtype=np.int64)
    for first in range(0, len(source), BUNDLE):
        rays = slice(first, first + BUNDLE)
        start, way = start_mm[rays, None].astype(np.float64), (end_mm - start_mm)[rays, None].astype(np.float64)
        at = _places(corner - start, span, way)
        at[np.arange(len(at)), place[source[rays]]] = np.inf
        nearest = at.argmin(axis=1)
        met = np.isfinite(at[np.arange(len(at)), nearest])
        hits[rays] = np.where(met, by_rank[nearest], MISS)
    return hits


def _places(to_wall: Float64Array, span: Float64Array, way: Float64Array) -> Float64Array:
    """(rays, walls) place along each ray at which it meets each wall, 0 start, 1 end; infinite if it does not."""
    determinant = way[..., 0] * span[:, 1] - way[..., 1] * span[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        along_wall = (to_wall[..., 0] * way[..., 1] - to_wall[..., 1] * way[..., 0]) / determinant
        along_ray = (to_wall[..., 0] * span[:, 1] - to_wall[..., 1] * span[:, 0]) / determinant
    met = (along_wall >= 0) & (along_wall <= 1) & (along_ray >= 0) & (along_ray <= 1)
    return np.where(met, along_ray, np.inf)
