"""Shortest ways, looked for by the kernels: those of plain numpy, in whatever order they are asked for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fireworld.city.city import Array, Streets
from fireworld.city.streets import streets_of
from fireworld.kernels.arrays import GOAL, KNOWN, WAYS, StreetArrays
from fireworld.kernels.ways import NOWHERE, find_all_ways, line_to, lines_to, next_street, way
from fireworld.simulation import ways as simulation_ways
from fireworld.simulation.city_arrays import street_arrays
from fireworld.simulation.ways import empty_ways, fresh_ways
from tests.city.plans import street_map
from tests.reference.ways import shortest_ways

NOBODY = np.empty((0, 2), dtype=np.int32)
#   2 --- 3
#   |     |     5 --- 4 (apart)
#   0 --- 1
SQUARE = (
    [(0, 0), (30_000, 0), (0, 30_000), (30_000, 30_000), (99_000, 9000), (69_000, 9000)],
    [(0, 1), (2, 0), (1, 3), (2, 3), (4, 5)],
)


def graph(nodes: Sequence[tuple[int, int]], pairs: Sequence[tuple[int, int]]) -> Streets:
    return streets_of(street_map(nodes, pairs), NOBODY)


def tables(streets: Streets) -> StreetArrays:
    return street_arrays(streets, np.empty(0, dtype=np.int32))


def complete(streets: Streets) -> tuple[Array, Array]:
    """Distances and next nodes, as `shortest_ways` gives them, by the kernels that look for all ways at once."""
    arrays = tables(streets)
    m = len(streets.node_mm)
    ways = empty_ways(arrays, m)
    find_all_ways(arrays, ways)
    distance = ways.table[:, WAYS:].T.copy()
    next_node = np.full((m, m), -1)
    for node, goal in zip(*np.nonzero((distance > 0) & (distance < NOWHERE)), strict=True):
        next_node[node, goal] = next_street(node, goal, arrays, ways)[1]
    distance[distance >= NOWHERE] = -1
    return distance, next_node


def asked_for(streets: Streets, n_kept: int, order: np.random.Generator) -> tuple[Array, Array]:
    """The same, asked for pair by pair in some order, where so many lines are kept."""
    arrays = tables(streets)
    m = len(streets.node_mm)
    ways = empty_ways(arrays, n_kept)
    distance, next_node = np.full((m, m), -1, dtype=np.int64), np.full((m, m), -1)
    for street in order.permutation(len(streets.street)):
        for goal in order.permutation(m):
            line = line_to(goal, street, int(order.integers(0, 2)) * 50_000, arrays, ways)
            assert (ways.table[line, GOAL] - 1, ways.line[goal] - 1) == (goal, line)
            for node in streets.street[street]:
                found = ways.table[line, WAYS + node]
                assert found <= ways.table[line, KNOWN]
                distance[node, goal] = found if found < NOWHERE else -1
                if 0 < found < NOWHERE:
                    next_node[node, goal] = next_street(node, line, arrays, ways)[1]
    return distance, next_node


@pytest.mark.parametrize("found", [shortest_ways, complete])
def test_square_by_hand(found):
    distance, next_node = found(graph(*SQUARE))
    assert distance[0].tolist() == [0, 30_000, 30_000, 60_000, -1, -1]
    assert next_node[0].tolist() == [-1, 1, 2, 1, -1, -1]  # to 3 by 1 or 2: the lowest
    assert next_node[3].tolist() == [1, 1, 2, -1, -1, -1]
    assert distance[4].tolist() == [-1, -1, -1, -1, 0, 30_000]


@pytest.mark.parametrize("found", [shortest_ways, complete])
def test_of_parallel_streets_the_shorter_counts_and_detours_win(found):
    # The direct street 0-2 is straight, so nothing beats it; two streets 0-1 are the same.
    distance, _ = found(graph([(0, 0), (3000, 4000), (6000, 0)], [(0, 1), (1, 0), (1, 2), (0, 2)]))
    assert distance.tolist() == [[0, 5000, 6000], [5000, 0, 5000], [6000, 5000, 0]]


@pytest.mark.parametrize("found", [shortest_ways, complete])
@pytest.mark.parametrize("seed", range(5))
def test_agrees_with_dijkstra_and_the_next_nodes_lead_there(found, seed):
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import dijkstra

    draw = np.random.default_rng(seed)
    m = 60
    nodes = draw.integers(0, 300_000, (m, 2))
    pairs = draw.integers(0, m, (70, 2))
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    streets = graph(nodes.tolist(), pairs.tolist())
    distance, next_node = found(streets)
    low, high = pairs.min(axis=1), pairs.max(axis=1)
    _, single = np.unique(low * m + high, return_index=True)
    lengths = coo_array((streets.street_length_mm[single].astype(float), (low[single], high[single])), shape=(m, m))
    expected = dijkstra(lengths.tocsr(), directed=False)
    np.testing.assert_array_equal(distance, np.where(np.isinf(expected), -1, expected))
    assert (distance < 0).any()

    length = {(int(a), int(b)): int(w) for (a, b), w in zip(pairs, streets.street_length_mm, strict=True)}
    length |= {(b, a): w for (a, b), w in length.items()}
    for start in range(m):
        for goal in range(m):
            step = int(next_node[start, goal])
            if distance[start, goal] <= 0:
                assert step == -1
                continue
            onward = distance[:, goal]
            usable = [n for n in range(m) if (start, n) in length and onward[n] + length[start, n] == onward[start]]
            assert step == min(usable)


@st.composite
def graphs(draw: st.DrawFn) -> Streets:
    """Up to 24 nodes on few places, so that many ways are equal, with streets that may be double, or lead nowhere."""
    n = draw(st.integers(1, 24))
    spread = draw(st.sampled_from([3, 5, 40]))
    place = st.tuples(st.integers(0, spread), st.integers(0, spread))
    nodes = [(x * 1000, y * 1000) for x, y in draw(st.lists(place, min_size=n, max_size=n))]
    node = st.integers(0, n - 1)
    return graph(nodes, draw(st.lists(st.tuples(node, node), min_size=1, max_size=3 * n)))


@given(streets=graphs())
@settings(max_examples=150)
def test_all_ways_are_those_of_plain_numpy(streets):
    for found, expected in zip(complete(streets), shortest_ways(streets), strict=True):
        np.testing.assert_array_equal(found, expected)


@given(streets=graphs(), n_kept=st.integers(1, 5), order=st.integers(0, 1000))
@settings(max_examples=150)
def test_so_are_those_that_are_asked_for_one_by_one(streets, n_kept, order):
    driven = np.unique(streets.street)
    for found, expected in zip(
        asked_for(streets, n_kept, np.random.default_rng(order)), shortest_ways(streets), strict=True
    ):
        np.testing.assert_array_equal(found[driven], expected[driven])


@given(streets=graphs(), n_kept=st.integers(2, 5), trips=st.lists(st.tuples(*[st.integers(0, 999)] * 4), max_size=12))
@settings(max_examples=150)
def test_whole_ways_are_the_same_however_few_are_kept(streets, n_kept, trips):
    """Driven from street to street with the lines that were looked up where the way began, as brigades do."""
    arrays = tables(streets)
    few, every = empty_ways(arrays, n_kept), fresh_ways(arrays, 0)
    k = len(streets.street)
    for start, along, goal, goal_along in trips:
        street, goal_street = start % k, goal % k
        length_mm = streets.street_length_mm
        offset, goal_offset = (int(length_mm[street]) * along // 999, int(length_mm[goal_street]) * goal_along // 999)
        lines = [lines_to(goal_street, street, arrays, ways) for ways in (few, every)]
        while street != goal_street:
            found = [
                way(street, offset, goal_street, goal_offset, *own, arrays, ways)
                for own, ways in zip(lines, (few, every), strict=True)
            ]
            (length, leave, line), (expected, expected_leave, other_line) = found
            assert (length, leave) == (expected, expected_leave)
            if leave < 0 or few.table[line, WAYS + leave] == 0:
                break
            turns = [next_street(leave, own, arrays, ways) for own, ways in ((line, few), (other_line, every))]
            assert turns[0] == turns[1]
            street, node = turns[0]
            offset = 0 if node == streets.street[street, 0] else int(length_mm[street])


def test_one_node_on_its_own():
    streets = graph([(0, 0), (1000, 0), (5000, 5000)], [(0, 1)])
    no_arcs = np.empty(0, dtype=np.int32)
    alone = tables(streets)._replace(
        node_x=np.zeros(1), node_y=np.zeros(1), arc_ptr=np.zeros(2, dtype=np.int32), arc_node=no_arcs
    )
    ways = empty_ways(alone, 1)
    find_all_ways(alone, ways)
    assert ways.table[0].tolist() == [1, NOWHERE, 1, 0]
    assert complete(streets)[0].tolist() == [[0, 1000, -1], [1000, 0, -1], [-1, -1, 0]]


def test_a_search_ends_where_it_is_asked_to_and_is_gone_on_from():
    """A street of 100 nodes, 10 m apart: from its beginning only as much of it is looked at as is asked for."""
    arrays = tables(graph([(10_000 * k, 0) for k in range(100)], [(k, k + 1) for k in range(99)]))
    ways = empty_ways(arrays, 1)
    line = line_to(0, 2, 0, arrays, ways)  # the street from node 2 to node 3
    assert ways.table[line, KNOWN] == 30_000
    assert (ways.table[line, WAYS:] < NOWHERE).sum() == 4
    line_to(0, 2, 50_000, arrays, ways)
    assert ways.table[line, KNOWN] == 80_000
    line_to(0, 1, 0, arrays, ways)  # nearer: nothing to be looked for
    assert ways.table[line, KNOWN] == 80_000
    line_to(0, 98, 1, arrays, ways)
    assert ways.table[line, KNOWN] == NOWHERE
    assert ways.table[line, WAYS:].tolist() == [10_000 * k for k in range(100)]


def test_what_has_not_been_asked_for_longest_makes_room():
    arrays = tables(graph(*SQUARE))
    ways = empty_ways(arrays, 2)
    for goal in (0, 1, 0, 3):
        line_to(goal, 0, 0, arrays, ways)
    assert sorted(ways.table[:, GOAL] - 1) == [0, 3]
    assert (ways.line[:-1] > 0).tolist() == [True, False, False, True, False, False]


def test_a_small_city_has_all_ways_and_a_large_one_room_for_those_of_its_brigades(monkeypatch):
    arrays = tables(graph(*SQUARE))._replace(refuge=np.zeros(1, dtype=np.int32))
    assert len(fresh_ways(arrays, 4).table) == 6
    monkeypatch.setattr(simulation_ways, "N_NODES_COMPLETE", 5)
    assert len(fresh_ways(arrays, 4).table) == 2 * (4 + 1)
    monkeypatch.setattr(simulation_ways, "KEPT_BYTES", 8 * 6 * 7)
    assert len(fresh_ways(arrays, 4).table) == 7
    monkeypatch.setattr(simulation_ways, "KEPT_BYTES", 0)
    assert len(fresh_ways(arrays, 4).table) == 2
