"""What a brigade sees: thresholds at their boundaries, the state index, the flags; and the targets of the actions."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from fireworld.kernels.observation import can_choose, find_named, find_target, level, observe, state_index, volume_class
from fireworld.policy.protocol import Decision
from fireworld.policy.words import RADIX
from fireworld.scenario.observed import Observed
from fireworld.simulation.city_arrays import observation_constants
from tests.kernels.small import METRE, burn, make_city, make_world, square

LINE = [square(50.0 * k, 0.0) for k in range(7)]


def see(world, brigade=0):
    """Return the features and the state of a brigade."""
    features = np.zeros(8, dtype=np.int64)
    state = observe(
        brigade,
        world.state.brigades.action,
        world.state.brigades.site,
        world.state.sites,
        world.constants.observation,
        features,
    )
    return features.tolist(), state


def chooses(world, brigade=0):
    brigades = world.state.brigades
    return can_choose(brigade, brigades.hp, brigades.refilling, world.state.sites.counts)


def target(world, action, brigade=0):
    arrays, tables = world.state, world.city_arrays
    return find_target(brigade, action, arrays.brigades, tables.buildings, arrays.fire, tables.geometry, arrays.sites)


def named(world, action):
    arrays, tables = world.state, world.city_arrays
    where = tables.buildings, tables.links, arrays.fire, tables.geometry, arrays.sites
    return find_named(0, action, arrays.brigades, *where, world.constants.observation)


def test_the_easiest_may_be_one_that_is_only_heated():
    city = make_city(*LINE, links={0: [1, 2, 3, 4], 5: [6]}, refuges=[4])
    plain, world = (
        make_world(city, brigades=[0], observed=None if key is None else Observed(easiest=key))
        for key in (None, "heated")
    )
    for one in (plain, world):
        energy, half = one.state.fire.energy, one.city_arrays.buildings.ignition_energy / 2
        energy[0] = 4 * half[0]
        energy[1:] = 0.99 * half[1:]
        energy[[2, 3, 4, 6]] = half[[2, 3, 4, 6]]  # 4 cannot burn, and to 6 nothing that burns is linked
        energy[3] *= 1.1
        one.state.fire.fieryness[3] = 4
        burn(one, 0)
    assert [named(plain, action) for action in range(4)] == [0, 0, 0, 0]
    assert [named(world, action) for action in range(4)] == [2, 0, 0, 0]
    world.state.fire.fieryness[2] = 8
    assert named(world, 0) == 3, "what has burned is not heated; what is wet may be"
    world.state.fire.energy[0] = world.city_arrays.buildings.ignition_energy[0] * 0.4
    assert named(world, 0) == 0, "one that burns may be the coolest"


def test_the_state_index_is_a_mixed_radix():
    for number, features in enumerate(itertools.product(*map(range, RADIX))):
        assert state_index(np.array(features, dtype=np.int64)) == number
    assert number == 4319
    assert state_index(np.array([4, 1, 2, 3, 1, 0, 1, 0])) == np.ravel_multi_index((4, 1, 2, 3, 1, 0, 1, 0), RADIX)


@pytest.mark.parametrize(("square_", "expected"), [(0.0, 0), (8.99, 0), (9.0, 1), (15.99, 1), (16.0, 2), (1e300, 2)])
def test_levels_begin_at_their_thresholds(square_, expected):
    assert level(square_, 9.0, 16.0) == expected


@pytest.mark.parametrize(
    ("volume", "expected"),
    [(0, 0), (9.99, 0), (10, 1), (19.99, 1), (20, 2), (40, 3), (79.99, 3), (80, 4), (159.99, 4), (160, 5), (1e9, 5)],
)
def test_volume_thresholds_double(volume, expected):
    assert volume_class(float(volume), 10.0, 2.0) == expected


@pytest.mark.parametrize(
    ("away_m", "expected"), [(29.999, 0), (30.0, 1), (79.999, 1), (80.0, 2), (1000.0, 2), (None, 2)]
)
def test_the_distance_from_a_civilian(away_m, expected):
    city = make_city(square(0, 0), square(5000, 0))
    civilians = [] if away_m is None else [(-1, 0, away_m)]
    world = make_world(city, civilians=civilians, brigades=[0])
    burn(world, 0)
    assert see(world)[0][2] == expected


@pytest.mark.parametrize(("burning", "expected"), [(0, 2), (1, 1), (2, 0), (3, 1), (4, 2)])
def test_the_distance_from_the_center(burning, expected):
    """The city spans 600 m x 10 m: thresholds at about 100 and 200 m from its middle, at 295 m."""
    city = make_city(*(square(x, 0) for x in (0, 100, 250, 450, 590)))
    world = make_world(city, brigades=[0])
    burn(world, burning)
    assert see(world)[0][1] == expected


def test_the_thresholds_of_the_center_are_thirds_of_the_half_diagonal():
    city = make_city(square(0, 0), square(290, 390))
    constants = observation_constants(city, unit_volume_m3=None, in_turn=True)
    assert city.half_diagonal_mm == 250_000.0
    assert constants.center_low_square == pytest.approx((250_000 / 3) ** 2)
    assert constants.center_medium_square == pytest.approx((500_000 / 3) ** 2)
    assert constants.unit_volume == 2 * 300.0, "by default twice the mean building, 10 m x 10 m x 3 m"
    assert observation_constants(city, unit_volume_m3=77.0, in_turn=True).unit_volume == 77.0


@pytest.mark.parametrize(("n_burning", "expected"), [(1, 0), (2, 1), (3, 1), (4, 2), (6, 2)])
def test_the_burning_volume_of_the_site(n_burning, expected):
    world = make_world(make_city(*LINE, links={k: [k + 1] for k in range(6)}), brigades=[0])
    burn(world, *range(n_burning))
    assert see(world)[0][3] == expected


def test_free_edges_counts_sides():
    around = [square(0, 0), square(0, 40), square(40, 0), square(0, -40), square(-40, 0)]
    world = make_world(make_city(*around, links={0: [1, 2, 3, 4]}), brigades=[0])
    for n_free in range(4, -1, -1):
        world.state.fire.fieryness[1:] = [0] * n_free + [8] * (4 - n_free)
        burn(world, 0)
        assert see(world)[0][0] == n_free


def test_a_brigade_without_a_fire_sees_nothing():
    world = make_world(make_city(*LINE), brigades=[0])
    burn(world)
    assert see(world) == ([0] * 8, -1)
    assert not chooses(world)
    assert target(world, 0) == -1


@pytest.mark.parametrize(("hp", "refilling", "expected"), [(1000, 0, True), (0, 0, False), (1000, 1, False)])
def test_the_dead_and_the_refilling_do_not_choose(hp, refilling, expected):
    world = make_world(make_city(*LINE), brigades=[0])
    burn(world, 0)
    world.state.brigades.hp[0], world.state.brigades.refilling[0] = hp, refilling
    assert chooses(world) == expected


class Scripted:
    """Takes actions from a script and remembers the flags it was shown."""

    def __init__(self, script):
        self.script, self.seen = script, []

    def decide(self, observation):
        self.seen.append((observation.step, observation.brigade, observation.others))
        return Decision(self.script[observation.step][observation.brigade])


def test_flags_tell_of_those_before_in_this_step_and_those_after_in_the_last():
    world = make_world(make_city(*LINE, refuges=[6]), ignited=[0], brigades=[6, 6, 6])
    policy = Scripted({1: [0, 1, 2], 2: [3, 3, 0]})
    world.step(policy)
    world.step(policy)
    no = False
    assert policy.seen == [
        (1, 0, (no, no, no, no)),  # nobody has done anything yet
        (1, 1, (True, no, no, no)),
        (1, 2, (True, True, no, no)),
        (2, 0, (no, True, True, no)),  # 1 and 2 as in step 1, not its own
        (2, 1, (no, no, True, True)),  # 0 in this step, 2 in the last
        (2, 2, (no, no, no, True)),
    ]


def test_a_refilling_brigade_counts_as_doing_nothing():
    world = make_world(make_city(*LINE, refuges=[6]), ignited=[0], brigades=[6, 6])
    policy = Scripted({1: [0, 1], 2: [2, 2]})
    world.step(policy)
    world.state.brigades.refilling[0] = 1
    world.step(policy)
    assert policy.seen[-1] == (2, 1, (False, False, False, False))
    assert world.state.brigades.action.tolist() == [-1, 2]
    assert world.state.brigades.target[0] == -1


def targets_world(**others):
    """Four burning buildings of one site, in a row of 50 m; the middle of the city is at x = 300 m."""
    outlines = [*LINE[:4], square(600, 0)]
    links = {k: [k + 1] for k in range(3)}
    world = make_world(make_city(*outlines, links=links, **others), brigades=[4], civilians=[(4, 600.0, 0.0)])
    world.state.fire.energy[:4] = world.city_arrays.buildings.capacity[:4] * np.array([300.0, 100.0, 200.0, 400.0])
    burn(world, 0, 1, 2, 3)
    return world


def test_the_four_actions_name_their_buildings():
    world = targets_world()
    brigades = world.state.brigades
    brigades.x[0], brigades.y[0] = -20.0 * METRE, 0.0
    world.state.sites.building_civilian_square[:4] = 9.0, 9.5, 1.0, 2.0
    assert [target(world, action) for action in range(4)] == [1, 2, 3, 0]


def test_the_civilian_nearest_to_a_building_counts():
    world = targets_world()
    assert target(world, 1) == 3
    world.state.civilians.x[0], world.state.civilians.y[0] = -5.0, 0.0
    burn(world, 0, 1, 2, 3)
    assert target(world, 1) == 0


@pytest.mark.parametrize("action", range(4))
def test_ties_go_to_the_lowest_id(action):
    world = targets_world(ids=[9, 4, 8, 3, 1])
    geometry = world.city_arrays.geometry
    geometry.x[:4] = 0.0
    geometry.center_square[:4] = 5.0
    world.state.sites.building_civilian_square[:4] = 7.0
    world.state.fire.energy[:4] = world.city_arrays.buildings.capacity[:4] * 60.0
    assert target(world, action) == 3


def test_without_civilians_that_action_names_the_lowest_id():
    world = targets_world(ids=[9, 4, 8, 3, 1])
    world.state.civilians.hp[:] = 0
    burn(world, 0, 1, 2, 3)
    assert target(world, 1) == 3


def test_targets_are_of_the_own_site():
    world = make_world(make_city(*LINE), brigades=[0])
    world.state.fire.energy[:] = world.city_arrays.buildings.capacity * 100.0
    world.state.fire.energy[6] = 1.0
    burn(world, 0, 6)
    world.state.brigades.site[0] = 1
    assert [target(world, action) for action in range(4)] == [0] * 4
    world.state.brigades.site[0] = 2
    assert [target(world, action) for action in range(4)] == [6] * 4
