"""Which air cells lie under which building, and how much of each: sample points counted by the even-odd rule.

The official program asks Java's polygons about every sample point, so the rounding of that question is part of the
model: a point right of a wall's lower end (x1, y1) by dx and above it by dy lies left of the wall up to (x2, y2) if
dx < dy / (y2 - y1) * (x2 - x1), in double precision. It decides points that lie exactly on a wall.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from fireworld.kernels.arrays import Array
from fireworld.kernels.jit import inner, making_arrays

SAMPLES: Final = 10
"""Sample points along each side of a cell."""


@inner
def first_right(x1: int, x2: int, reach: float, sample_x: Array, guess: int) -> int:
    """Return the first of the rising samples that does not lie left of a wall in its row; their number if all do.

    `reach` is how far the wall has gone from its lower end at x1 towards x2 in this row, `guess` any sample.
    """
    low, high = min(x1, x2), max(x1, x2)
    sample = max(0, min(guess, len(sample_x)))
    while sample > 0:
        x = sample_x[sample - 1]
        if x < low or (x < high and x - x1 < reach):
            break
        sample -= 1
    while sample < len(sample_x):
        x = sample_x[sample]
        if x >= high or (x >= low and not x - x1 < reach):
            break
        sample += 1
    return sample


@inner
def flip_band(corners: Array, sample_x: Array, sample_y: Array, step_mm: float, flips: Array) -> None:
    """Mark in every row of samples where a building's inside begins and ends.

    Every crossing of a wall with row r flips all samples at and right of it: flips[r, sample]. `corners` (c, 2) are
    those of one building, `step_mm` is about the distance of two samples. The marks made before are wiped out.
    """
    for row in range(len(sample_y)):
        for sample in range(len(sample_x) + 1):
            flips[row, sample] = 0
    last = len(corners) - 1
    for k in range(len(corners)):
        start, end = (last if k == 0 else k - 1), k
        if corners[start, 1] > corners[end, 1]:
            start, end = end, start
        x1, y1, x2, y2 = (
            np.int64(corners[start, 0]),
            np.int64(corners[start, 1]),
            np.int64(corners[end, 0]),
            np.int64(corners[end, 1]),
        )
        if y1 == y2 or y1 > sample_y[-1] or y2 <= sample_y[0]:
            continue
        for row in range(len(sample_y)):
            y = sample_y[row]
            if y1 <= y < y2:
                reach = (y - y1) / (y2 - y1) * (x2 - x1)
                guess = int((x1 + reach - sample_x[0]) / step_mm)
                sample = first_right(x1, x2, reach, sample_x, guess)
                flips[row, sample] ^= 1


@making_arrays
def count_covers(
    outline_ptr: Array, outline_mm: Array, first: Array, blocks: Array, sample_x: Array, sample_y: Array
) -> tuple[Array, Array, Array, Array]:
    """Count the sample points inside every building, cell by cell.

    Args:
        outline_ptr: (n+1,) start of each building's corners.
        outline_mm: (corners, 2).
        first: (n, 2) lower left cell of each building's bounding box.
        blocks: (n, 2) cells along x and y of that box.
        sample_x: float64, x of all columns of samples of the grid, mm, rising, ten a cell.
        sample_y: float64, y of all rows.

    Returns:
        Of every building the cells with a sample inside, x outer and y inner: ptr (n+1,), x, y and the number of
        samples, 1 to 100, all int32.
    """
    n = len(first)
    n_cells, widest, largest = 0, 0, 0
    for b in range(n):
        cells = blocks[b, 0] * blocks[b, 1]
        n_cells += cells
        widest, largest = max(widest, blocks[b, 0]), max(largest, cells)
    ptr = np.zeros(n + 1, dtype=np.int32)
    cell_x, cell_y = np.empty(n_cells, dtype=np.int32), np.empty(n_cells, dtype=np.int32)
    count = np.empty(n_cells, dtype=np.int32)
    samples = np.empty(largest, dtype=np.uint8)  # inside, by cell of the current building
    flips = np.empty((SAMPLES, widest * SAMPLES + 1), dtype=np.uint8)  # one to spare takes crossings at the end
    step_mm = (sample_x[SAMPLES - 1] - sample_x[0]) / (SAMPLES - 1)
    end = 0
    for b in range(n):
        nx, ny = blocks[b, 0], blocks[b, 1]
        width = nx * SAMPLES
        corners = outline_mm[outline_ptr[b] : outline_ptr[b + 1]]
        columns = sample_x[first[b, 0] * SAMPLES : (first[b, 0] + nx) * SAMPLES]
        for cell in range(nx * ny):
            samples[cell] = 0
        for y in range(ny):
            row = (first[b, 1] + y) * SAMPLES
            flip_band(corners, columns, sample_y[row : row + SAMPLES], step_mm, flips)
            for k in range(SAMPLES):
                inside = np.uint8(0)
                for sample in range(width):
                    inside ^= flips[k, sample]
                    samples[sample // SAMPLES * ny + y] += inside
        for cell in range(nx * ny):
            if samples[cell]:
                cell_x[end] = first[b, 0] + cell // ny
                cell_y[end] = first[b, 1] + cell % ny
                count[end] = samples[cell]
                end += 1
        ptr[b + 1] = end
    return ptr, cell_x[:end], cell_y[:end], count[:end]
