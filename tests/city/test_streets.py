"""Shortest ways and access points."""

from __future__ import annotations

import numpy as np
import pytest

from fireworld.city.footpaths import footpaths
from fireworld.city.streets import streets_of
from tests.city.plans import footprints, rectangle, street_map

NOWHERE = np.empty((0, 2), dtype=np.int32)
#   2 --- 3
#   |     |     5 --- 4 (apart)
#   0 --- 1
SQUARE = street_map(
    [(0, 0), (30_000, 0), (0, 30_000), (30_000, 30_000), (99_000, 9000), (69_000, 9000)],
    [(0, 1), (2, 0), (1, 3), (2, 3), (4, 5)],
)


def test_square_by_hand():
    streets = streets_of(SQUARE, NOWHERE)
    assert streets.street_length_mm.tolist() == [30_000] * 5
    assert streets.distance_mm[0].tolist() == [0, 30_000, 30_000, 60_000, -1, -1]
    assert streets.next_node[0].tolist() == [-1, 1, 2, 1, -1, -1]  # to 3 by 1 or 2: the lowest
    assert streets.next_node[3].tolist() == [1, 1, 2, -1, -1, -1]
    assert streets.distance_mm[4].tolist() == [-1, -1, -1, -1, 0, 30_000]


def test_lengths_are_rounded_and_never_zero():
    streets = streets_of(street_map([(0, 0), (1, 1), (1, 1), (3, 4)], [(0, 1), (1, 2), (2, 3)]), NOWHERE)
    assert streets.street_length_mm.tolist() == [1, 1, 4]


def test_of_parallel_streets_the_shorter_counts_and_detours_win():
    # The direct street 0-2 is straight, so nothing beats it; two streets 0-1 are the same.
    streets = streets_of(street_map([(0, 0), (3000, 4000), (6000, 0)], [(0, 1), (1, 0), (1, 2), (0, 2)]), NOWHERE)
    assert streets.distance_mm.tolist() == [[0, 5000, 6000], [5000, 0, 5000], [6000, 5000, 0]]


@pytest.mark.parametrize("seed", range(5))
def test_agrees_with_dijkstra_and_the_next_nodes_lead_there(seed):
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import dijkstra

    draw = np.random.default_rng(seed)
    m = 60
    nodes = draw.integers(0, 300_000, (m, 2))
    pairs = draw.integers(0, m, (70, 2))
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    streets = streets_of(street_map(nodes.tolist(), pairs.tolist()), NOWHERE)
    low, high = pairs.min(axis=1), pairs.max(axis=1)
    _, single = np.unique(low * m + high, return_index=True)
    graph = coo_array((streets.street_length_mm[single].astype(float), (low[single], high[single])), shape=(m, m))
    expected = dijkstra(graph.tocsr(), directed=False)
    np.testing.assert_array_equal(streets.distance_mm, np.where(np.isinf(expected), -1, expected))
    assert (streets.distance_mm < 0).any()

    length = {(int(a), int(b)): int(w) for (a, b), w in zip(pairs, streets.street_length_mm, strict=True)}
    length |= {(b, a): w for (a, b), w in length.items()}
    for start in range(m):
        for goal in range(m):
            step = int(streets.next_node[start, goal])
            if streets.distance_mm[start, goal] <= 0:
                assert step == -1
                continue
            onward = streets.distance_mm[:, goal]
            usable = [n for n in range(m) if (start, n) in length and onward[n] + length[start, n] == onward[start]]
            assert step == min(usable)


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
    assert (streets_of(streets, NOWHERE).distance_mm >= 0).all()


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
    assert (streets_of(streets, NOWHERE).distance_mm >= 0).all()
