"""The damage model: hand-worked numbers, and the official program's own."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fireworld.draws import DAMAGE, uniform
from fireworld.kernels.health import expose, harm, worsen
from fireworld.kernels.step import hurt
from fireworld.parameters import HealthParameters
from fireworld.simulation.city_arrays import health_constants
from tests.kernels.small import burn, make_city, make_world, square
from tests.reference.traces import TRACES

OFFICIAL = health_constants(HealthParameters())
QUIET = OFFICIAL._replace(noise_sd=0.0)  # the noise is its mean
MISC = np.load(TRACES / "misc.npz")
CODES = np.arange(9, dtype=np.uint8)


def suffer(hp, damage, *, building=-1, constants=QUIET, share=1.0, step=1, seed=1):
    """Advance one person by a step; return HP and damage."""
    hp, damage = np.array([hp], dtype=np.int32), np.array([float(damage)])
    inside = np.array([building], dtype=np.int32)
    harm(inside, hp, damage, CODES, constants, share, seed, step, np.int64(0))
    return int(hp[0]), float(damage[0])


@pytest.mark.parametrize(
    ("draw", "expected"),
    [(0.0, 5), (0.399, 5), (0.4, 20), (0.599, 20), (0.601, 100), (0.699, 100), (0.701, 0), (0.999, 0)],
)
def test_the_three_damages_exclude_each_other(draw, expected):
    assert expose(draw, OFFICIAL) == expected


def test_damage_grows():
    """20 + 0.00025 * 400 + 0.03 + 0.1 = 20.23."""
    assert worsen(20.0, 0.1, OFFICIAL) == pytest.approx(20.23)
    assert worsen(0.0, 0.1, OFFICIAL) == 0.0, "none stays none"
    assert suffer(1000, 20.0) == (980, pytest.approx(20.23))


@pytest.mark.parametrize(("grown", "lost"), [(0.49, 0), (0.5, 1), (1.49, 1), (1.5, 2)])
def test_damage_is_rounded_half_up(grown, lost):
    still = QUIET._replace(growth=0.0, constant=0.0, noise_mean=0.0)
    assert suffer(100, grown, constants=still) == (100 - lost, grown)


def test_the_dead_stay_dead():
    assert suffer(3, 50.0)[0] == 0
    assert suffer(0, 50.0) == (0, 50.0)


@pytest.mark.parametrize("damage", [1e9, 1e30, 1e300])
def test_damage_beyond_all_bounds_kills(damage):
    assert suffer(1_000_000, damage)[0] == 0


def test_noise_never_heals():
    assert suffer(500, 1.0, constants=QUIET._replace(noise_mean=-1000.0))[0] == 500


@pytest.mark.parametrize("code", range(9))
def test_only_a_burning_building_hurts(code):
    """Some step within fifty hurts a person in a building of codes 1 to 3; none hurts in another."""
    hurt = any(suffer(1000, 0.0, building=code, step=step)[1] > 0 for step in range(1, 51))
    assert hurt == (1 <= code <= 3)


def test_exposure_comes_from_the_keyed_draw():
    for step in range(1, 30):
        exposure = expose(uniform(7, DAMAGE, 0, step), OFFICIAL)
        assert suffer(10_000, 0.0, building=1, step=step, seed=7)[1] == worsen(exposure, 0.1, OFFICIAL)
        brigade = suffer(10_000, 0.0, building=1, step=step, seed=7, share=0.2)
        assert brigade[1] == worsen(exposure * 0.2, 0.1, OFFICIAL), "brigades take a fifth"


@pytest.mark.parametrize("row", range(3))
def test_the_official_course_of_damage(row):
    """The official program with its mean noise: damage, its rounding and HP over 300 steps."""
    hp, damage = 10_000, float(MISC["initial_damage"][row])
    for step in range(301):
        assert damage == pytest.approx(MISC["damage"][0, row, step], rel=1e-12)
        assert math.floor(damage + 0.5) == MISC["damage_rounded"][0, row, step]
        assert hp == MISC["hp"][0, row, step]
        hp, damage = suffer(hp, damage)


def test_the_official_step_of_death():
    deaths = MISC["death_step"][0]
    n = len(deaths)
    hp, damage = np.full(n, 10_000, dtype=np.int32), np.arange(n, dtype=np.float64)
    died = np.full(n, -1)
    for step in range(1, 301):
        harm(np.full(n, -1, dtype=np.int32), hp, damage, CODES, QUIET, 1.0, 1, step, np.int64(0))
        died[(hp == 0) & (died < 0)] = step
    np.testing.assert_array_equal(died, deaths)


@pytest.mark.parametrize("row", range(6))
def test_exposed_people_fare_like_the_official_ones(row):
    """20000 people with keyed draws, 1 to 300 steps inside fire: survivors and mean HP within sampling error."""
    n, steps = 20_000, int(MISC["exposure_steps"][row])
    hp, damage = np.full(n, 10_000, dtype=np.int32), np.zeros(n)
    for step in range(1, 301):
        building = np.full(n, 2 if step <= steps else -1, dtype=np.int32)
        harm(building, hp, damage, CODES, OFFICIAL, 1.0, row, step, np.int64(0))
        spread = hp.std() * math.sqrt(1 / 4000 + 1 / n)
        assert abs(hp.mean() - MISC["mc_mean_hp"][row, step]) <= 4.5 * spread + 1e-9
    share, official = (hp > 0).mean(), (MISC["mc_final_hp"][row] > 0).mean()
    assert abs(share - official) <= 4 * math.sqrt(share * (1 - share) / 4000) + 1e-9


def test_who_is_where_meets_the_fire_of_the_step():
    """A civilian in a burning building is hurt by and by, one next door is not, nor is a brigade outdoors."""
    city = make_city(square(0, 0), square(15, 0), square(60, 0), refuges=[2])
    world = make_world(city, civilians=[(0, 0, 0), (1, 15, 0), (-1, 5, 5)], brigades=[2])
    burn(world, 0)
    state = world.state
    for step in range(1, 40):
        hurt(state.fire, state.civilians, state.brigades, world.constants.health, world.seed, step)
    hp = world.state.civilians.hp
    assert hp[0] == 0
    assert hp[1:].tolist() == [1000, 1000]
    assert world.state.brigades.hp.tolist() == [1000]
