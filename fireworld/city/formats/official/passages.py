"""Which areas of a map one can walk from one into another, and where."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from fireworld.city.formats.official.gml import NOBODY, Area
from fireworld.city.formats.official.report import Report
from fireworld.city.outlines import Corner

Edge = tuple[Corner, Corner]
"""The two ends, the lesser first."""


class Passage(NamedTuple):
    """A way from one area into another, over an edge of their outlines, or over a point that both have."""

    areas: tuple[int, int]
    edge: Edge


@dataclass(frozen=True)
class Outlined:
    """The areas of a map with their corners in whole millimetres: roads first, each in the order of the plan."""

    areas: Sequence[Area]
    corners: Mapping[int, Sequence[Corner]]
    ends: Mapping[int, Sequence[Corner]]
    """Where each directed edge of an area ends: the next corner, unless the edges do not join."""
    n_roads: int

    @property
    def roads(self) -> set[int]:
        """Ids of the roads."""
        return {area.area_id for area in self.areas[: self.n_roads]}

    def edges(self, area: Area) -> Iterator[tuple[Edge, int]]:
        """Yield each edge of an outline with the neighbour that it names."""
        starts, ends = self.corners[area.area_id], self.ends[area.area_id]
        for one, start, end in zip(area.edges, starts, ends, strict=True):
            yield (min(start, end), max(start, end)), one.neighbour


def find_passages(outlined: Outlined, report: Report) -> list[Passage]:
    """Return the passages of a map, in the order of their areas.

    A map that names neighbours has those; whether one area names the other, or both do, is all the same. In a map that
    names none, areas that share an edge are neighbours, and those left without a road that touch one at a corner.
    """
    place = {area.area_id: at for at, area in enumerate(outlined.areas)}
    named = _named(outlined, place, report)
    found = named or _shared(outlined, place, report)
    return sorted(found, key=lambda one: (place[one.areas[0]], place[one.areas[1]], one.edge))


def _pair(one: int, other: int, place: Mapping[int, int]) -> tuple[int, int]:
    return (one, other) if place[one] < place[other] else (other, one)


def _named(outlined: Outlined, place: Mapping[int, int], report: Report) -> set[Passage]:
    """Return the passages that the areas name."""
    found: set[Passage] = set()
    says: set[tuple[int, int]] = set()
    for area in outlined.areas:
        for edge, other in outlined.edges(area):
            if other not in {NOBODY, area.area_id}:
                found.add(Passage(_pair(area.area_id, other, place), edge))
                says.add((area.area_id, other))
    once = [one for one in sorted(says, key=lambda two: (place[two[0]], place[two[1]])) if one[::-1] not in says]
    areas = dict.fromkeys(one for one, _ in once)
    if areas:
        report.note("one-direction", f"{len(once)} neighbours named in one direction only, taken for both", areas)
    return found


def _shared(outlined: Outlined, place: Mapping[int, int], report: Report) -> set[Passage]:
    """Infer passages: edges that two areas share, then corners, for areas that nothing joins to a road."""
    roads = outlined.roads
    by_edge: dict[Edge, list[int]] = defaultdict(list)
    by_corner: dict[Corner, list[int]] = defaultdict(list)
    for area in outlined.areas:
        for edge, _ in outlined.edges(area):
            if edge[0] != edge[1]:
                _append(by_edge[edge], area.area_id)
        for corner in outlined.corners[area.area_id]:
            _append(by_corner[corner], area.area_id)
    found = {Passage(pair, edge) for edge, areas in by_edge.items() for pair in _pairs(areas, place)}
    n_edges = len(found)
    joined = {one for passage in found for one, other in (passage.areas, passage.areas[::-1]) if other in roads}
    for corner, areas in by_corner.items():
        for one, other in _pairs(areas, place):
            if one in roads and not {one, other} <= joined:
                found.add(Passage((one, other), (corner, corner)))
    text = f"no neighbours in the map: {n_edges} inferred from shared edges, {len(found) - n_edges} from shared corners"
    report.note("neighbours-inferred", text)
    return found


def _append(listed: list[int], area_id: int) -> None:
    if area_id not in listed:
        listed.append(area_id)


def _pairs(areas: Sequence[int], place: Mapping[int, int]) -> Iterator[tuple[int, int]]:
    for at, one in enumerate(areas):
        for other in areas[:at]:
            yield _pair(one, other, place)
