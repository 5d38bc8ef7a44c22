"""Small official maps, written by the project's own writers or by hand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

Point = tuple[float, float]

HEAD = (
    '<rcr:map xmlns:rcr="urn:roborescue:map:gml" xmlns:gml="http://www.opengis.net/gml"'
    ' xmlns:xlink="http://www.w3.org/1999/xlink">'
)
SCENARIO_HEAD = '<s:scenario xmlns:s="urn:roborescue:map:scenario">'


class HandMap:
    """A map of areas drawn one by one; edges are shared where areas have the same corners."""

    def __init__(self) -> None:
        self.nodes: dict[Point, int] = {}
        self.edges: dict[tuple[int, int], int] = {}
        self.areas: dict[str, list[str]] = {"building": [], "road": []}

    def area(
        self,
        kind: str,
        area_id: int,
        corners: Sequence[Point],
        *,
        neighbours: Mapping[int, int] | None = None,
        face: str = "",
    ) -> None:
        """Draw a building or a road; neighbours by the position of the corner where their edge starts."""
        items = []
        for at, corner in enumerate(corners):
            start, end = (self._node(one) for one in (corner, corners[(at + 1) % len(corners)]))
            backwards = (end, start) in self.edges
            pair = (end, start) if backwards else (start, end)
            edge = self.edges.setdefault(pair, 10_000 + len(self.edges))
            named = "" if at not in (neighbours or {}) else f' rcr:neighbour="{(neighbours or {})[at]}"'
            sign = "-" if backwards else "+"
            items.append(f'<gml:directedEdge orientation="{sign}" xlink:href="#{edge}"{named}/>')
        self.areas[kind].append(
            f'<rcr:{kind} gml:id="{area_id}"><gml:Face{face}>{"".join(items)}</gml:Face></rcr:{kind}>'
        )

    def _node(self, point: Point) -> int:
        return self.nodes.setdefault(point, 1000 + len(self.nodes))

    def text(self) -> str:
        """Return the map as GML."""
        nodes = "".join(
            f'<gml:Node gml:id="{number}"><gml:pointProperty><gml:Point><gml:coordinates>{x:.3f},{y:.3f}'
            "</gml:coordinates></gml:Point></gml:pointProperty></gml:Node>\n"
            for (x, y), number in self.nodes.items()
        )
        edges = "".join(
            f'<gml:Edge gml:id="{number}"><gml:directedNode orientation="-" xlink:href="#{start}"/>'
            f'<gml:directedNode orientation="+" xlink:href="#{end}"/></gml:Edge>\n'
            for (start, end), number in self.edges.items()
        )
        lists = "".join(
            f"<rcr:{kind}list>\n" + "\n".join(areas) + f"\n</rcr:{kind}list>\n" for kind, areas in self.areas.items()
        )
        parts = f"<rcr:nodelist>\n{nodes}</rcr:nodelist>\n<rcr:edgelist>\n{edges}</rcr:edgelist>\n{lists}"
        return f"{HEAD}\n{parts}</rcr:map>\n"


def rectangle(west: float, south: float, wide: float, high: float) -> list[Point]:
    """Return the corners of a rectangle, counterclockwise from the south-west."""
    return [(west, south), (west + wide, south), (west + wide, south + high), (west, south + high)]


def street_of_three(*, named: bool = True) -> HandMap:
    """Draw a road of two pieces from west to east, 1 and 2, with buildings 11 and 12 to the north and 13 apart."""
    drawn = HandMap()
    drawn.area("building", 11, rectangle(2, 6, 10, 12), neighbours={0: 1} if named else None)
    drawn.area(
        "building",
        12,
        rectangle(30, 6, 12, 9),
        neighbours={0: 2} if named else None,
        face=' rcr:floors="5" rcr:buildingcode="7"',
    )
    drawn.area("building", 13, rectangle(60, 30, 8, 8))
    west = [(0, 0), (20, 0), (20, 6), (12, 6), (2, 6), (0, 6)]
    east = [(20, 0), (50, 0), (50, 6), (42, 6), (30, 6), (20, 6)]
    drawn.area("road", 1, west, neighbours={1: 2, 3: 11} if named else None)
    drawn.area("road", 2, east, neighbours={3: 12, 5: 1} if named else None)
    return drawn


def scenario_text(**places: Sequence[int]) -> str:
    """Return a scenario.xml with elements of these kinds at these places."""
    items = [f'<s:{kind} s:location="{place}"/>' for kind, ids in places.items() for place in ids]
    return SCENARIO_HEAD + "".join(items) + "</s:scenario>"


def write_map(folder: Path, gml: str, *, scenario: str | None = None, **config: str) -> Path:
    """Write the folder of a map; configuration files by name."""
    folder.mkdir(exist_ok=True)
    (folder / "map.gml").write_text(gml, encoding="utf-8")
    if scenario is not None:
        (folder / "scenario.xml").write_text(scenario, encoding="utf-8")
    for name, text in config.items():
        (folder / f"{name}.cfg").write_text(text, encoding="utf-8")
    return folder
