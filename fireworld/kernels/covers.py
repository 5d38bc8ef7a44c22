"""Which air cells lie under which building, and how much of each: sample points counted by the even-odd rule.

The official program asks Java's polygons about every sample point, so the rounding of that question is part of the
model: a point right of a wall's lower end (x1, y1) by dx and above it by dy lies left of the wall up to (x2, y2) if
dx < dy / (y2 - y1) * (x2 - x1), in double precision. It decides points that lie exactly on a wall.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from fireworld.kernels.arrays import Array
from fireworld.kernels.jit import inner, kernel

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


@kernel
def count_covers(
    outline_ptr: Array,
    outline_mm: Array,
    first: Array,
    blocks: Array,
    sample_x: Array,
    sample_y: Array,
    flips: Array,
    samples: Array,
    ptr: Array,
    cell: Array,
) -> None:
    """Count the sample points inside every building, cell by cell.

    Args:
        outline_ptr: (n+1,) start of each building's corners.
        outline_mm: (corners, 2).
        first: (n, 2) lower left cell of each building's bounding box.
        blocks: (n, 2) cells along x and y of that box.
        sample_x: float64, x of all columns of samples of the grid, mm, rising, ten a cell.
        sample_y: float64, y of all rows.
        flips: (10, 10 * widest + 1) uint8, scratch for the columns of the widest box.
        samples: (largest,) uint8, scratch for the cells of the largest box.
        ptr: (n+1,) out: start of each building's cells.
        cell: (3, at least cells of all boxes) out: of every building the cells with a sample inside, x outer and y
            inner: x, y and the number of samples, 1 to 100.
    """
    step_mm = (sample_x[SAMPLES - 1] - sample_x[0]) / (SAMPLES - 1)
    end = np.int64(0)
    ptr[0] = 0
    for b in range(len(first)):
        x0, y0, nx, ny = first[b, 0], first[b, 1], blocks[b, 0], blocks[b, 1]
        corners = outline_mm[outline_ptr[b] : outline_ptr[b + 1]]
        columns = sample_x[x0 * SAMPLES : (x0 + nx) * SAMPLES]
        for k in range(nx * ny):
            samples[k] = 0
        for y in range(ny):
            rows = sample_y[(y0 + y) * SAMPLES : (y0 + y + 1) * SAMPLES]
            flip_band(corners, columns, rows, step_mm, flips)
            for row in range(SAMPLES):
                inside = np.uint8(0)
                for sample in range(nx * SAMPLES):
                    inside ^= flips[row, sample]
                    samples[sample // SAMPLES * ny + y] += inside
        for k in range(nx * ny):
            if samples[k]:
                cell[0, end], cell[1, end], cell[2, end] = x0 + k // ny, y0 + k % ny, samples[k]
                end += 1
        ptr[b + 1] = end
