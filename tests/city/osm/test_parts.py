"""Floors, materials, rings, streets: each rule of the import by itself, with numbers worked by hand."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fireworld.city.formats.osm import kinds, overlaps
from fireworld.city.formats.osm.area import Area
from fireworld.city.formats.osm.kinds import floors_of, material_of
from fireworld.city.formats.osm.overlaps import weed
from fireworld.city.formats.osm.projection import Projection
from fireworld.city.formats.osm.reader import OsmNode, OsmRelation, OsmWay
from fireworld.city.formats.osm.rings import Losses, Shape, relation_shapes, way_shapes
from fireworld.city.formats.osm.simplify import simplified, straightened
from fireworld.city.formats.osm.streets import street_graph, with_hydrants

EQUATOR = Projection(0, 0)
UNIT_MM = 11.1319  # a ten-millionth of a degree of longitude at the equator


@pytest.mark.parametrize(
    ("tags", "floors", "by"),
    [
        ({"building:levels": "5"}, 5, "building:levels"),
        ({"building:levels": "3.5"}, 4, "building:levels"),
        ({"building:levels": "0"}, 1, "building:levels"),
        ({"building:levels": "100000"}, 200, "building:levels"),
        ({"building:levels": "4", "height": "30"}, 4, "building:levels"),
        ({"height": "12"}, 4, "height"),
        ({"height": "12.4 m"}, 4, "height"),
        ({"height": "1"}, 1, "height"),
        ({"height": "40'"}, 2, ""),
        ({"building:levels": "2;3"}, 2, ""),
        ({"building:levels": "-1"}, 2, ""),
        ({"building:levels": "nan"}, 2, ""),
        ({"building:levels": "٣"}, 2, ""),
        ({}, 2, ""),
        ({"building": "apartments"}, 4, ""),
        ({"building": "garage"}, 1, ""),
    ],
)
def test_floors(tags, floors, by):
    assert floors_of({"building": "yes"} | tags) == (floors, by)


@pytest.mark.parametrize(
    ("said", "material"), [("wood", 0), ("Timber", 0), ("glass", 1), ("brick", 2), ("reinforced_concrete", 2)]
)
def test_materials_by_tag(said, material):
    assert material_of({"building": "house", "building:material": said}, floors=1, seed=1, key=5) == (material, True)


@pytest.mark.parametrize(
    ("kind", "floors", "shares"),
    [
        ("house", 2, (80, 5, 15)),
        ("house", 4, (80, 5, 15)),
        ("warehouse", 2, (10, 65, 25)),
        ("office", 2, (20, 30, 50)),
        ("yes", 3, (75, 20, 5)),
        ("yes", 4, (20, 30, 50)),
    ],
)
def test_materials_are_drawn_in_their_shares(kind, floors, shares):
    tags = {"building": kind, "building:material": "gingerbread"}
    drawn = [material_of(tags, floors=floors, seed=3, key=key)[0] for key in range(10_000_000_000, 10_000_020_000)]
    assert [100 * drawn.count(material) / 20_000 for material in range(3)] == pytest.approx(shares, abs=1.2)
    again = [material_of(tags, floors=floors, seed=3, key=key)[0] for key in range(10_000_000_000, 10_000_000_020)]
    assert drawn[:20] == again


def test_every_share_is_of_a_hundred():
    assert all(sum(shares) == 100 for shares in (*kinds.SHARES.values(), kinds.OTHER_SHARES))
    assert set(kinds.GROUP_OF.values()) == set(kinds.SHARES)
    assert set(kinds.GROUP_OF) <= set(kinds.FLOORS_BY_KIND)


def way(osm_id, *places, nodes=None, **tags):
    """A way along places in units; its nodes are named by their places."""
    nodes = tuple(hash(place) for place in places) if nodes is None else nodes
    return OsmWay(osm_id, {"highway": "residential"} | tags, nodes, places)


def test_a_closed_way_is_a_building_and_others_are_not():
    losses = Losses()
    square = ((0, 0), (1000, 0), (1000, 1000), (0, 0))
    ways = [way(7, *square), way(8, *square[:3]), way(9, (0, 0), None, (1000, 1000), (0, 0))]
    (shape,) = way_shapes(ways, EQUATOR, losses)
    assert shape.source == "w7"
    assert shape.outer == [(0, 0), (11132, 0), (11132, 11057)]
    assert (losses.open, losses.incomplete) == (["w8"], ["w9"])


def test_a_relation_joins_its_ways():
    a, b, c, d = (0, 0), (4000, 0), (4000, 4000), (0, 4000)
    hole = ((1000, 1000), (2000, 1000), (2000, 2000), (1000, 2000), (1000, 1000))
    speck = ((3000, 3000), (3010, 3000), (3010, 3010), (3000, 3000))
    island = ((9000, 0), (9900, 0), (9900, 900), (9000, 0))
    members = {
        1: way(1, a, b, c), 2: way(2, a, d, c), 3: way(3, *hole), 4: way(4, *speck), 5: way(5, *island),
        6: way(6, (20000, 0), (21000, 0)),
    }  # fmt: skip
    roles = [(1, "outer"), (3, "inner"), (2, "outer"), (4, "inner"), (5, ""), (6, "outer"), (77, "inner")]
    relation = OsmRelation(45, {"building": "yes"}, tuple(("w", ref, role) for ref, role in roles))
    losses = Losses()
    (large, small), outlines = relation_shapes(relation, members, EQUATOR, losses)
    assert (large.source, small.source) == ("r45", "r45.2")
    assert len(large.outer) == 4
    assert large.holes == [[(11132, 11057), (22264, 11057), (22264, 22115), (11132, 22115)]]
    assert small.holes == []
    assert outlines == {1, 2, 5}
    assert losses == Losses(open=["r45"], filled_holes=1, lost_holes=["r45"])


def test_a_relation_without_its_ways_is_none():
    losses = Losses()
    relation = OsmRelation(46, {"building": "yes"}, (("w", 1, "outer"), ("n", 5, "outer")))
    assert relation_shapes(relation, {}, EQUATOR, losses) == ([], set())
    assert losses == Losses(incomplete=["r46"])


def shape(osm_id, west, south, east, north, holes=()):
    """A rectangle in metres."""
    ring = [(1000 * x, 1000 * y) for x, y in ((west, south), (east, south), (east, north), (west, north))]
    return Shape("way", osm_id, {"building": "yes"}, ring, holes=[shape(0, *hole).outer for hole in holes])


def test_what_cannot_stand():
    block = shape(1, 0, 0, 30, 30, holes=[(10, 10, 20, 20)])
    again = Shape("way", 2, {}, block.outer[2:] + block.outer[:2])
    found = weed([
        block, again,
        shape(3, 5, 1, 9, 9),  # within
        shape(4, 12, 12, 18, 18),  # in the courtyard
        shape(5, 28, 0, 40, 10),  # 20 m2 in the block
        shape(6, 29.5, 20, 39.5, 21.5),  # 0.75 m2 in it
        shape(7, 50, 0, 52, 2),  # 4 m2
        shape(8, 60, 0, 90, 0.3),
    ])  # fmt: skip
    assert [one.source for one in found.shapes] == ["w1", "w4", "w5", "w6"]
    assert found.duplicates == ["w2"]
    assert found.covered == ["w3"]
    assert found.overlapping == ["w5"]
    assert found.slivers == ["w7", "w8"]


def test_outlines_that_cross_themselves_are_weeded_too():
    bow = Shape("way", 1, {}, [(0, 0), (20000, 20000), (20000, 0), (0, 10000)])
    found = weed([bow, shape(2, 100, 0, 120, 20)])
    assert len(found.shapes) == 2


def area(radius_m):
    r = radius_m * 1000
    return Area(EQUATOR, r, (-r, -r, r, r), (-(10**8), -(10**8), 10**8, 10**8))


@pytest.mark.parametrize(
    ("start", "end", "left"),
    [
        ((0, 0), (100_000, 0), ((0, 0), (100_000, 0))),
        ((0, 0), (300_000, 0), ((0, 0), (150_000, 0))),
        ((-900_000, 90_000), (900_000, 90_000), ((-120_000, 90_000), (120_000, 90_000))),
        ((-900_000, 150_000), (900_000, 150_000), None),
        ((-900_000, 200_000), (900_000, 200_000), None),
        ((300_000, 0), (900_000, 0), None),
    ],
)
def test_streets_are_cut_at_the_border_of_a_disc(start, end, left):
    assert area(100).clip(start, end) == left  # 100 m, and 50 m more for streets


@pytest.mark.parametrize(
    ("start", "end", "left"),
    [
        ((0, 0), (0, 70_000), ((0, 0), (0, 70_000))),
        ((0, 0), (240_000, 120_000), ((0, 0), (150_000, 75_000))),
        ((-300_000, 20_000), (300_000, 20_000), ((-150_000, 20_000), (150_000, 20_000))),
        ((160_000, -300_000), (160_000, 300_000), None),
    ],
)
def test_streets_are_cut_at_the_border_of_a_box(start, end, left):
    box = Area(EQUATOR, None, (-100_000, -30_000, 100_000, 30_000), (0, 0, 0, 0))
    assert box.clip(start, end) == left


def test_bends_within_a_metre_are_left_out():
    assert straightened([(0, 0), (5000, 900), (10000, 0)]) == [(0, 0), (10000, 0)]
    assert straightened([(0, 0), (5000, 1100), (10000, 0)]) == [(0, 0), (5000, 1100), (10000, 0)]
    assert straightened([(0, 0), (9000, 50), (9000, 9000), (4500, 4000), (0, 0)]) == [
        (0, 0), (9000, 50), (9000, 9000), (0, 0),
    ]  # fmt: skip


def graph_of(*rows):
    graph = {}
    for row in rows:
        for a, b in pairwise(row):
            graph.setdefault(a, set()).add(b)
            graph.setdefault(b, set()).add(a)
    return graph


def test_crossings_and_ends_stay():
    a, b, c, d = (0, 0), (10000, 10), (20000, 0), (10000, 9000)
    assert simplified(graph_of([a, b, c])) == {(a, c)}
    assert simplified(graph_of([a, b, c], [b, d])) == {(a, b), (b, c), (b, d)}


def test_a_ring_without_a_crossing_stays_a_ring_of_its_corners():
    a, b, c, d = (0, 0), (0, 9000), (9000, 9000), (9000, 0)
    streets = simplified(graph_of([a, b, c, d, a]))
    assert streets <= {(a, b), (b, c), (d, c), (a, d), (a, c)}
    assert {end for street in streets for end in street} >= {a, c}


@given(st.lists(st.tuples(*[st.integers(0, 12)] * 4), min_size=1, max_size=25), st.randoms())
def test_simplifying_keeps_crossings_and_does_not_depend_on_the_order(lines, random):
    rows = [[(3000 * x1, 3000 * y1), (3000 * x2, 3000 * y2)] for x1, y1, x2, y2 in lines if (x1, y1) != (x2, y2)]
    if not rows:
        return
    graph = graph_of(*rows)
    streets = simplified(graph)
    random.shuffle(rows)
    assert simplified(graph_of(*[row[::-1] for row in rows])) == streets
    ends = {end for street in streets for end in street}
    assert ends <= set(graph)
    assert {place for place in graph if len(graph[place]) > 2} <= ends
    assert all(a < b for a, b in streets)


def street(osm_id, *places_m, **tags):
    """A street along places in metres."""
    places = [
        None if one is None else (round(1000 * one[0] / UNIT_MM), round(1000 * one[1] / 11.05743)) for one in places_m
    ]
    return way(osm_id, *places, **tags)


def near(node, x_m, y_m):
    return abs(node[0] - 1000 * x_m) < 12 and abs(node[1] - 1000 * y_m) < 12


def test_streets_become_one_graph():
    ways = [
        street(1, (-90, 0), (0, 0), (90, 0)),
        street(2, (0, -90), (0, 0), (0, 90)),
        street(3, (0, 0), (90, 0)),  # the same again
        street(4, (0, 90), None, (40, 90), (40, 50)),  # loses a node: what is left leads nowhere
        street(5, (90, 0), (400, 0)),
        street(6, (-90, 0), (-90, 60), tunnel="yes"),
        street(7, (-90, 0), (-90, 60), area="yes"),
        street(8, (90, 0), (90, 60), tunnel="building_passage"),
        street(9, (60, 60)),
    ]
    nodes, streets, counts = street_graph(ways, area(100))
    found = [next((name for name, place in {
        "west": (-90, 0), "middle": (0, 0), "east": (90, 0), "north": (0, 90), "south": (0, -90), "border": (150, 0),
        "passage": (90, 60),
    }.items() if near(node, *place)), None) for node in nodes]  # fmt: skip
    assert {tuple(sorted((found[a], found[b]))) for a, b in streets} == {
        ("middle", "west"), ("middle", "north"), ("middle", "south"), ("east", "middle"), ("border", "east"),
        ("east", "passage"),
    }  # fmt: skip
    assert (counts.tunnels, counts.squares, counts.cut, counts.clipped) == (["w6"], ["w7"], ["w4"], 1)
    assert counts.n_parts_dropped == 1
    assert counts.dropped_m == pytest.approx(40, abs=0.02)
    assert counts.kept_m == pytest.approx(480, abs=0.1)


def hydrant(x_m, y_m):
    return OsmNode(1, {}, (round(1000 * x_m / UNIT_MM), round(1000 * y_m / 11.05743)))


def test_hydrants_get_nodes():
    hydrants = [
        hydrant(30, 5), hydrant(60, -3),  # on the street
        hydrant(0.5, 2),  # at its end
        hydrant(30, 9),  # where another is
        hydrant(50, 80),  # too far
        hydrant(500, 0),  # beyond the border
    ]  # fmt: skip
    made, n_far, n_shared = with_hydrants([(0, 0), (90_000, 0)], [(0, 1)], hydrants, area(100))
    assert [place[1] for place in made.node_mm.tolist()] == [0, 0, 0, 0]
    assert [place[0] for place in made.node_mm.tolist()] == pytest.approx([0, 30_000, 60_000, 90_000], abs=12)
    assert made.street.tolist() == [[0, 1], [1, 2], [2, 3]]
    assert made.hydrant_node.tolist() == [0, 1, 2]
    assert (n_far, n_shared) == (1, 1)


def test_of_many_courtyards_the_largest_stay():
    outer = ((0, 0), (90_000, 0), (90_000, 90_000), (0, 90_000), (0, 0))
    members = {1: way(1, *outer)}
    for k in range(105):
        x, y, side = 800 * (k % 11) * 10 + 500, 800 * (k // 11) * 10 + 500, 400 + k
        members[2 + k] = way(2 + k, (x, y), (x + side, y), (x + side, y + side), (x, y + side), (x, y))
    roles = tuple(("w", ref, "outer" if ref == 1 else "inner") for ref in members)
    losses = Losses()
    (found,), _ = relation_shapes(OsmRelation(5, {"building": "yes"}, roles), members, EQUATOR, losses)
    assert losses == Losses(filled_holes=5)
    widths = [max(x for x, _ in hole) - min(x for x, _ in hole) for hole in found.holes]
    assert len(widths) == 100
    assert min(widths) > 11.1 * 404


def test_overlaps_are_found_across_blocks(monkeypatch):
    monkeypatch.setattr(overlaps, "PAIRS_AT_ONCE", 20)
    shapes = [shape(k, 15 * k, 0, 15 * k + 20, 20) for k in range(7)]
    assert weed(shapes).overlapping == ["w1", "w2", "w3", "w4", "w5", "w6"]
