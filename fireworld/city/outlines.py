"""Buildings as a generator or a file describes them one by one, their assembly into arrays, and the walls of all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np

from fireworld.city.city import Array, Float64Array, Footprints, Int32Array, Int64Array

Corner = tuple[int, int]


@dataclass(frozen=True, kw_only=True)
class Building:
    """One building of a plan; lengths in mm."""

    building_id: int
    corners_mm: Sequence[Corner]
    centroid_mm: Corner
    floors: int
    material: int
    ground_area_m2: float
    inflammable: bool
    refuge: bool


def assemble(buildings: Sequence[Building]) -> Footprints:
    """Lay out the buildings as arrays, in the order given."""
    n_corners = [len(building.corners_mm) for building in buildings]
    return Footprints(
        building_id=np.array([building.building_id for building in buildings], dtype=np.int64),
        refuge=np.array([building.refuge for building in buildings], dtype=np.uint8),
        outline_ptr=np.concatenate([[0], np.cumsum(n_corners)]).astype(np.int32),
        outline_mm=np.array(list(chain.from_iterable(building.corners_mm for building in buildings)), dtype=np.int32),
        centroid_mm=np.array([building.centroid_mm for building in buildings], dtype=np.int32),
        floors=np.array([building.floors for building in buildings], dtype=np.int32),
        material=np.array([building.material for building in buildings], dtype=np.uint8),
        ground_area_m2=np.array([building.ground_area_m2 for building in buildings], dtype=np.float32),
        inflammable=np.array([building.inflammable for building in buildings], dtype=np.uint8),
    )


def doubled_area_mm2(corners: Sequence[Corner]) -> int:
    """Return twice the area that a polygon encloses, exactly; positive counterclockwise, negative clockwise."""
    return sum(x * next_y - next_x * y for (x, y), (next_x, next_y) in _sides(corners))


def centroid_mm(corners: Sequence[Corner]) -> Corner:
    """Return the centroid of a polygon with an area, rounded down to whole mm."""
    x_moment = y_moment = 0
    for (x, y), (next_x, next_y) in _sides(corners):
        cross = x * next_y - next_x * y
        x_moment += (x + next_x) * cross
        y_moment += (y + next_y) * cross
    area = 3 * doubled_area_mm2(corners)
    return x_moment // area, y_moment // area


def _sides(corners: Sequence[Corner]) -> list[tuple[Corner, Corner]]:
    """Pair every corner with the next one, the last with the first."""
    return list(zip(corners, [*corners[1:], corners[0]], strict=True))


@dataclass(frozen=True)
class Walls:
    """All w walls, building by building, in the order of the corners; the closing wall of each is its last.

    A corner listed twice in a row makes no wall. Only a closing wall may have no length: where the first corner is
    listed again at the end.
    """

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
    """List the walls of all buildings, each from a corner to the next one of its building."""
    ptr = footprints.outline_ptr.astype(np.int64)
    corners = footprints.outline_mm.astype(np.int64)
    successor = np.arange(1, len(corners) + 1)
    successor[ptr[1:] - 1] = ptr[:-1]
    closing = np.zeros(len(corners), dtype=np.bool_)
    closing[ptr[1:] - 1] = True
    building = np.repeat(np.arange(len(ptr) - 1, dtype=np.int32), np.diff(ptr))
    ends = corners[successor]
    walls = closing | (corners != ends).any(axis=1)
    return Walls(building=building[walls], start_mm=corners[walls], end_mm=ends[walls], closing=closing[walls])


def without_repeats(footprints: Footprints) -> tuple[Int32Array, Int32Array]:
    """Return the outlines, ptr (n+1,) and corners (c, 2) in mm, without corners listed twice in a row.

    A first corner that is listed again at the end counts as such: no outline says how it is closed.
    """
    ptr, corners = footprints.outline_ptr, footprints.outline_mm
    successor = np.arange(1, len(corners) + 1)
    successor[ptr[1:] - 1] = ptr[:-1]
    kept = (corners != corners[successor]).any(axis=1)
    before = np.concatenate([[0], np.cumsum(kept)])
    return before[ptr].astype(np.int32), corners[kept]


def bounding_boxes(footprints: Footprints) -> tuple[Int64Array, Int64Array]:
    """Return the lower left and the upper right corner of each building's bounding box, (n, 2) each, in mm."""
    starts = footprints.outline_ptr[:-1]
    low = np.minimum.reduceat(footprints.outline_mm, starts, axis=0).astype(np.int64)
    high = np.maximum.reduceat(footprints.outline_mm, starts, axis=0).astype(np.int64)
    return low, high


def numbered(first: Int64Array, last: Int64Array) -> tuple[Int64Array, Int64Array]:
    """List the pairs (k, number) for every number from first[k] to last[k], both included."""
    length = last - first + 1
    k = np.repeat(np.arange(len(length)), length)
    number = np.arange(len(k)) - np.repeat(np.cumsum(length) - length, length) + first[k]
    return k, number
