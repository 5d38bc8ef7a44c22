"""Driving on a small street graph: ways, turns at nodes, and stopping at the first millimetre in range."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fireworld.kernels.brigades import NO_TARGET, drive, locate, stop_in_range
from fireworld.kernels.ways import NOWHERE, lines_to, next_street, way
from tests.kernels.small import METRE, make_city, make_world, square

# a street east in four parts, one that branches off north at node 1, and an island
NODES_M = [(0, 0), (100, 0), (100, 100), (200, 0), (400, 0), (300, 0), (0, 500), (50, 500)]
STREETS = [(0, 1), (1, 2), (1, 3), (3, 5), (5, 4), (6, 7)]
FIRST, UP, EAST, BEYOND, LAST, ISLAND = range(6)
AT_UP, AT_LAST, AT_ISLAND, AT_CROSSING = range(4)
BUILDINGS = [square(88, 60), square(360, 12), square(20, 512), square(112, -12)]
"""Entered from street UP at 60 m, LAST at 60 m, ISLAND at 20 m, EAST at 12 m."""


@pytest.fixture
def world():
    return make_world(make_city(*BUILDINGS, nodes_m=NODES_M, streets=STREETS), brigades=[AT_UP])


def put(world, street, offset_m):
    brigades = world.state.brigades
    brigades.street[0], brigades.offset[0] = street, round(offset_m * METRE)
    brigades.x[0], brigades.y[0] = locate(street, round(offset_m * METRE), world.city_arrays.streets)
    brigades.driven[0] = 0


def go(world, building, *, target=NO_TARGET, speed_m=80.0):
    """Drive one step; return street, offset, way driven (m) and the place (m)."""
    constants = world.constants.brigades._replace(speed=round(speed_m * METRE))
    brigades = world.state.brigades
    brigades.driven[0] = 0
    city, ways = world.city_arrays, world.state.ways
    drive(0, building, target, brigades, city.streets, ways, city.geometry, constants)
    x, y = brigades.x[0] / METRE, brigades.y[0] / METRE
    return int(brigades.street[0]), brigades.offset[0] / METRE, brigades.driven[0] / METRE, (x, y)


def find_way(world, street, offset_m, goal_street, goal_offset_m):
    """Length of the way, mm, node to leave by, node to arrive at: the line of a small city's node has its number."""
    streets, ways = world.city_arrays.streets, world.state.ways
    lines = lines_to(goal_street, street, streets, ways)
    return way(street, offset_m * METRE, goal_street, goal_offset_m * METRE, *lines, streets, ways)


def test_the_buildings_are_entered_where_the_tests_say(world):
    streets = world.city_arrays.streets
    assert streets.access_street.tolist() == [UP, LAST, ISLAND, EAST]
    assert (streets.access_offset / METRE).tolist() == [60.0, 60.0, 20.0, 12.0]


