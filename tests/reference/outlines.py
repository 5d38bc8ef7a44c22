"""What follows from an outline in plain Python and numpy, wall by wall and point by point; MODEL section 1.

Outlines are lists of corners (x, y) in whole millimetres, just as they are listed in a city file.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

Corner = tuple[int, int]
Outline = Sequence[Corner]


def walls(outline: Outline) -> list[tuple[Corner, Corner]]:
    """List the walls, the closing one last: it is there even if it has no length."""
    listed = [(start, end) for start, end in pairwise(outline) if start != end]
    return [*listed, (outline[-1], outline[0])]


def wall_area_m2(outline: Outline) -> float:
    """Return the radiating wall: 3 m high, without the closing wall."""
    total = 0.0
    for start, end in walls(outline)[:-1]:
        total += 3 * 1000 * _length_mm(start, end)
    return total / 1e6


def n_rays(outline: Outline, rays_per_mm: float) -> list[int]:
    """Return how many rays each wall sends; the rate is rounded to single precision."""
    return [math.ceil(_length_mm(*wall) * float(np.float32(rays_per_mm))) for wall in walls(outline)]


def holds(outline: Outline, x: float, y: float) -> bool:
    """Return whether a point lies inside: an odd number of walls is to its right.

    Half-open in y. The product of the two last lines is rounded twice, as in the official program.
    """
    n_right = 0
    for start, end in zip(outline, [*outline[1:], outline[0]], strict=True):
        (x1, y1), (x2, y2) = (start, end) if start[1] < end[1] else (end, start)
        if not y1 <= y < y2 or x >= max(x1, x2):
            continue
        slope = (y - y1) / (y2 - y1)
        n_right += x < min(x1, x2) or x - x1 < slope * (x2 - x1)
    return n_right % 2 == 1


def covers(outline: Outline, origin_mm: Corner, cell_mm: int) -> dict[Corner, int]:
    """Count the sample points inside, for every cell that has one."""
    low, high = np.min(outline, axis=0), np.max(outline, axis=0)
    first, last = ((corner - origin_mm) // cell_mm for corner in (low, high))
    counts = {}
    for x in range(int(first[0]), int(last[0]) + 1):
        for y in range(int(first[1]), int(last[1]) + 1):
            corner = origin_mm[0] + x * cell_mm, origin_mm[1] + y * cell_mm
            inside = sum(holds(outline, *point) for point in _samples(corner, cell_mm))
            if inside:
                counts[x, y] = inside
    return counts


def _samples(corner: Corner, cell_mm: int) -> Iterator[tuple[float, float]]:
    """Yield the 10 by 10 sample points of a cell; its corner and a tenth of its side are single precision."""
    step = float(np.float32(cell_mm) / np.float32(10))
    x, y = (float(np.float32(place)) for place in corner)
    for i in range(10):
        for j in range(10):
            yield step * i + x, step * j + y


def _length_mm(start: Corner, end: Corner) -> float:
    return math.sqrt(float((end[0] - start[0]) ** 2 + (end[1] - start[1]) ** 2))
