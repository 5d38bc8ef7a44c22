"""A plan as map.gml, with coordinates from which the official reader makes the same whole millimetres again."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from fireworld.city.city import Plan, RoadMap
from fireworld.city.formats.official.corners import as_text, placed
from fireworld.city.formats.official.measuring import exact_measures
from fireworld.city.outlines import Corner
from fireworld.errors import CityError, expected

HEAD: Final = """<?xml version="1.0" encoding="UTF-8"?>

<rcr:map xmlns:rcr="urn:roborescue:map:gml" xmlns:gml="http://www.opengis.net/gml" xmlns:xlink="http://www.w3.org/1999/xlink" xmlns:fireworld="urn:fireworld:map">
"""  # noqa: E501
Point = tuple[str, str]


@dataclass
class _Area:
    """An area to be written: a directed edge for each corner, and the neighbour that it names."""

    area_id: int
    corners: list[Corner]
    points: list[Point]
    centroid: Corner | None
    """Of a road, where no corners make it."""
    neighbours: dict[int, int] = field(default_factory=dict)
    """By the position of the corner where the edge starts."""


class GmlWriter:
    """Lays out a map: nodes and edges are shared where areas have the same.

    Args:
        plan: the city, nothing west or south of the origin.
        roads: its roads.
    """

    def __init__(self, plan: Plan, roads: RoadMap) -> None:
        if int(plan.footprints.outline_mm.min()) < 0 or (len(roads.outline_mm) and int(roads.outline_mm.min()) < 0):
            raise CityError(expected(plan.name, "buildings", "coordinates of at least 0", "negative ones"))
        self._plan = plan
        self._used = {*plan.footprints.building_id.tolist(), *roads.road_id.tolist()}
        self._next = 0
        self._nodes: dict[Point, int] = {}
        self._edges: dict[tuple[int, int], int] = {}
        self._node((as_text(0.0), as_text(0.0)))  # the least x and y: the reader counts from them
        self._roads = self._lay_out(roads.road_id, roads.outline_ptr, roads.outline_mm, roads.centroid_mm, None)
        found = plan.footprints
        self._buildings = self._lay_out(
            found.building_id, found.outline_ptr, found.outline_mm, found.centroid_mm, found.ground_area_m2
        )
        self.lost_passages = self._name_neighbours(roads)

    def lines(self) -> Iterator[str]:
        """Yield the text of the map, piece by piece."""
        faces = {kind: "".join(self._areas(kind, areas)) for kind, areas in self._kinds()}
        yield HEAD
        yield "  <rcr:nodelist>\n"
        for (x, y), number in self._nodes.items():
            yield (
                f'    <gml:Node gml:id="{number}">\n      <gml:pointProperty>\n        <gml:Point>\n'
                f"          <gml:coordinates>{x},{y}</gml:coordinates>\n"
                "        </gml:Point>\n      </gml:pointProperty>\n    </gml:Node>\n"
            )
        yield "  </rcr:nodelist>\n  <rcr:edgelist>\n"
        for (start, end), number in self._edges.items():
            yield (
                f'    <gml:Edge gml:id="{number}">\n'
                f'      <gml:directedNode orientation="-" xlink:href="#{start}"/>\n'
                f'      <gml:directedNode orientation="+" xlink:href="#{end}"/>\n    </gml:Edge>\n'
            )
        yield "  </rcr:edgelist>\n"
        for kind, text in faces.items():
            yield f"  <rcr:{kind}list>\n{text}  </rcr:{kind}list>\n"
        yield "</rcr:map>\n"

    def _kinds(self) -> list[tuple[str, Sequence[_Area]]]:
        return [("building", self._buildings), ("road", self._roads)]

    def _number(self) -> int:
        """Return an identifier that nothing has: nodes, edges and areas are one space."""
        while self._next in self._used:
            self._next += 1
        self._used.add(self._next)
        return self._next

    def _node(self, point: Point) -> int:
        if point not in self._nodes:
            self._nodes[point] = self._number()
        return self._nodes[point]

    def _lay_out(self, ids: object, ptr: object, corners: object, centroids: object, areas: object) -> list[_Area]:
        """Find coordinates for areas: (k,) ids, (k+1,) starts, corners and centroids in mm, m2 or None for any."""
        columns = np.asarray(ids).tolist(), np.asarray(ptr).tolist(), np.asarray(centroids).tolist()
        listed = [tuple(corner) for corner in np.asarray(corners).tolist()]
        wanted = [None] * len(columns[0]) if areas is None else [int(area) for area in np.asarray(areas).tolist()]
        found = []
        for at, area_id in enumerate(columns[0]):
            outline = listed[columns[1][at] : columns[1][at + 1]]
            x, y = columns[2][at]
            points = placed(outline, (x, y), wanted[at])
            missed = areas is None and exact_measures(points)[0] != (x, y)
            written = [(as_text(east), as_text(north)) for east, north in points]
            found.append(_Area(area_id, outline, written, (x, y) if missed else None))
        return found

    def _name_neighbours(self, roads: RoadMap) -> int:
        """Let the edges of the areas name their neighbours; return how many passages no area has an edge for."""
        by_id = {area.area_id: area for area in (*self._roads, *self._buildings)}
        place: dict[int, dict[tuple[Corner, Corner], list[int]]] = {}
        for area in by_id.values():
            place[area.area_id] = defaultdict(list)
            for at, corner in enumerate(area.corners):
                after = area.corners[(at + 1) % len(area.corners)]
                place[area.area_id][min(corner, after), max(corner, after)].append(at)
        lost = 0
        for (one, other), (x, y, end_x, end_y) in zip(
            roads.passage_area.tolist(), roads.passage_mm.tolist(), strict=True
        ):
            edge = ((x, y), (end_x, end_y))
            named = False
            for area_id, neighbour in ((one, other), (other, one)):
                free = [at for at in place[area_id].get(edge, ()) if at not in by_id[area_id].neighbours]
                if free:
                    by_id[area_id].neighbours[free[0]] = neighbour
                    named = True
            if not named and edge[0] == edge[1]:
                named = _touch(by_id[one], edge[0], other)
            lost += not named
        return lost

    def _areas(self, kind: str, areas: Sequence[_Area]) -> Iterator[str]:
        floors, codes = self._plan.footprints.floors.tolist(), self._plan.footprints.material.tolist()
        for at, area in enumerate(areas):
            says = ""
            if kind == "building":
                says = f' rcr:floors="{floors[at]}" rcr:buildingcode="{codes[at]}" rcr:importance="1"'
            centroid = "" if area.centroid is None else f' fireworld:centroid="{area.centroid[0]} {area.centroid[1]}"'
            yield f'    <rcr:{kind} gml:id="{area.area_id}"{centroid}>\n      <gml:Face{says}>\n'
            for corner, point in enumerate(area.points):
                start, end = self._node(point), self._node(area.points[(corner + 1) % len(area.points)])
                sign = "-" if (end, start) in self._edges and start != end else "+"
                pair = (end, start) if sign == "-" else (start, end)
                if pair not in self._edges:
                    self._edges[pair] = self._number()
                other = area.neighbours.get(corner)
                named = "" if other is None else f' rcr:neighbour="{other}"'
                yield f'        <gml:directedEdge orientation="{sign}" xlink:href="#{self._edges[pair]}"{named}/>\n'
            yield f"      </gml:Face>\n    </rcr:{kind}>\n"


def _touch(area: _Area, corner: Corner, neighbour: int) -> bool:
    """Let an area touch another at one of its corners: an edge without length, which names it."""
    if corner not in area.corners:
        return False
    at = area.corners.index(corner)
    area.corners.insert(at, corner)
    area.points.insert(at, area.points[at])
    area.neighbours = {place + (place >= at): other for place, other in area.neighbours.items()} | {at: neighbour}
    return True
