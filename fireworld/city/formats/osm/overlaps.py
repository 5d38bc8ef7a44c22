"""Buildings of an extract that cannot all stand: slivers, duplicates, one within another; and overlaps that can."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from fireworld.city.city import Array, Float64Array
from fireworld.city.formats.osm.rings import Shape
from fireworld.city.outlines import doubled_area_mm2
from fireworld.errors import CityError, expected

AREA_MIN_M2: Final = 6
WIDTH_MIN_M: Final = 0.5
"""Less than this, twice the area over the outline's length, is a sliver: it may cover no air."""
COVERED_SHARE: Final = 0.9
"""A building is within another if so much of it is."""
OVERLAP_MIN_M2: Final = 1.0
PAIRS_AT_ONCE: Final = 4_000_000
"""Pairs of buildings that are looked at together, at most."""
CORNERS_FREE: Final = 1_000_000
CORNERS_PER_BUILDING: Final = 300
"""Pairs whose bounding boxes overlap have at most as many corners as these make together; in the middle of Helsinki 44
for each building. More is not a city, and takes minutes."""


@dataclass
class Weeded:
    """The buildings that stay, and what was found of the others, by their ids as text."""

    shapes: list[Shape]
    slivers: list[str] = field(default_factory=list)
    duplicates: list[str] = field(default_factory=list)
    covered: list[str] = field(default_factory=list)
    overlapping: list[str] = field(default_factory=list)
    """Of the smaller one of each pair that overlaps, which both stay."""


def weed(shapes: Sequence[Shape], *, where: str = "extract") -> Weeded:
    """Drop slivers, the later ones of equal outlines, and buildings within others; count other overlaps.

    What overlaps otherwise stays as it is: the model allows it, and nobody knows whose the place is. CityError, which
    begins with `where`, if so many lie on one spot that they are no city.
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
    first, second = _near_pairs(polygons, [shape.source for shape in whole], where=where)
    one, other, share = _overlaps(polygons, areas, first, second)
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


def _near_pairs(polygons: Any, sources: Sequence[str], *, where: str) -> tuple[Array, Array]:
    """List the pairs whose bounding boxes overlap, the first one lower, by rising numbers; errors as for `weed`."""
    import shapely

    tree, n_corners, n = shapely.STRtree(polygons), shapely.get_num_coordinates(polygons), len(polygons)
    most, total = CORNERS_FREE + CORNERS_PER_BUILDING * n, 0
    found: list[tuple[Array, Array]] = []
    at_once = max(1, PAIRS_AT_ONCE // n)
    for begin in range(0, n, at_once):
        first, second = tree.query(polygons[begin : begin + at_once])
        first = first + begin
        pairs = first < second
        first, second = first[pairs], second[pairs]
        total += int(n_corners[first].sum() + n_corners[second].sum())
        if total > most:
            lowest, n_others = np.unique(first, return_counts=True)
            worst = int(np.argmax(n_others))
            got = f"more: {sources[lowest[worst]]} alone lies on {n_others[worst]} others"
            raise CityError(expected(where, "buildings", f"at most {most} corners in pairs that overlap", got))
        order = np.lexsort((second, first))
        found.append((first[order], second[order]))
    one, other = (np.concatenate(column) for column in zip(*found, strict=True))
    return one, other


def _overlaps(polygons: Any, areas: Float64Array, first: Array, second: Array) -> tuple[Array, Array, Float64Array]:
    """List which of some pairs overlap: the smaller one (of equals the later), the other, the share of the smaller."""
    import shapely

    touching = shapely.intersects(polygons[first], polygons[second])
    first, second = first[touching], second[touching]
    common = shapely.area(shapely.intersection(polygons[first], polygons[second]))
    there = common >= 1e6 * OVERLAP_MIN_M2
    first, second, common = first[there], second[there], common[there]
    smaller = np.where(areas[first] < areas[second], first, second)
    share: Float64Array = common / np.maximum(areas[smaller], 1.0)
    return smaller, first + second - smaller, share
