"""Lengths of streets, access points and footpaths."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fireworld.city import footpaths as module
from fireworld.city.footpaths import footpaths
from fireworld.city.streets import streets_of
from tests.city.plans import footprints, rectangle, street_map
from tests.reference.ways import shortest_ways

NOWHERE = np.empty((0, 2), dtype=np.int32)
#   2 --- 3
#   |     |     5 --- 4 (apart)
#   0 --- 1
SQUARE = street_map(
    [(0, 0), (30_000, 0), (0, 30_000), (30_000, 30_000), (99_000, 9000), (69_000, 9000)],
    [(0, 1), (2, 0), (1, 3), (2, 3), (4, 5)],
)


def test_lengths_are_rounded_and_never_zero():
    streets = streets_of(street_map([(0, 0), (1, 1), (1, 1), (3, 4)], [(0, 1), (1, 2), (2, 3)]), NOWHERE)
    assert streets.street_length_mm.tolist() == [1, 1, 4]


def test_access_points_by_hand():
    centroids = np.array([[10_000, 4000], [-5000, -5000], [15_000, 15_000], [80_000, 20_000]], dtype=np.int32)
    streets = streets_of(SQUARE, centroids)
    assert streets.access_street.tolist() == [0, 0, 0, 4]  # ties: the corner and the very middle, lowest street
    assert streets.access_offset_mm.tolist() == [10_000, 0, 15_000, 19_000]
    assert streets.access_mm.tolist() == [[10_000, 0], [0, 0], [15_000, 0], [80_000, 9000]]


@pytest.mark.parametrize("seed", range(3))
def test_access_points_against_every_street(seed):
    draw = np.random.default_rng(seed)
    nodes, pairs = (
        draw.integers(0, 200_000, (30, 2)),
        [(k, (7 * k + 1) % 30) for k in range(30) if (7 * k + 1) % 30 != k],
    )
    centroids = draw.integers(-20_000, 220_000, (200, 2)).astype(np.int32)
    streets = streets_of(street_map(nodes.tolist(), pairs), centroids)
    start, span = nodes[[a for a, _ in pairs]], nodes[[b for _, b in pairs]] - nodes[[a for a, _ in pairs]]
    for centroid, street, point in zip(centroids, streets.access_street, streets.access_mm, strict=True):
        part = np.clip(((centroid - start) * span).sum(axis=1) / (span * span).sum(axis=1), 0, 1)
        on_street = start + np.floor(span * part[:, None] + 0.5)
        away = ((on_street - centroid) ** 2).sum(axis=1)
        assert street == np.argmin(away)
        assert point.tolist() == on_street[street].tolist()
    assert (streets.access_offset_mm <= streets.street_length_mm[streets.access_street]).all()


def test_footpaths_join_the_six_nearest_and_then_everything():
    # Two rows of eight buildings, 500 m apart, and one on its own.
    rows = [rectangle(20_000 * k, 500_000 * row, 10_000, 10_000) for row in range(2) for k in range(8)]
    streets = footpaths(footprints(*rows, rectangle(70_000, 900_000, 10_000, 10_000)), [])
    pairs = {tuple(pair) for pair in streets.street.tolist()}
    assert all(a < b for a, b in pairs)
    assert {b for a, b in pairs if a == 0} == {1, 2, 3, 4, 5, 6, 8}
    between = [(a, b) for a, b in pairs if a < 8 <= b]
    assert between == [(0, 8)]  # the two rows are equally near at every column, so the lowest
    assert sum(b == 16 for _, b in pairs) == 6  # the lonely one has its six nearest
    assert (shortest_ways(streets_of(streets, NOWHERE))[0] >= 0).all()


def plain_footpaths(points):
    """The same paths, by looking at all pairs again and again."""

    def square(a, b):
        return (points[a][0] - points[b][0]) ** 2 + (points[a][1] - points[b][1]) ** 2

    every = range(len(points))
    paths = set()
    for one in every:
        nearest = sorted((square(one, other), other) for other in every if other != one)[:6]
        paths |= {(min(one, other), max(one, other)) for _, other in nearest}
    part_of = {one: {one} for one in every}
    for a, b in paths:
        both = part_of[a] | part_of[b]
        part_of |= dict.fromkeys(both, both)
    inside = sorted(part_of[0])
    while len(inside) < len(points):
        outside = [one for one in every if one not in inside]
        _, newcomer, place = min((square(a, b), b, k) for k, a in enumerate(inside) for b in outside)
        paths.add((min(newcomer, inside[place]), max(newcomer, inside[place])))
        inside += sorted(part_of[newcomer])
    return sorted(paths)


@given(
    points=st.integers(1, 10**6).flatmap(
        lambda spread: st.lists(st.tuples(*[st.integers(0, spread)] * 2), min_size=2, max_size=40)
    ),
    apart=st.integers(0, 10**7),
    large=st.sampled_from([1, 4, 500]),
    at_once=st.sampled_from([1, 60, 1 << 19]),
)
@settings(max_examples=80)
def test_footpaths_are_those_of_all_pairs(points, apart, large, at_once):
    points = [(x + apart * (k % 3), y) for k, (x, y) in enumerate(points)]  # some of them in clusters far away
    drawn = footprints(*[rectangle(x, y, 2, 2) for x, y in points])
    centroids = [tuple(point) for point in drawn.centroid_mm.tolist()]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "LARGE_PART", large)
        patch.setattr(module, "PAIRS_AT_ONCE", at_once)
        paths = footpaths(drawn, [])
    assert [tuple(path) for path in paths.street.tolist()] == plain_footpaths(centroids)


def test_footpaths_lead_to_hydrants():
    streets = footpaths(footprints(rectangle(0, 0, 4000, 4000)), [(50_000, 0)])
    assert streets.node_mm.tolist() == [[2000, 2000], [50_000, 0]]
    assert streets.street.tolist() == [[0, 1]]
    assert streets.hydrant_node.tolist() == [1]


def test_a_building_on_its_own_has_a_path_to_its_corner():
    streets = footpaths(footprints(rectangle(0, 0, 4000, 4000)), [])
    assert streets.node_mm.tolist() == [[2000, 2000], [0, 0]]
    assert streets.street.tolist() == [[0, 1]]
    assert streets_of(streets, np.array([[2000, 2000]], dtype=np.int32)).access_offset_mm.tolist() == [0]


def test_buildings_on_one_spot_are_joined_too():
    streets = footpaths(footprints(*[rectangle(0, 0, 4000, 4000)] * 9), [])
    assert (shortest_ways(streets_of(streets, NOWHERE))[0] >= 0).all()
