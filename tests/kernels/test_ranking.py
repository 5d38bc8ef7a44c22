"""What a brigade sees of a target, each figure worked out by hand; and which target it puts first."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fireworld.kernels.network import AT_ONCE
from fireworld.kernels.ranking import (
    N_OF_BUILDING,
    N_TARGET_FEATURES,
    N_WEIGHTS,
    OWN_TARGET,
    describe_building,
    describe_target,
    others_at,
)
from fireworld.kernels.ranks import fresh_ranks, rank
from fireworld.parameters import PAPER
from fireworld.policy.kernel import NO_NETWORK
from fireworld.policy.protocol import Action
from fireworld.policy.teams.ranking_words import OF_BUILDING, WEIGHTS
from fireworld.records import ACTION_NAMES, ACTIONS
from tests.kernels.small import METRE, burn, make_city, make_world, sight_of, square

NAMES = [weight.name for weight in WEIGHTS]
POWER = PAPER.brigades.power_litres  # 2000 litres in a step
LITRE = 20.0  # heat that it takes from a burning building


def weights(**named):
    """Weights of zero but for those named."""
    found = np.zeros(N_WEIGHTS)
    for name, weight in named.items():
        found[NAMES.index(name)] = weight
    return found


def describe(world, b=0):
    """The features of a building that all brigades see alike, by name."""
    tables, arrays, out = world.city_arrays, world.state, np.full(N_OF_BUILDING, np.nan)
    power = world.constants.brigades.power
    fire_constants = world.constants.fire
    describe_building(
        b, tables.buildings, tables.links, tables.geometry, arrays.fire, arrays.sites, fire_constants, power, out
    )
    return dict(zip((weight.name for weight in OF_BUILDING), out.tolist(), strict=True))


def see(world, name, *, b=0, brigade=0, known=None):
    """A feature of a building as a brigade sees it."""
    tables, arrays, out = world.city_arrays, world.state, np.full(N_TARGET_FEATURES, np.nan)
    known = np.full(world.n_brigades, -1, dtype=np.int32) if known is None else np.array(known, dtype=np.int32)
    described = np.array(list(describe(world, b).values()))
    range_square = world.constants.brigades.range_square
    here, near = others_at(b, brigade, known, tables.geometry)
    describe_target(brigade, b, here, near, described, arrays.brigades, tables.geometry, range_square, out)
    return out[NAMES.index(name)]


def one_fire(**others):
    """A burning building at the origin, and a refuge far off with a brigade."""
    world = make_world(make_city(square(0, 0), square(2000, 0), refuges=[1]), brigades=[1], **others)
    burn(world, 0)
    return world


def heat_up(world, b, degrees):
    world.state.fire.energy[b] = world.city_arrays.buildings.capacity[b] * degrees


def need_litres(world, b, litres):
    """Let a building be so hot that so much water cools it to its ignition point."""
    buildings = world.city_arrays.buildings
    world.state.fire.energy[b] = buildings.ignition_point[b] * buildings.capacity[b] + litres * LITRE


def test_the_names_of_code_and_recordings_are_the_kernels():
    assert len(WEIGHTS) == N_WEIGHTS == 17
    assert len(set(NAMES)) == N_WEIGHTS
    assert tuple(NAMES[N_TARGET_FEATURES:]) == ACTIONS
    assert ACTION_NAMES[OWN_TARGET] == "own-target"
    assert Action.OWN_TARGET == OWN_TARGET == len(ACTIONS)


@pytest.mark.parametrize(("degrees", "expected"), [(0, 0.0), (50, 0.1), (500, 1.0), (1250, 2.5)])
def test_temperature(degrees, expected):
    world = one_fire()
    heat_up(world, 0, degrees)
    assert describe(world)["temperature"] == pytest.approx(expected)


@pytest.mark.parametrize(
    ("side_m", "floors", "expected"), [(10, 30, 3.0), (20, 30, 6.0), (10, 1, 0.3**0.5)], ids=["9000", "36000", "300"]
)
def test_volume(side_m, floors, expected):
    """Storeys of 3 m: 10 m x 10 m x 90 m are 9000 m3."""
    world = make_world(make_city(square(0, 0, side_m), floors=[floors]), brigades=[0])
    assert describe(world)["volume"] == pytest.approx(expected)


def test_fuel_left():
    world = one_fire()
    assert describe(world)["fuel_left"] == 1.0
    world.state.fire.fuel[0] = world.city_arrays.buildings.initial_fuel[0] / 4
    assert describe(world)["fuel_left"] == 0.25


@pytest.mark.parametrize(
    ("civilians_m", "expected"), [([0], 0.0), ([150], 1.5), ([250, 80], 0.8), ([300], 3.0), ([301], 3.0), ([], 3.0)]
)
def test_civilian_distance(civilians_m, expected):
    world = one_fire(civilians=[(-1, 0.0, away) for away in civilians_m])
    assert describe(world)["civilian_distance"] == expected


def test_a_civilian_who_is_in_a_fire_or_dead_is_not_near():
    world = one_fire(civilians=[(0, 0.0, 0.0), (-1, 0.0, 20.0), (-1, 0.0, 120.0)])
    world.state.civilians.hp[1] = 0
    burn(world, 0)
    assert describe(world)["civilian_distance"] == 1.2


def exposed_world():
    """Building 0 sends a quarter of its rays to each of 1 to 4, of which 4 is a refuge and cannot burn."""
    outlines = [square(60.0 * k, 0.0) for k in range(5)]
    world = make_world(make_city(*outlines, links={0: [1, 2, 3, 4], 1: [0]}, refuges=[4]), brigades=[4])
    burn(world, 0)
    return world


def test_exposure_and_kindling():
    world = exposed_world()
    assert (describe(world)["exposure"], describe(world)["kindling"]) == (3 * 0.75, 0.0), "cold ones kindle nothing"
    heat_up(world, 1, 47 / 2)
    heat_up(world, 2, 47 * 3)
    heat_up(world, 4, 47)
    seen = describe(world)
    assert seen["exposure"] == 2.25
    assert seen["kindling"] == pytest.approx(5 * (0.25 * 0.5 + 0.25 * 1.0)), "what is hotter than ignition counts as 1"


@pytest.mark.parametrize(("code", "counts"), [(0, True), (4, True), *((k, False) for k in (1, 2, 3, 5, 6, 7, 8))])
def test_only_what_never_burned_is_exposed(code, counts):
    world = exposed_world()
    heat_up(world, 1, 47)
    world.state.fire.fieryness[1] = code
    seen = describe(world)
    assert (seen["exposure"], seen["kindling"]) == pytest.approx((2.25, 1.25) if counts else (1.5, 0.0))


def test_without_links_nothing_is_exposed():
    seen = describe(one_fire())
    assert (seen["exposure"], seen["kindling"]) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("litres", "lying", "expected"),
    [
        (4 * POWER, 0, 2.0),
        (4 * POWER, 3 * POWER, 1.0),
        (4 * POWER, 4 * POWER, 0.0),
        (4 * POWER, 9 * POWER, 0.0),
        (POWER / 4, 0, 0.5),
        (0, 0, 0.0),
        (-POWER, 0, 0.0),
    ],
)
def test_steps_needed(litres, lying, expected):
    world = one_fire()
    need_litres(world, 0, litres)
    world.state.fire.water[0] = lying
    assert describe(world)["steps_needed"] == pytest.approx(expected, abs=1e-5)


def test_steps_needed_without_pumps():
    world = one_fire(parameters=replace(PAPER, brigades=replace(PAPER.brigades, power_litres=0)))
    need_litres(world, 0, 2500)
    assert describe(world)["steps_needed"] == pytest.approx(50.0), "as if they gave a litre"


@pytest.mark.parametrize(
    ("away_m", "in_range", "beyond"),
    [
        (0, 1.0, 0.0),
        (50, 1.0, 0.0),
        (50.001, 0.0, 0.00001),
        (60, 0.0, 0.1),
        (150, 0.0, 1.0),
        (350, 0.0, 3.0),
        (900, 0.0, 3.0),
    ],
)
def test_range(away_m, in_range, beyond):
    """The pumps reach 50 m, exactly at the range included."""
    world = one_fire()
    world.state.brigades.x[0], world.state.brigades.y[0] = 0.6 * away_m * METRE, -0.8 * away_m * METRE
    assert see(world, "in_range") == in_range
    assert see(world, "beyond_range") == pytest.approx(beyond, abs=1e-12)


def test_mine_is_what_the_brigade_itself_went_for():
    world = make_world(make_city(square(0, 0), square(60, 0)), brigades=[0, 0])
    burn(world, 0, 1)
    world.state.brigades.target[:] = 0, 1
    assert [[see(world, "mine", b=b, brigade=brigade) for b in (0, 1)] for brigade in (0, 1)] == [[1, 0], [0, 1]]


def row(*x_m):
    """Burning buildings at these places, and five brigades; one site or many, the features do not care."""
    world = make_world(make_city(*(square(x, 0) for x in x_m)), brigades=[0] * 5)
    burn(world, *range(len(x_m)))
    return world


@pytest.mark.parametrize(
    ("known", "here", "near"),
    [
        ([-1, -1, -1, -1, -1], 0, 0.0),
        ([0, -1, -1, -1, -1], 0, 0.0),  # its own last target tells it nothing of others
        ([-1, 0, -1, -1, -1], 1, 1.0),
        ([-1, 0, 0, -1, 0], 3, 3.0),
        ([0, 1, -1, -1, -1], 0, 0.5),
        ([0, 2, -1, -1, -1], 0, 0.2),
        ([2, 0, 1, 2, -1], 1, 1.7),
        ([2, 3, 3, 3, 3], 0, 4 / 401),
    ],
)
def test_what_the_others_go_for(known, here, near):
    world = row(0, 50, 100, 1000)
    assert see(world, "others_here", known=known) == here
    assert see(world, "others_near", known=known) == pytest.approx(near)


def test_a_brigade_is_no_other_of_its_own():
    world = row(0, 50, 100)
    assert see(world, "others_here", brigade=3, known=[-1, -1, -1, 0, 0]) == 1
    assert see(world, "others_here", brigade=4, known=[-1, -1, -1, 0, 0]) == 1
    assert see(world, "others_here", brigade=0, known=[-1, -1, -1, 0, 0]) == 2


@pytest.mark.parametrize(
    ("steps", "n_others", "expected"),
    [(0.9, 0, 0), (0.9, 1, 1), (1.1, 1, 0), (1.1, 2, 1), (3.9, 3, 0), (3.9, 4, 1), (0, 0, 0), (0, 1, 1)],
)
def test_enough(steps, n_others, expected):
    world = row(0, 500)
    need_litres(world, 0, steps * POWER)
    assert see(world, "enough", known=[1, *([0] * n_others), *([1] * (4 - n_others))]) == expected
    assert see(world, "enough", b=1, known=[-1] * 5) == 0


def ask(world, weighing, *, own, brigade=0, known=None, step=1, sight=None):
    """What the brigade puts first, and the five values."""
    values = np.zeros(5)
    known = np.full(world.n_brigades, -1, dtype=np.int32) if known is None else np.array(known, dtype=np.int32)
    action, target = rank(
        brigade,
        own,
        step,
        known,
        weighing,
        NO_NETWORK,
        sight or sight_of(world),
        fresh_ranks(world.n_brigades, world.city.n_buildings),
        np.full((AT_ONCE, N_WEIGHTS), np.nan),
        np.zeros((2, 0)),
        values,
    )
    return (int(action), int(target)), values.tolist()


def five_burn(**others):
    """One site of five in a row of 40 m at 100, 200, ... degrees; named are 0, 4 (a civilian), 2 and 1, 3 is not."""
    outlines = [*(square(40.0 * k, 0.0) for k in range(5)), square(-440, 0), square(600, 0)]
    links = {k: [k + 1] for k in range(4)}
    world = make_world(
        make_city(*outlines, links=links, refuges=[5], **others), brigades=[5, 5], civilians=[(-1, 200.0, 0.0)]
    )
    for k in range(5):
        heat_up(world, k, 100.0 * (k + 1))
    burn(world, *range(5))
    world.state.brigades.x[:], world.state.brigades.y[:] = 41.0 * METRE, 0.0
    return world


def test_named_targets_have_the_weight_of_their_action():
    world = five_burn()
    hot = weights(temperature=1.0)
    assert ask(world, hot, own=False) == ((1, 4), pytest.approx([0.2, 1.0, 0.6, 0.4, 1.0]))
    hot[N_TARGET_FEATURES:] = 0.9, 0.0, 0.45, 0.5
    assert ask(world, hot, own=False) == ((0, 0), pytest.approx([1.1, 1.0, 1.05, 0.9, 1.1]))


def test_own_targets_are_all_burning_buildings_and_no_action_counts():
    world = five_burn()
    heat_up(world, 3, 900)
    hot = weights(temperature=1.0)
    hot[N_TARGET_FEATURES:] = 100.0
    assert ask(world, hot, own=True) == ((OWN_TARGET, 3), pytest.approx([0.2, 1.0, 0.6, 0.4, 1.8]))
    assert ask(world, -hot, own=True)[0] == (OWN_TARGET, 0)


def test_values_add_up():
    world = five_burn()
    weighing = weights(temperature=2.0, in_range=0.25, beyond_range=-1.0, others_here=-0.5, fuel_left=3.0)
    _, values = ask(world, weighing, own=True, known=[-1, 2])
    # 0: 41 m away; 4: 119 m, which is 69 m beyond the range; 2: 39 m, the other goes for it; 1: 1 m
    assert values[:4] == pytest.approx([0.4 + 3.25, 2.0 + 3 - 0.69, 1.2 + 3.25 - 0.5, 0.8 + 3.25])


def test_ties_of_named_targets_go_to_the_lowest_action():
    world = five_burn(ids=[9, 8, 7, 6, 5, 4, 3])
    nothing = weights()
    assert ask(world, nothing, own=False) == ((0, 0), [0.0] * 5)
    nothing[N_TARGET_FEATURES:] = 0, 1, 1, 0
    assert ask(world, nothing, own=False)[0] == (1, 4)


def test_ties_of_own_targets_go_to_the_lowest_id():
    assert ask(five_burn(), weights(), own=True)[0] == (OWN_TARGET, 0)
    assert ask(five_burn(ids=[9, 8, 2, 6, 5, 4, 3]), weights(), own=True)[0] == (OWN_TARGET, 2)
    assert ask(five_burn(ids=[9, 8, 7, 2, 5, 1, 0]), weights(), own=True)[0] == (OWN_TARGET, 3), "5 and 6 do not burn"


def test_only_the_own_site_is_ranked():
    world = make_world(make_city(square(0, 0), square(600, 0), square(660, 0)), brigades=[0])
    burn(world, 0, 1)
    heat_up(world, 0, 100)
    heat_up(world, 1, 900)
    hot = weights(temperature=1.0)
    for own in (True, False):
        for site, target in ((1, 0), (2, 1)):
            world.state.brigades.site[0] = site
            assert ask(world, hot, own=own)[0][1] == target


def test_with_free_allocation_own_targets_are_those_of_all_sites():
    """The four that actions name stay those of its site."""
    outlines = [square(0, 0), square(600, 0), square(660, 0)]
    world = make_world(make_city(*outlines), brigades=[0], free=True)
    burn(world, 0, 1)
    for b, degrees in ((0, 100), (1, 900)):
        heat_up(world, b, degrees)
    world.state.brigades.site[0] = 1
    hot = weights(temperature=1.0)
    assert ask(world, hot, own=True) == ((OWN_TARGET, 1), pytest.approx([0.2, 0.2, 0.2, 0.2, 1.8]))
    assert ask(world, -hot, own=True)[0] == (OWN_TARGET, 0)
    assert ask(world, hot, own=False)[0] == (0, 0)


@pytest.mark.parametrize("own", [True, False])
def test_without_a_site_nothing_is_chosen(own):
    world = make_world(make_city(square(0, 0)), brigades=[0])
    burn(world)
    assert ask(world, weights(temperature=1.0), own=own)[0] == (-1, -1)


def test_what_is_known_of_a_building_is_worked_out_once_a_step():
    world = five_burn()
    sight = sight_of(world)
    hot = weights(temperature=1.0)
    assert ask(world, hot, own=True, sight=sight)[0] == (OWN_TARGET, 4)
    heat_up(world, 2, 2000)
    assert ask(world, hot, own=True, brigade=1, sight=sight)[0] == (OWN_TARGET, 4), "the same step"
    assert ask(world, hot, own=True, step=2, sight=sight)[0] == (OWN_TARGET, 2)
