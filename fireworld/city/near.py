"""Which buildings belong to one fire site when both burn: linked by radiation, or outlines close together."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from fireworld.city.city import Footprints, Int32Array, Int64Array, Links
from fireworld.city.outlines import bounding_boxes, numbered
from fireworld.errors import CityError, expected
from fireworld.kernels.near import BoxGrid, fill_rows, find_upper

SITE_GAP_MM: Final = 30_000
"""Outlines closer than this, strictly, make one fire site."""
COMPARED_FREE: Final = 300_000_000
COMPARED_PER_BUILDING: Final = 20_000
"""Outlines are compared at as many pairs of walls as these make together, at most: houses at some hundreds each."""


def near_relation(footprints: Footprints, links: Links, *, where: str = "city") -> Links:
    """Relate the buildings that are linked in either direction, or whose outlines are closer than 30 m.

    The relation is symmetric, as CSR, neighbours rising, all shares 1; no building is near itself. CityError, which
    begins with `where`, if outlines of many corners lie around one another, so that too many walls are compared.
    """
    upper_ptr, upper = _upper_neighbours(footprints, links, where)
    n = len(footprints.building_id)
    n_related = np.diff(upper_ptr) + np.bincount(upper, minlength=n)
    ptr = np.concatenate([[0], np.cumsum(n_related)]).astype(np.int32)
    building = np.empty(2 * len(upper), dtype=np.int32)
    fill_rows(upper_ptr, upper, ptr, ptr[:-1].copy(), building)
    return Links(ptr=ptr, building=building, share=np.ones(len(building), dtype=np.float32))


def _upper_neighbours(footprints: Footprints, links: Links, where: str) -> tuple[Int64Array, Int32Array]:
    """Return the near buildings with higher numbers of every building, as CSR, in any order."""
    low, high = bounding_boxes(footprints)
    n = len(low)
    city = footprints.outline_ptr, footprints.outline_mm, low, high, _box_grid(low, high), *_either_way(links)
    met, ptr = np.full(n, -1, dtype=np.int32), np.zeros(n + 1, dtype=np.int64)
    upper, done = np.empty(8 * n, dtype=np.int32), 0
    compared_max, n_compared = COMPARED_FREE + COMPARED_PER_BUILDING * n, np.zeros(1, dtype=np.int64)
    while True:
        done = find_upper(done, *city, SITE_GAP_MM, met, ptr, upper, compared_max, n_compared)
        if done == n:
            return ptr, upper[: ptr[-1]]
        if n_compared[0] > compared_max:
            key = f"building {int(footprints.building_id[done])}: apexes"
            wanted = f"outlines that are compared at no more than {compared_max} pairs of walls"
            raise CityError(expected(where, key, wanted, "more: too many of many corners lie around one another"))
        upper = np.concatenate([upper, np.empty(len(upper), dtype=np.int32)])


def _either_way(links: Links) -> tuple[Int64Array, Int32Array]:
    """Return the links out of each building together with those into it, as CSR: ptr (n+1,) and building."""
    n = len(links.ptr) - 1
    emitter = np.repeat(np.arange(n, dtype=np.int32), np.diff(links.ptr))
    owner = np.concatenate([emitter, links.building])
    by_owner = np.argsort(owner, kind="stable")
    ptr = np.concatenate([[0], np.cumsum(np.bincount(owner, minlength=n))])
    return ptr, np.concatenate([links.building, emitter])[by_owner]


def _box_grid(low: Int64Array, high: Int64Array) -> BoxGrid:
    """Sort the bounding boxes, (n, 2) corners each, into square cells, at most about as many cells as boxes."""
    origin = low.min(axis=0)
    width, height = (int(side) for side in high.max(axis=0) - origin)
    side = max(SITE_GAP_MM, math.isqrt(width * height // len(low)))
    first, last = (low - origin) // side, (high - origin) // side
    nx, ny = width // side + 1, height // side + 1
    box, column = numbered(first[:, 0], last[:, 0])
    piece, row = numbered(first[box, 1], last[box, 1])
    cell = column[piece] * ny + row
    ptr = np.zeros(nx * ny + 1, dtype=np.int64)
    np.cumsum(np.bincount(cell, minlength=nx * ny), out=ptr[1:])
    building = box[piece][np.argsort(cell, kind="stable")]
    return BoxGrid(int(origin[0]), int(origin[1]), side, nx, ny, ptr, building.astype(np.int32))