@pytest.mark.parametrize(
    ("start", "goal", "expected"),
    [
        ((FIRST, 10), (FIRST, 70), (60, -1, -1)),
        ((FIRST, 70), (FIRST, 10), (60, -1, -1)),
        ((FIRST, 30), (UP, 60), (130, 1, 1)),
        ((UP, 60), (FIRST, 30), (130, 1, 1)),
        ((FIRST, 1), (BEYOND, 10), (209, 1, 3)),
        ((FIRST, 100), (UP, 0), (0, 1, 1)),
        ((FIRST, 50), (ISLAND, 20), (int(NOWHERE) // METRE, -1, -1)),
    ],
)
def test_ways(world, start, goal, expected):
    (street, offset), (goal_street, goal_offset) = start, goal
    length, leave, arrive = find_way(world, street, offset, goal_street, goal_offset)
    assert (length // METRE, leave, arrive) == expected


def test_of_two_ways_of_one_length_the_one_by_the_first_nodes_is_taken():
    """Halfway along one side of a square, the goal halfway along the opposite one."""
    corners = [(0, 0), (100, 0), (100, 100), (0, 100)]
    city = make_city(square(50, 112), nodes_m=corners, streets=[(0, 1), (1, 2), (3, 2), (3, 0)])
    assert find_way(make_world(city), 0, 50, 2, 50) == (200 * METRE, 0, 3)


def test_of_two_streets_between_two_nodes_the_first_shortest_is_taken():
    city = make_city(square(50, 12), nodes_m=[(0, 0), (100, 0)], streets=[(0, 1), (1, 0)])
    world = make_world(city)
    assert next_street(0, 1, world.city_arrays.streets, world.state.ways) == (0, 1)
    assert next_street(1, 0, world.city_arrays.streets, world.state.ways) == (0, 0)


def test_a_way_through_several_streets(world):
    """From x = 30 over three nodes to x = 360 on the last street, 330 m in steps of 80 m."""
    put(world, FIRST, 30)
    assert go(world, AT_LAST) == (EAST, 10.0, 80.0, (110.0, 0.0))
    assert go(world, AT_LAST) == (EAST, 90.0, 80.0, (190.0, 0.0))
    assert go(world, AT_LAST) == (BEYOND, 70.0, 80.0, (270.0, 0.0))
    assert go(world, AT_LAST) == (LAST, 50.0, 80.0, (350.0, 0.0))
    assert go(world, AT_LAST) == (LAST, 60.0, 10.0, (360.0, 0.0))


def test_one_step_may_pass_many_nodes(world):
    put(world, FIRST, 30)
    street, offset, driven, place = go(world, AT_LAST, speed_m=1000)
    assert (street, offset, driven, place) == (LAST, 60.0, 330.0, (360.0, 0.0))


def test_a_street_driven_backwards(world):
    put(world, UP, 90)
    assert go(world, AT_CROSSING, speed_m=40) == (UP, 50.0, 40.0, (100.0, 50.0))
    assert go(world, AT_CROSSING, speed_m=40) == (UP, 10.0, 40.0, (100.0, 10.0))
    assert go(world, AT_CROSSING, speed_m=40) == (EAST, 12.0, 22.0, (112.0, 0.0))
    assert go(world, AT_CROSSING, speed_m=40) == (EAST, 12.0, 0.0, (112.0, 0.0))


def test_a_step_that_ends_at_a_node_goes_on_from_there(world):
    put(world, FIRST, 20)
    assert go(world, AT_UP) == (FIRST, 100.0, 80.0, (100.0, 0.0))
    assert go(world, AT_UP, speed_m=40) == (UP, 40.0, 40.0, (100.0, 40.0))


def test_the_same_street(world):
    put(world, UP, 5)
    assert go(world, AT_UP, speed_m=30) == (UP, 35.0, 30.0, (100.0, 35.0))
    assert go(world, AT_UP, speed_m=30) == (UP, 60.0, 25.0, (100.0, 60.0))


def test_without_a_way_a_brigade_stays(world):
    put(world, FIRST, 20)
    assert go(world, AT_ISLAND) == (FIRST, 20.0, 0.0, (20.0, 0.0))


def test_a_way_of_no_length_to_a_crossing_changes_the_street():
    """Standing where two streets meet is being there, from whichever of them the building is entered."""
    city = make_city(square(100, -12), nodes_m=[(0, 0), (100, 0), (200, 50)], streets=[(1, 2), (0, 1)])
    world = make_world(city, brigades=[0])
    access = int(world.city_arrays.streets.access_street[0])
    other = 1 - access
    put(world, other, 100 if other == 1 else 0)
    street, offset, driven, place = go(world, 0)
    assert (street, offset * METRE) == (access, float(world.city_arrays.streets.access_offset[0]))
    assert (driven, place) == (0.0, (100.0, 0.0))


def test_it_stops_at_the_first_millimetre_in_range(world):
    """The target at (300, 30): 50 m are reached 40 m before it, exactly at x = 260 m."""
    world.city_arrays.geometry.x[AT_LAST], world.city_arrays.geometry.y[AT_LAST] = 300_000.0, 30_000.0
    put(world, FIRST, 30)
    assert go(world, AT_LAST, target=AT_LAST, speed_m=1000) == (BEYOND, 60.0, 230.0, (260.0, 0.0))
    world.city_arrays.geometry.y[AT_LAST] = 30_001.0
    put(world, FIRST, 30)
    assert go(world, AT_LAST, target=AT_LAST, speed_m=1000)[1] == 60.001


def test_a_target_in_range_from_a_node_ends_the_way_there(world):
    """At the crossing (100, 0) the target at (100, -50) is in range; before it and on every other street it is not."""
    world.city_arrays.geometry.x[AT_UP], world.city_arrays.geometry.y[AT_UP] = 100_000.0, -50_000.0
    put(world, FIRST, 30)
    _, _, driven, place = go(world, AT_UP, target=AT_UP, speed_m=1000)
    assert (driven, place) == (70.0, (100.0, 0.0))


coordinate = st.integers(-120_000, 120_000)


@given(
    end=st.tuples(coordinate, coordinate).filter(lambda end: max(map(abs, end)) > 2000),
    target=st.tuples(coordinate, coordinate),
    part=st.tuples(st.integers(0, 100), st.integers(0, 100)),
    range_mm=st.integers(100, 90_000),
)
@settings(max_examples=150)
def test_stopping_is_what_looking_at_every_millimetre_finds(end, target, part, range_mm):
    """Streets at any angle, whose whole lengths are not quite their true ones."""
    nodes_m = [(0, 0), (end[0] / METRE, end[1] / METRE)]
    tables = SLANTED.city_arrays
    length = round(float(np.hypot(*end)))
    streets = tables.streets._replace(
        node_x=np.array([0.0, float(end[0])]), node_y=np.array([0.0, float(end[1])]), length=np.array([length])
    )
    geometry = tables.geometry._replace(x=np.array([float(target[0])]), y=np.array([float(target[1])]))
    offset, goal = length * part[0] // 100, length * part[1] // 100
    square_mm = float(range_mm) ** 2
    x, y = locate(0, offset, streets)
    if (target[0] - x) ** 2 + (target[1] - y) ** 2 <= square_mm or offset == goal:
        return  # a brigade in range does not drive
    stop = stop_in_range(0, offset, goal, 0, square_mm, geometry, streets)
    ahead = np.arange(1, abs(goal - offset) + 1) * (1 if goal > offset else -1) + offset
    x, y = ahead / length * end[0], ahead / length * end[1]
    inside = (target[0] - x) ** 2 + (target[1] - y) ** 2 <= square_mm
    assert stop == (ahead[np.argmax(inside)] if inside.any() else goal), nodes_m


SLANTED = make_world(make_city(square(0, 0), nodes_m=[(0, 0), (100, 0)]))


@given(st.lists(st.tuples(st.integers(0, 3), st.integers(1, 120_000)), min_size=1, max_size=20))
@settings(max_examples=60)
def test_a_brigade_is_always_on_its_street_and_never_too_fast(trips):
    world = make_world(make_city(*BUILDINGS, nodes_m=NODES_M, streets=STREETS), brigades=[AT_UP])
    streets, brigades = world.city_arrays.streets, world.state.brigades
    for building, speed in trips:
        before = np.array([brigades.x[0], brigades.y[0]])
        go(world, building, speed_m=speed / METRE)
        driven = brigades.driven[0]
        street, offset = brigades.street[0], brigades.offset[0]
        assert 0 <= offset <= streets.length[street]
        assert (brigades.x[0], brigades.y[0]) == locate(street, offset, streets)
        assert driven <= speed
        assert np.hypot(*(np.array([brigades.x[0], brigades.y[0]]) - before)) <= driven + 1e-6
