"""Area and centroid of an outline, with the official reader's arithmetic."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from fireworld.city.outlines import Corner

Exact = tuple[float, float]


def centroid_and_area(exact: Sequence[Exact]) -> tuple[Exact, float]:
    """Return centroid in mm and area in m2 of corners in mm: the shoelace sums, in the order of the corners.

    An outline without area has the mean of its corners: a road may be a line.
    """
    doubled = x_sum = y_sum = 0.0
    for (x, y), (next_x, next_y) in pairwise([*exact, exact[0]]):
        cross = x * next_y - next_x * y
        doubled += cross
        x_sum += (x + next_x) * cross
        y_sum += (y + next_y) * cross
    enclosed = doubled / 2.0
    if enclosed:
        return (x_sum / (6.0 * enclosed), y_sum / (6.0 * enclosed)), abs(enclosed * 1e-6)
    return (sum(x for x, _ in exact) / len(exact), sum(y for _, y in exact) / len(exact)), 0.0


def exact_measures(exact: Sequence[Exact]) -> tuple[Corner, int]:
    """Return the same as the official program keeps it: cut to whole numbers."""
    (x, y), area = centroid_and_area(exact)
    return (int(x), int(y)), int(area)
