"""Which cells of the air grid each building covers, and how much of each."""

from __future__ import annotations

from typing import Final

import numpy as np

from fireworld.city.city import AirCells, Float64Array, Footprints
from fireworld.city.outlines import bounding_boxes
from fireworld.errors import CityError, expected
from fireworld.kernels.covers import SAMPLES, count_covers

N_CELLS_MAX: Final = 4_000_000
"""Cells of the largest air grid: 10 km by 10 km in cells of 5 m."""
N_COVERS_MAX: Final = 16_000_000
"""Cells that the bounding boxes of all buildings may hold together: what a city keeps of them stays below 1 GB."""


def cover_cells(footprints: Footprints, cell_mm: int, *, where: str = "city") -> AirCells:
    """Lay the air grid over the city and measure each building's cover of its cells.

    The grid starts at the minimum of all corners and has 1 + span // cell_mm cells a side. Cover in per cent is how
    many of a cell's 10 * 10 sample points, from its lower left corner in steps of a tenth, lie in the building:
    even-odd rule, half-open in y, and a point on a wall belongs to the building if the inside is at its right, but for
    the rounding of `fireworld.kernels.covers`. Raises CityError, which begins with `where`, for a city too large, and
    for a building that covers no sample point.
    """
    low, high = bounding_boxes(footprints)
    origin, span = low.min(axis=0), high.max(axis=0) - low.min(axis=0)
    shape = 1 + span // cell_mm
    if int(shape[0]) * int(shape[1]) > N_CELLS_MAX:
        wanted = f"at most {N_CELLS_MAX} air cells of {cell_mm} mm over all buildings"
        got = f"{int(span[0])} mm by {int(span[1])} mm"
        raise CityError(expected(where, "buildings", wanted, got, "try to find a building far away from the others"))
    first, last = (low - origin) // cell_mm, (high - origin) // cell_mm
    blocks = last - first + 1  # (n, 2) cells of each building's bounding box
    n_cells = blocks[:, 0] * blocks[:, 1]
    if int(n_cells.sum()) > N_COVERS_MAX:
        largest = int(np.argmax(n_cells))
        wanted = f"at most {N_COVERS_MAX} air cells of {cell_mm} mm under all buildings together"
        key = f"building {int(footprints.building_id[largest])}: apexes"
        got = f"{int(n_cells.sum())}, {int(blocks[largest, 0])} by {int(blocks[largest, 1])} of them under this one"
        raise CityError(expected(where, key, wanted, got, "try larger air cells or smaller buildings"))
    samples = [_samples(int(origin[axis]), int(shape[axis]), cell_mm) for axis in (0, 1)]
    flips = np.empty((SAMPLES, int(blocks[:, 0].max()) * SAMPLES + 1), dtype=np.uint8)
    inside = np.empty(int(n_cells.max()), dtype=np.uint8)
    ptr = np.empty(len(first) + 1, dtype=np.int32)
    cell = np.empty((3, int(n_cells.sum())), dtype=np.int32)
    outlines = footprints.outline_ptr, footprints.outline_mm
    count_covers(*outlines, first, blocks, *samples, flips, inside, ptr, cell)
    n_covered = np.diff(ptr)
    if not n_covered.all():
        lost = int(footprints.building_id[int(np.argmin(n_covered))])
        wanted = "a footprint that covers a sample point of the air grid"
        raise CityError(expected(where, f"building {lost}: apexes", wanted, "one between them", "try a larger one"))
    return AirCells(
        origin_mm=(int(origin[0]), int(origin[1])),
        cell_mm=cell_mm,
        shape=(int(shape[0]), int(shape[1])),
        ptr=ptr,
        x=cell[0, : ptr[-1]].copy(),  # without the room for cells that have no sample inside
        y=cell[1, : ptr[-1]].copy(),
        percent=cell[2, : ptr[-1]].copy(),
    )


def _samples(origin_mm: int, n_cells: int, cell_mm: int) -> Float64Array:
    """Return where the sample points of a row of cells lie, mm: ten a cell, in the rounding of the official program.

    It keeps the corner of a cell and a tenth of its side in single precision, which is exact up to 16 km and for
    whole centimetres.
    """
    corner = (origin_mm + cell_mm * np.arange(n_cells, dtype=np.int64)).astype(np.float32).astype(np.float64)
    step = float(np.float32(cell_mm) / np.float32(SAMPLES))
    samples: Float64Array = (step * np.arange(SAMPLES) + corner[:, None]).ravel()
    return samples
