"""Which buildings belong to one fire site when both burn: linked by radiation, or outlines close together."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from fireworld.city.city import Footprints, Int32Array, Int64Array, Links
from fireworld.city.outlines import bounding_boxes, numbered
from fireworld.kernels.near import BoxGrid, near_pairs

SITE_GAP_MM: Final = 30_000
"""Outlines closer than this, strictly, make one fire site."""


def near_relation(footprints: Footprints, links: Links) -> Links:
    """Relate the buildings that are linked in either direction, or whose outlines are closer than 30 m.

    The relation is symmetric, as CSR, neighbours rising, all shares 1; no building is near itself.
    """
    low, high = bounding_boxes(footprints)
    grid = _box_grid(low, high)
    linked = _either_way(links)
    ptr, building = near_pairs(footprints.outline_ptr, footprints.outline_mm, low, high, grid, *linked, SITE_GAP_MM)
    return Links(ptr=ptr, building=building, share=np.ones(len(building), dtype=np.float32))


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
