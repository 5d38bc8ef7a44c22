"""Tanks: requests in the official order of tests, refilling, hydrants, and the way of a brigade that runs dry."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fireworld.kernels import brigades as kernels
from fireworld.kernels.brigades import DEAD, DRIVING, IDLE, REFILLING, SPRAYING, TO_REFUGE
from fireworld.parameters import OFFICIAL_2013, PAPER, Parameters
from fireworld.policy.kernel import always
from fireworld.simulation.city_arrays import brigade_constants
from tests.kernels.small import METRE, act, burn, make_city, make_world, square

PAPER_BRIGADES = brigade_constants(PAPER.brigades)
RANGE_MM = 50_000


@pytest.mark.parametrize(
    ("litres", "sprayed", "tank", "distance_mm", "expected"),
    [
        (2000, 0, 2000, RANGE_MM, kernels.ACCEPTED),  # at the power, the tank and the range
        (0, 0, 0, 0, kernels.ACCEPTED),
        (2001, 0, 15_000, 0, kernels.OVER_POWER),
        (1, 2000, 15_000, 0, kernels.OVER_POWER),
        (1000, 1000, 15_000, 0, kernels.ACCEPTED),
        (2000, 0, 1999, 0, kernels.TANK_TOO_LOW),
        (2000, 0, 2000, RANGE_MM + 1, kernels.OUT_OF_RANGE),
        (-1, 0, 0, 0, kernels.NEGATIVE),
        # several faults: power, tank, range, sign, in this order
        (2001, 0, 0, RANGE_MM + 1, kernels.OVER_POWER),
        (2000, 0, 0, RANGE_MM + 1, kernels.TANK_TOO_LOW),
        (-1, 0, 0, RANGE_MM + 1, kernels.OUT_OF_RANGE),
        (-1, 2001, 0, 0, kernels.NEGATIVE),
        (-1, 2002, 0, 0, kernels.OVER_POWER),
    ],
)
def test_requests(litres, sprayed, tank, distance_mm, expected):
    assert kernels.judge_request(litres, sprayed, tank, float(distance_mm) ** 2, PAPER_BRIGADES) == expected


def test_refuges_and_hydrants_fill_tanks():
    """15000 l hold; 1500 at a refuge; 400 at a hydrant, for the lowest living brigade there."""
    tank = np.array([0, 14_000, 0, 0, 0, 14_900, 0], dtype=np.int32)
    refuge = np.array([3, 3, -1, -1, -1, -1, -1], dtype=np.int32)
    hydrant = np.array([-1, -1, 0, 0, 1, 2, -1], dtype=np.int32)
    hp = np.full(7, 1000, dtype=np.int32)
    kernels.refill(refuge, hydrant, hp, tank, PAPER_BRIGADES)
    assert tank.tolist() == [1500, 15_000, 400, 0, 400, 15_000, 0]
    hp[[0, 2]] = 0
    kernels.refill(refuge, hydrant, hp, tank, PAPER_BRIGADES)
    assert tank.tolist() == [1500, 15_000, 400, 400, 800, 15_000, 0], "the dead draw nothing and block nobody"


def test_stations_are_found_where_brigades_stand():
    city = make_city(
        square(0, 12),
        square(100, 12),
        refuges=[1],
        nodes_m=[(0, 0), (100, 0), (200, 0)],
        streets=[(0, 1), (1, 2)],
        hydrants=[2],
    )
    world = make_world(city, brigades=[0, 1, 1])
    brigades, streets = world.state.brigades, world.city_arrays.streets
    brigades.street[2], brigades.offset[2] = 1, 100_000
    brigades.x[2], brigades.y[2] = kernels.locate(1, 100_000, streets)
    kernels.find_stations(brigades, streets)
    assert brigades.refuge.tolist() == [-1, 1, -1]
    assert brigades.hydrant.tolist() == [-1, -1, 0]


def small_tank(**changes):
    return Parameters(
        fire=PAPER.fire, health=PAPER.health, brigades=replace(PAPER.brigades, tank_litres=3000, **changes)
    )


def fire_and_refuge(parameters, *, refuge_m=200.0):
    """A fire at x = 0 and a refuge along one street; the brigade starts at the refuge."""
    city = make_city(
        square(0, 12), square(refuge_m, 12), refuges=[1], nodes_m=[(-20, 0), (refuge_m + 20, 0)], streets=[(0, 1)]
    )
    return make_world(city, parameters=parameters, brigades=[1], ignited=[0])


def test_a_brigade_drives_sprays_runs_dry_refills_and_comes_back():
    """200 m of street, 80 m a step; range 50 m from 12 m aside: it stops 48.538 m before the fire."""
    world = fire_and_refuge(small_tank())
    policy = always(0)
    policy.begin(world.city_arrays, 1, 1)
    brigades = world.state.brigades
    told = []
    fire = world.state.fire
    for _ in range(12):
        fire.water[0], fire.energy[0], fire.fieryness[0] = 0, 1e6, 1  # a fire that no water puts out
        world.step(policy)
        told.append((int(brigades.activity[0]), int(brigades.tank[0]), int(brigades.driven[0])))
    assert told == [
        (DRIVING, 3000, 80_000),
        (DRIVING, 3000, 71_462),
        (SPRAYING, 1000, 0),
        (SPRAYING, 0, 0),  # what is left
        (TO_REFUGE, 0, 80_000),
        (TO_REFUGE, 0, 71_462),
        (REFILLING, 1500, 0),
        (REFILLING, 3000, 0),  # full: it goes on with the next step
        (DRIVING, 3000, 80_000),
        (DRIVING, 3000, 71_462),
        (SPRAYING, 1000, 0),
        (SPRAYING, 0, 0),
    ]
    assert world.state.outcome.water[0] == 6000.0


def test_sprayed_litres_lie_on_the_target():
    world = fire_and_refuge(small_tank(), refuge_m=30.0)
    world.state.brigades.target[0] = 0
    act(world)
    assert world.state.outcome.water[0] == 2000.0
    assert world.state.fire.water.tolist() == [2000, 0]
    assert world.state.fire.watered.tolist() == [1, 0]
    assert world.state.brigades.sprayed.tolist() == [2000]
    assert world.state.brigades.tank.tolist() == [1000]


@pytest.mark.parametrize(
    ("change", "expected"),
    [({"hp": 0}, DEAD), ({"target": -1}, IDLE), ({"refilling": 1}, REFILLING), ({}, SPRAYING)],
)
def test_what_else_a_brigade_does(change, expected):
    world = fire_and_refuge(small_tank(refuge_refill_litres=0), refuge_m=30.0)
    brigades = world.state.brigades
    brigades.target[0] = 0
    brigades.tank[0] = 2500
    for name, value in change.items():
        getattr(brigades, name)[0] = value
    act(world)
    assert brigades.activity[0] == expected
    assert (brigades.sprayed[0] > 0) == (expected == SPRAYING)


def test_a_dry_brigade_goes_to_the_refuge_with_the_shortest_way():
    """The refuge nearest as the crow flies, on the other bank, is the farther one by street."""
    city = make_city(
        square(0, 12),
        square(0, -40),
        square(150, 12),
        refuges=[1, 2],
        nodes_m=[(0, 0), (300, 0), (300, -28), (0, -28)],
        streets=[(0, 1), (1, 2), (2, 3)],
    )
    world = make_world(city, brigades=[0])
    brigades = world.state.brigades
    brigades.tank[0], brigades.refilling[0] = 0, 1
    for _ in range(2):
        act(world)
    assert brigades.x[0] == 150 * METRE
    act(world)
    assert brigades.refuge[0] == 2
    assert brigades.tank[0] == 1500


def test_a_dry_brigade_without_a_way_to_a_refuge_stays():
    city = make_city(
        square(0, 12),
        square(0, 500),
        refuges=[1],
        nodes_m=[(0, 0), (50, 0), (0, 480), (50, 480)],
        streets=[(0, 1), (2, 3)],
    )
    world = make_world(city, brigades=[0])
    world.state.brigades.tank[0] = 0
    world.state.brigades.refilling[0] = 1
    act(world)
    assert world.state.brigades.activity[0] == IDLE
    assert world.state.brigades.x[0] == 0.0


def test_a_refuge_shelters_only_those_who_refill():
    world = make_world(make_city(square(0, 0), square(60, 0), refuges=[1]), brigades=[1, 1])
    brigades = world.state.brigades
    kernels.find_stations(brigades, world.city_arrays.streets)
    brigades.activity[:] = REFILLING, IDLE
    kernels.shelter(brigades)
    assert brigades.inside.tolist() == [1, -1]


def test_presets_in_millimetres():
    constants = brigade_constants(OFFICIAL_2013.brigades)
    assert constants == (15_000, 3000, 1500, 400, 2.5e9, 40_000, False, False)


def test_a_hydrant_fills_in_passing_but_the_refuge_is_where_a_dry_brigade_goes():
    city = make_city(
        square(0, 12),
        square(200, 12),
        refuges=[1],
        nodes_m=[(-20, 0), (40, 0), (220, 0)],
        streets=[(0, 1), (1, 2)],
        hydrants=[1],
    )
    world = make_world(city, brigades=[0])
    brigades = world.state.brigades
    brigades.street[0], brigades.offset[0], brigades.x[0] = 0, 60_000, 40_000.0
    brigades.tank[0], brigades.refilling[0] = 0, 1
    burn(world, 0)
    act(world)
    assert (brigades.tank[0], brigades.activity[0], brigades.driven[0]) == (400, TO_REFUGE, 80_000)
