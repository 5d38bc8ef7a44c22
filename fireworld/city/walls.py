"""The walls of all buildings in one table: corner to corner, the closing wall last."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fireworld.city.city import Array, Float64Array, Footprints, Int32Array, Int64Array


@dataclass(frozen=True)
class Walls:
    """All w walls, building by building, in the order of the corners."""

    building: Int32Array  # (w,) index of the owner, rising
    start_mm: Int64Array  # (w, 2)
    end_mm: Int64Array  # (w, 2)
    closing: Array  # (w,) bool, True for the wall from a building's last corner to its first

    @property
    def length_mm(self) -> Float64Array:
        """(w,) length of each wall: the square root of a whole number, the same on every processor."""
        span = self.end_mm - self.start_mm
        return np.sqrt((span[:, 0] * span[:, 0] + span[:, 1] * span[:, 1]).astype(np.float64))


def walls_of(footprints: Footprints) -> Walls:
    """List the walls of all buildings; wall k leads from corner k to the next corner of its building."""
    ptr = footprints.outline_ptr.astype(np.int64)
    corners = footprints.outline_mm.astype(np.int64)
    successor = np.arange(1, len(corners) + 1)
    successor[ptr[1:] - 1] = ptr[:-1]
    closing = np.zeros(len(corners), dtype=np.bool_)
    closing[ptr[1:] - 1] = True
    building = np.repeat(np.arange(len(ptr) - 1, dtype=np.int32), np.diff(ptr))
    return Walls(building=building, start_mm=corners, end_mm=corners[successor], closing=closing)


def bounding_boxes(footprints: Footprints) -> tuple[Int64Array, Int64Array]:
    """Return the lower left and the upper right corner of each building's bounding box, (n, 2) each, in mm."""
    starts = footprints.outline_ptr[:-1]
    low = np.minimum.reduceat(footprints.outline_mm, starts, axis=0).astype(np.int64)
    high = np.maximum.reduceat(footprints.outline_mm, starts, axis=0).astype(np.int64)
    return low, high
