"""Corners of which the official reader makes given whole millimetres, a given centroid and a given area.

It computes centroid and area before it cuts the corners to whole millimetres. So what a plan holds does not follow from
its corners alone, and whoever writes a map has to find what was cut off.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product
from typing import Final

from fireworld.city.formats.official.measuring import centroid_and_area, exact_measures
from fireworld.city.outlines import Corner

SHIFTS: Final = (0.001, 0.25, 0.5, 0.75, 0.999)
"""What may be added to whole millimetres: the reader cuts it off again."""
ROUNDS_MAX: Final = 30
AREA_MARGIN_M2: Final = 1e-6
"""How far an area is kept from the next whole number: more than rounding makes of it."""

Exact = tuple[float, float]


def as_text(mm: float) -> str:
    """Return a length as a map has it: metres, to a millionth."""
    return f"{mm / 1000.0:.6f}"


def as_read(mm: float) -> float:
    """Return what the reader makes of a length's text, in mm."""
    return float(as_text(mm)) * 1000.0


def placed(corners: Sequence[Corner], centroid: Corner, area_m2: int | None) -> list[Exact]:
    """Return corners in mm, each less than 1 mm more than its own, of which the reader makes this centroid and area.

    First all are moved alike, which is enough for nearly all; then one after another. Where nothing does, they come as
    near as they can. `area_m2`: None for any.
    """
    for shift_x, shift_y in product(SHIFTS, SHIFTS):
        moved = [(as_read(x + shift_x), as_read(y + shift_y)) for x, y in corners]
        if _fits(moved, centroid, area_m2):
            return moved
    return _descended(corners, centroid, area_m2)


def _fits(exact: Sequence[Exact], centroid: Corner, area_m2: int | None) -> bool:
    found, area = exact_measures(exact)
    return found == centroid and area_m2 in {None, area}


def _descended(corners: Sequence[Corner], centroid: Corner, area_m2: int | None) -> list[Exact]:
    """Move single corners as long as that brings centroid and area nearer."""
    best = [(as_read(x + 0.5), as_read(y + 0.5)) for x, y in corners]
    missing = _missing(best, centroid, area_m2)
    for _ in range(ROUNDS_MAX):
        if missing == 0.0 and _fits(best, centroid, area_m2):
            break
        options = [(_missing(tried, centroid, area_m2), tried) for tried in _moved(best, corners)]
        nearest, tried = min(options, key=lambda option: option[0])
        if nearest >= missing:
            break
        missing, best = nearest, tried
    return best


def _moved(exact: list[Exact], corners: Sequence[Corner]) -> Iterator[list[Exact]]:
    """Yield the corners with one of them at another place."""
    for at, (x, y) in enumerate(corners):
        for shift_x, shift_y in product(SHIFTS, SHIFTS):
            yield [*exact[:at], (as_read(x + shift_x), as_read(y + shift_y)), *exact[at + 1 :]]


def _missing(exact: Sequence[Exact], centroid: Corner, area_m2: int | None) -> float:
    """Return how far centroid, in mm, and area, in 100 cm2, are from what is cut to the right numbers."""
    (x, y), area = centroid_and_area(exact)
    missing = _beyond(x, centroid[0], SHIFTS[0]) + _beyond(y, centroid[1], SHIFTS[0])
    return missing if area_m2 is None else missing + 100.0 * _beyond(area, area_m2, AREA_MARGIN_M2)


def _beyond(value: float, whole: int, margin: float) -> float:
    """Return how far a number is outside what is cut to a whole one, from a bit above it to a bit below the next."""
    return max(0.0, whole + margin - value, value - whole - 1 + margin)
