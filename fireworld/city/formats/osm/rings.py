"""Rings of building ways and multipolygon relations: joined, closed, outer ones with the holes in them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from fireworld.city.formats.osm.projection import Place, Projection, projected
from fireworld.city.formats.osm.reader import OsmRelation, OsmWay
from fireworld.city.outlines import Corner, doubled_area_mm2

Ring = list[Corner]
HOLE_MIN_M2: Final = 4
"""Smaller holes, as of light shafts, are filled."""
N_HOLES_MAX: Final = 100
"""Of one building; the smallest of more are filled, too."""
POINTS_TRIED: Final = 31


@dataclass
class Shape:
    """A building as drawn: one outer ring, and its courtyards."""

    osm_type: str
    """"way" or "relation"."""
    osm_id: int
    tags: Mapping[str, str]
    outer: Ring
    holes: list[Ring] = field(default_factory=list)
    part: int = 0
    """Which of the outer rings of a relation it is."""

    @property
    def source(self) -> str:
        """The id as text: w123, r45, and r45.2 for the second outer ring of a relation."""
        return f"{self.osm_type[0]}{self.osm_id}" + (f".{self.part + 1}" if self.part else "")

    @property
    def order(self) -> tuple[int, int, int]:
        """The place among all buildings: ways first, by id."""
        return int(self.osm_type == "relation"), self.osm_id, self.part

    @property
    def draw_key(self) -> int:
        """What its draws are keyed by: all of its id, and the type."""
        return 2 * self.osm_id + int(self.osm_type == "relation")


@dataclass
class Losses:
    """Ids of what made no building, and of what lost something, as text."""

    incomplete: list[str] = field(default_factory=list)
    open: list[str] = field(default_factory=list)
    filled_holes: int = 0
    lost_holes: list[str] = field(default_factory=list)


def way_shapes(ways: Iterable[OsmWay], projection: Projection, losses: Losses) -> list[Shape]:
    """Return the buildings that ways draw; none for those that are not closed or lost nodes."""
    whole: list[OsmWay] = []
    for way in ways:
        if None in way.places:
            losses.incomplete.append(f"w{way.osm_id}")
        elif len(way.nodes) < 4 or way.nodes[0] != way.nodes[-1]:
            losses.open.append(f"w{way.osm_id}")
        else:
            whole.append(way)
    rows = projected(projection, ([place for place in way.places if place is not None] for way in whole))
    return [Shape("way", way.osm_id, way.tags, _ring(row)) for way, row in zip(whole, rows, strict=True)]


def relation_shapes(
    relation: OsmRelation, members: Mapping[int, OsmWay], projection: Projection, losses: Losses
) -> tuple[list[Shape], set[int]]:
    """Return the buildings that a relation draws, one for each outer ring, and the ways that the outer rings are of."""
    name = f"r{relation.osm_id}"
    outer, n_open, lost, ways = _join(relation, members, ("outer", ""))
    inner, n_open_inner, lost_inner, _ = _join(relation, members, ("inner",))
    shapes = [
        Shape("relation", relation.osm_id, relation.tags, _ring(row), part=k)
        for k, row in enumerate(projected(projection, outer))
    ]
    if n_open or lost or not shapes:
        (losses.incomplete if lost else losses.open).append(name)
    if not shapes:
        return [], set()
    if n_open_inner or lost_inner:
        losses.lost_holes.append(name)
    for row in projected(projection, inner):
        hole = _ring(row)
        if len(hole) < 3 or abs(doubled_area_mm2(hole)) < 2_000_000 * HOLE_MIN_M2:
            losses.filled_holes += 1
            continue
        around = [shape for shape in shapes if holds_most(shape.outer, hole)]
        if around:
            min(around, key=lambda shape: abs(doubled_area_mm2(shape.outer))).holes.append(hole)
        else:
            losses.lost_holes.append(name)
    for shape in shapes:
        largest = sorted(shape.holes, key=lambda hole: -abs(doubled_area_mm2(hole)))[:N_HOLES_MAX]
        losses.filled_holes += len(shape.holes) - len(largest)
        shape.holes = [hole for hole in shape.holes if hole in largest]
    return shapes, ways


def holds_most(outer: Sequence[Corner], points: Sequence[Corner]) -> bool:
    """Return whether most of some points are inside a ring by the even-odd rule; a hole may touch the outside."""
    found = [is_inside(outer, point) for point in points[:POINTS_TRIED]]
    return 2 * sum(found) > len(found)


def is_inside(ring: Sequence[Corner], point: Corner) -> bool:
    """Return whether a point is inside a ring by the even-odd rule, half-open in y; exact."""
    x, y = point
    inside = False
    for (x1, y1), (x2, y2) in zip(ring, [*ring[1:], ring[0]], strict=True):
        if (y1 > y) != (y2 > y):
            side = (x2 - x1) * (y - y1) - (x - x1) * (y2 - y1)
            inside ^= (side > 0) == (y2 > y1)
    return inside


def _ring(corners: Sequence[Corner]) -> Ring:
    """Make a ring of a closed row; corners that fall on one millimetre are one."""
    ring = [corner for k, corner in enumerate(corners) if k == 0 or corner != corners[k - 1]]
    while len(ring) > 1 and ring[-1] == ring[0]:
        ring.pop()
    return ring


def _join(
    relation: OsmRelation, members: Mapping[int, OsmWay], roles: Sequence[str]
) -> tuple[list[list[Place]], int, int, set[int]]:
    """Join the ways of some roles at their ends.

    Returns the closed rings in the order of their first ways, how many rows stay open, how many ways are not there or
    lost nodes, and the ids of the ways in closed rings.
    """
    refs = list(dict.fromkeys(ref for kind, ref, role in relation.members if kind == "w" and role in roles))
    whole = [ref for ref in refs if ref in members and len(members[ref].nodes) > 1 and None not in members[ref].places]
    rings: list[list[Place]] = []
    used: set[int] = set()
    n_open = 0
    left = dict.fromkeys(whole)
    ends: dict[int, list[int]] = {}
    for ref in whole:
        nodes = members[ref].nodes
        for node in {nodes[0], nodes[-1]}:
            ends.setdefault(node, []).append(ref)
    while left:
        first = next(iter(left))
        del left[first]
        row, refs_of_row = list(members[first].places), [first]
        start, end = members[first].nodes[0], members[first].nodes[-1]
        while start != end:
            following = next((ref for ref in ends[end] if ref in left), None)
            if following is None:
                break
            del left[following]
            way = members[following]
            forward = way.nodes[0] == end
            row += way.places[1:] if forward else way.places[-2::-1]
            end = way.nodes[-1] if forward else way.nodes[0]
            refs_of_row.append(following)
        if start != end or len(row) < 4:
            n_open += 1
            continue
        rings.append([place for place in row if place is not None])
        used.update(refs_of_row)
    return rings, n_open, len(refs) - len(whole), used
