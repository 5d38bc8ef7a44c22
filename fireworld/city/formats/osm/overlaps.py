"""Buildings of an extract that cannot all stand: slivers, duplicates, one within another; and overlaps that can."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from fireworld.city.city import Array, Float64Array
from fireworld.city.formats.osm.rings import Shape
from fireworld.city.outlines import doubled_area_mm2

AREA_MIN_M2: Final = 6
WIDTH_MIN_M: Final = 0.5
"""Less than this, twice the area over the outline's length, is a sliver: it may cover no air."""
COVERED_SHARE: Final = 0.9
"""A building is within another if so much of it is."""
OVERLAP_MIN_M2: Final = 1.0
ROWS_AT_ONCE: Final = 2000


@dataclass
class Weeded:
    """The buildings that stay, and what was found of the others, by their ids as text."""

    shapes: list[Shape]
    slivers: list[str] = field(default_factory=list)
    duplicates: list[str] = field(default_factory=list)
    covered: list[str] = field(default_factory=list)
    overlapping: list[str] = field(default_factory=list)
    """Of the smaller one of each pair that overlaps, which both stay."""


def weed(shapes: Sequence[Shape]) -> Weeded:
    """Drop slivers, the later ones of equal outlines, and buildings within others; count other overlaps.

    What overlaps otherwise stays as it is: the model allows it, and nobody knows whose the place is.
    """
    found = Weeded([])
    seen: set[frozenset[tuple[int, int]]] = set()
    whole: list[Shape] = []
    for shape in shapes:
        if _is_sliver(shape):
            found.slivers.append(shape.source)
            continue
        key = frozenset(shape.outer)
        if key in seen:
            found.duplicates.append(shape.source)
            continue
        seen.add(key)
        whole.append(shape)
    if not whole:
        return found
    polygons, areas = polygons_of(whole)
    one, other, share = _overlaps(polygons, areas)
    dropped = np.zeros(len(whole), dtype=np.bool_)
    dropped[one[share >= COVERED_SHARE]] = True
    found.covered += [whole[k].source for k in np.flatnonzero(dropped).tolist()]
    partial = (share < COVERED_SHARE) & ~dropped[one] & ~dropped[other]
    found.overlapping += [whole[k].source for k in one[partial].tolist()]
    found.shapes = [shape for shape, gone in zip(whole, dropped.tolist(), strict=True) if not gone]
    return found


def polygons_of(shapes: Sequence[Shape]) -> tuple[Any, Float64Array]:
    """Return the buildings as (n,) shapely polygons, those that cross themselves made valid, and their areas in mm2."""
    import shapely

    sizes = [len(shape.outer) for shape in shapes]
    corners = np.array([corner for shape in shapes for corner in shape.outer], dtype=np.float64)
    rings: Any = shapely.linearrings(corners, indices=np.repeat(np.arange(len(shapes)), sizes))
    made: Any = shapely.polygons(rings)
    for k, shape in enumerate(shapes):
        if shape.holes:
            made[k] = shapely.Polygon(shape.outer, shape.holes)
    invalid = ~shapely.is_valid(made)
    made[invalid] = shapely.make_valid(made[invalid])
    return made, shapely.area(made)


def _is_sliver(shape: Shape) -> bool:
    """Return whether a building is too small or too thin to burn."""
    if len(set(shape.outer)) < 3:
        return True
    area = (abs(doubled_area_mm2(shape.outer)) - sum(abs(doubled_area_mm2(hole)) for hole in shape.holes)) / 2
    ends = [*shape.outer[1:], shape.outer[0]]
    walls = np.array(ends, dtype=np.float64) - np.array(shape.outer, dtype=np.float64)
    length = float(np.sqrt((walls * walls).sum(axis=1)).sum())
    return area < 1e6 * AREA_MIN_M2 or 2 * area < 1000 * WIDTH_MIN_M * length


def _overlaps(polygons: Any, areas: Float64Array) -> tuple[Array, Array, Float64Array]:
    """List the pairs that overlap: the smaller one (of equals the later), the other, and the share of the smaller."""
    import shapely

    tree = shapely.STRtree(polygons)
    found: list[tuple[Array, Array, Array]] = []
    for begin in range(0, len(polygons), ROWS_AT_ONCE):
        first, second = tree.query(polygons[begin : begin + ROWS_AT_ONCE], predicate="intersects")
        first = first + begin
        pairs = first < second
        first, second = first[pairs], second[pairs]
        order = np.lexsort((second, first))
        first, second = first[order], second[order]
        common = shapely.area(shapely.intersection(polygons[first], polygons[second]))
        there = common >= 1e6 * OVERLAP_MIN_M2
        found.append((first[there], second[there], common[there]))
    first, second, common = (np.concatenate(column) for column in zip(*found, strict=True))
    smaller = np.where(areas[first] < areas[second], first, second)
    share: Float64Array = common / np.maximum(areas[smaller], 1.0)
    return smaller, first + second - smaller, share
