"""Which cells of the air grid each building covers, and how much of each."""

from __future__ import annotations

from typing import Final

import numpy as np

from fireworld.city.city import AirCells, Footprints, Int64Array
from fireworld.city.outlines import bounding_boxes, numbered, walls_of
from fireworld.errors import CityError, expected

SAMPLES: Final = 10
"""Sample points along each side of a cell."""
N_CELLS_MAX: Final = 4_000_000
"""Cells of the largest air grid: 10 km by 10 km in cells of 5 m."""

N_COVERS_MAX: Final = 400_000
"""Cells that all buildings may cover together: 100 samples each, so that the memory needed stays below 1 GB."""


def cover_cells(footprints: Footprints, cell_mm: int, *, where: str = "city") -> AirCells:
    """Lay the air grid over the city and measure each building's cover of its cells.

    The grid starts at the minimum of all corners and has 1 + span // cell_mm cells a side. Cover in per cent is how
    many of a cell's 10 * 10 sample points, from its lower left corner in steps of a tenth, lie in the building:
    even-odd rule, half-open in y, and a point on a wall belongs to the building if the inside is at its right.
    Everything is whole numbers (in tenths of a millimetre, so that any cell size has exact samples). Raises CityError,
    which begins with `where`, for a city too large, and for a building that covers no sample point.
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
    largest = int(np.argmax(blocks[:, 0] * blocks[:, 1]))
    if int((blocks[:, 0] * blocks[:, 1]).sum()) > N_COVERS_MAX:
        wanted = f"at most {N_COVERS_MAX} air cells of {cell_mm} mm under all buildings together"
        key = f"building {int(footprints.building_id[largest])}: apexes"
        got = f"{int(blocks[largest, 0])} by {int(blocks[largest, 1])} cells under this one"
        raise CityError(expected(where, key, wanted, got, "try larger air cells or smaller buildings"))
    counts = _count_samples(footprints, origin + first * cell_mm, blocks, cell_mm)

    building, within = numbered(np.zeros(len(blocks), dtype=np.int64), blocks[:, 0] * blocks[:, 1] - 1)
    x = first[building, 0] + within // blocks[building, 1]
    y = first[building, 1] + within % blocks[building, 1]
    covered = counts > 0
    n_covered = np.bincount(building[covered], minlength=len(blocks))
    if not n_covered.all():
        lost = int(footprints.building_id[int(np.argmin(n_covered))])
        wanted = "a footprint that covers a sample point of the air grid"
        raise CityError(expected(where, f"building {lost}: apexes", wanted, "one between them", "try a larger one"))
    return AirCells(
        origin_mm=(int(origin[0]), int(origin[1])),
        cell_mm=cell_mm,
        shape=(int(shape[0]), int(shape[1])),
        ptr=np.concatenate([[0], np.cumsum(n_covered)]).astype(np.int32),
        x=x[covered].astype(np.int32),
        y=y[covered].astype(np.int32),
        percent=counts[covered].astype(np.int32),
    )


def _count_samples(footprints: Footprints, corner_mm: Int64Array, blocks: Int64Array, cell_mm: int) -> Int64Array:
    """Count the sample points inside each building, cell by cell of its bounding box, x outer, y inner.

    Every building has a raster of samples, one row per sample y. Each crossing of a wall with a row flips all samples
    at and right of it; a row has an even number of crossings, so one running parity over all rows will do. `corner_mm`
    (n, 2) is the lower left of each building's block of cells, `blocks` (n, 2) their number along x and y.
    """
    walls = walls_of(footprints)
    rows, width = blocks[:, 1] * SAMPLES, blocks[:, 0] * SAMPLES + 1  # one spare sample takes crossings at the end
    raster_start = np.cumsum(rows * width) - rows * width

    # In tenths of a millimetre a sample lies every `cell_mm`. A wall crosses the rows k with y1 <= k * cell_mm < y2.
    start = SAMPLES * (walls.start_mm - corner_mm[walls.building])
    end = SAMPLES * (walls.end_mm - corner_mm[walls.building])
    row_low = _ceil_divide(np.minimum(start[:, 1], end[:, 1]), cell_mm)
    row_high = _ceil_divide(np.maximum(start[:, 1], end[:, 1]), cell_mm)
    wall, row = numbered(row_low, row_high - 1)

    rise, run = (end[:, 1] - start[:, 1])[wall], (end[:, 0] - start[:, 0])[wall]
    sign = np.sign(rise)
    crossing = (start[wall, 0] * rise + (row * cell_mm - start[wall, 1]) * run) * sign  # times |rise|
    sample = _ceil_divide(crossing, rise * sign * cell_mm)  # the first at or right of the crossing
    owner = walls.building[wall]
    flips = np.bincount(raster_start[owner] + row * width[owner] + sample, minlength=int((rows * width).sum()))
    inside = np.cumsum(flips, dtype=np.uint32) & 1  # parity survives a wrap

    at = np.flatnonzero(inside)
    building = np.searchsorted(raster_start, at, side="right") - 1
    within = at - raster_start[building]
    cell = within % width[building] // SAMPLES * blocks[building, 1] + within // width[building] // SAMPLES
    n_cells = blocks[:, 0] * blocks[:, 1]
    cell_start = np.cumsum(n_cells) - n_cells
    return np.bincount(cell_start[building] + cell, minlength=int(n_cells.sum()))


def _ceil_divide(numerator: Int64Array, denominator: Int64Array | int) -> Int64Array:
    """Divide whole numbers, rounding up; denominators are positive."""
    return -(-numerator // denominator)
