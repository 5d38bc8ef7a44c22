"""map.gml as it is written: nodes, edges, buildings and roads, with every reference checked.

Nothing is converted here. Lengths are what the file says, metres if it is a map for the official program.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterable
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from fireworld.city.formats.json_plan import BUILDINGS_MAX, COORDINATE_MAX_MM, FLOORS_MAX, ID_MAX
from fireworld.city.formats.official.xml_stream import Attributes, XmlStream
from fireworld.errors import CityError, expected

MAP: Final = "urn:roborescue:map:gml"
GML: Final = "http://www.opengis.net/gml"
XLINK: Final = "http://www.w3.org/1999/xlink"
ROOT: Final = f"{MAP} map"
FIREWORLD: Final = "urn:fireworld:map"
CENTROID: Final = f"{FIREWORLD} centroid"
"""Of a road, in mm, where no corners make it: written by `fireworld city export`, nobody else reads it."""
GML_ID: Final = f"{GML} id"
HREF: Final = f"{XLINK} href"
UNKNOWN_SHOWN_MAX: Final = 5
NOBODY: Final = -1

Point = tuple[float, float]


class DirectedEdge(NamedTuple):
    """An edge of an outline as one walks around it."""

    edge: int
    forward: bool  # as the edge is stored
    neighbour: int  # id of the area on the other side that can be walked into, NOBODY where there is none


@dataclass
class Area:
    """A building or a road as the file has it."""

    area_id: int
    floors: int = 1
    code: int = 0
    edges: list[DirectedEdge] = field(default_factory=list)
    centroid_mm: tuple[int, int] | None = None


@dataclass
class GmlMap:
    """All of a map.gml, in the order of the file."""

    where: str
    node: dict[int, Point] = field(default_factory=dict)
    edge: dict[int, tuple[int, int]] = field(default_factory=dict)  # from node, to node
    buildings: list[Area] = field(default_factory=list)
    roads: list[Area] = field(default_factory=list)
    n_spaces: int = 0

    def corners(self, area: Area) -> list[Point]:
        """Return the corners of an area: where its directed edges start."""
        return [self.node[self.edge[edge][0 if forward else 1]] for edge, forward, _ in area.edges]


def read_gml(content: bytes, *, where: str) -> GmlMap:
    """Read the content of a map.gml, packed by gzip or not.

    Raises:
        CityError: which begins with `where`: no XML, another schema, an id used twice, a reference to nothing.
    """
    reader = _Reader(where)
    reader.stream.read(content, root=ROOT, what="a map of the official program", started=reader.start, ended=reader.end)
    found = reader.found
    if not found.buildings:
        raise CityError(expected(where, "buildinglist", "at least one building", "none"))
    _check_references(found)
    return found


class _Reader:
    """Reads the elements of one map, one after another."""

    def __init__(self, where: str) -> None:
        self.stream = XmlStream(where)
        self.found = GmlMap(where)
        self._areas: set[int] = set()
        self._current = 0
        self._ends: dict[str, int] = {}
        self._area: Area | None = None
        self._starts = {
            f"{GML} Node": self._node,
            f"{GML} coordinates": self._coordinates,
            f"{GML} Edge": self._edge,
            f"{GML} directedNode": self._directed_node,
            f"{GML} Face": self._face,
            f"{GML} directedEdge": self._directed_edge,
            f"{MAP} building": self._building,
            f"{MAP} road": self._road,
            f"{MAP} space": self._space,
        }
        self._finishes = {
            f"{GML} coordinates": self._coordinates_end,
            f"{GML} Edge": self._edge_end,
            f"{MAP} building": self._area_end,
            f"{MAP} road": self._area_end,
            f"{MAP} space": self._area_end,
        }

    def start(self, name: str, attributes: Attributes) -> None:
        """Take the start of an element."""
        handle = self._starts.get(name)
        if handle is not None:
            handle(attributes)

    def end(self, name: str) -> None:
        """Take the end of an element."""
        handle = self._finishes.get(name)
        if handle is not None:
            handle()

    def _id(self, what: str, attributes: Attributes, taken: Container[int]) -> int:
        number = self.stream.whole(what, "gml:id", attributes.get(GML_ID), high=ID_MAX)
        if number in taken:
            self.stream.refuse(f"{what}: gml:id", "an identifier of its own", number)
        return number

    def _area_id(self, what: str, attributes: Attributes) -> int:
        number = self._id(what, attributes, self._areas)
        self._areas.add(number)
        return number

    def _reference(self, what: str, attributes: Attributes) -> int:
        text = attributes.get(HREF)
        if text is None or not text.startswith("#"):
            self.stream.refuse(f"{what}: xlink:href", "# and an identifier", "no value" if text is None else text)
        return self.stream.whole(what, "xlink:href", text[1:], high=ID_MAX)

    def _sign(self, what: str, attributes: Attributes) -> str:
        sign = attributes.get("orientation", "+")
        if sign not in {"+", "-"}:
            self.stream.refuse(f"{what}: orientation", "+ or -", sign)
        return sign

    def _node(self, attributes: Attributes) -> None:
        self._current = self._id("Node", attributes, self.found.node)

    def _coordinates(self, attributes: Attributes) -> None:
        del attributes
        self.stream.collect_text()

    def _coordinates_end(self) -> None:
        text = self.stream.text()
        try:
            x, y = (float(part) for part in text.split(","))
        except ValueError:
            self.stream.refuse(f"node {self._current}: coordinates", "x,y", text.strip() or "nothing")
        if not (math.isfinite(x) and math.isfinite(y)):
            self.stream.refuse(f"node {self._current}: coordinates", "finite numbers", text.strip())
        self.found.node[self._current] = (x, y)

    def _edge(self, attributes: Attributes) -> None:
        self._current = self._id("Edge", attributes, self.found.edge)
        self._ends = {}

    def _directed_node(self, attributes: Attributes) -> None:
        what = "directedNode"
        sign = self._sign(what, attributes)
        self._ends[sign] = self._reference(what, attributes)

    def _edge_end(self) -> None:
        if self._ends.keys() != {"+", "-"}:
            got = f"orientations {', '.join(sorted(self._ends)) or 'none'}"
            self.stream.refuse(f"edge {self._current}", "a directedNode - and a directedNode +", got)
        self.found.edge[self._current] = (self._ends["-"], self._ends["+"])

    def _building(self, attributes: Attributes) -> None:
        self._area = Area(self._area_id("building", attributes))
        self.found.buildings.append(self._area)
        if len(self.found.buildings) > BUILDINGS_MAX:
            self.stream.refuse("buildinglist", f"at most {BUILDINGS_MAX} buildings", "more of them")
        self._face(attributes)

    def _road(self, attributes: Attributes) -> None:
        self._area = Area(self._area_id("road", attributes))
        if CENTROID in attributes:
            x, _, y = attributes[CENTROID].partition(" ")
            what = f"road {self._area.area_id}"
            self._area.centroid_mm = (
                self.stream.whole(what, "centroid", x, high=COORDINATE_MAX_MM),
                self.stream.whole(what, "centroid", y, high=COORDINATE_MAX_MM),
            )
        self.found.roads.append(self._area)

    def _space(self, attributes: Attributes) -> None:
        self._area = Area(self._area_id("space", attributes))
        self.found.n_spaces += 1

    def _area_end(self) -> None:
        self._area = None

    def _face(self, attributes: Attributes) -> None:
        area = self._area
        if area is None:
            return
        floors, code = attributes.get(f"{MAP} floors"), attributes.get(f"{MAP} buildingcode")
        if floors is not None:
            area.floors = self.stream.whole(f"building {area.area_id}", "floors", floors, low=1, high=FLOORS_MAX)
        if code is not None:
            area.code = self.stream.whole(f"building {area.area_id}", "buildingcode", code, high=ID_MAX)

    def _directed_edge(self, attributes: Attributes) -> None:
        area = self._area
        if area is None:
            return
        what = "directedEdge"
        forward = self._sign(what, attributes) == "+"
        text = attributes.get(f"{MAP} neighbour")
        other = NOBODY if text is None else self.stream.whole(what, "neighbour", text, high=ID_MAX)
        area.edges.append(DirectedEdge(self._reference(what, attributes), forward, other))


def _check_references(found: GmlMap) -> None:
    """Raise CityError for edges between nodes, outlines of edges, and neighbours, that are not there."""
    areas = {area.area_id for area in (*found.buildings, *found.roads)}
    for edge, ends in found.edge.items():
        _check_known(found, f"edge {edge}", "nodes", ends, found.node)
    for kind, listed in (("building", found.buildings), ("road", found.roads)):
        for area in listed:
            what = f"{kind} {area.area_id}"
            _check_known(found, what, "edges", (one.edge for one in area.edges), found.edge)
            others = (one.neighbour for one in area.edges if one.neighbour != NOBODY)
            _check_known(found, what, "neighbours", others, areas)
            if not area.edges:
                raise CityError(expected(found.where, what, "an outline of edges", "none"))


def _check_known(found: GmlMap, what: str, kind: str, ids: Iterable[int], known: Container[int]) -> None:
    unknown = [one for one in ids if one not in known]
    if unknown:
        shown = ", ".join(str(one) for one in unknown[:UNKNOWN_SHOWN_MAX])
        raise CityError(expected(found.where, what, f"{kind} that are in the file", f"unknown ids: {shown}"))
