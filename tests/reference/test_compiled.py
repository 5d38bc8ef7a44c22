"""The compiled kernels compute what the numpy reference computes: fires with water, health, requests."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fireworld.city.build import build_city
from fireworld.city.generator import generate_plan
from fireworld.draws import DAMAGE, DAMAGE_NOISE
from fireworld.kernels import brigades as brigade_kernels
from fireworld.kernels import fire as kernels
from fireworld.kernels.draws import normal, uniform
from fireworld.kernels.health import harm
from fireworld.kernels.warmth import fresh_warmth
from fireworld.parameters import OFFICIAL_2011, FireParameters, HealthParameters
from fireworld.simulation.city_arrays import (
    air_inside,
    brigade_constants,
    building_arrays,
    cover_arrays,
    fire_constants,
    health_constants,
    link_arrays,
)
from fireworld.simulation.state import fresh_fire
from tests.reference import brigades, fire, people

PLAN = generate_plan(columns=9, rows=8, seed=4)


@pytest.fixture(scope="module")
def city():
    return build_city(PLAN, FireParameters(), seed=4)


@pytest.mark.parametrize(
    "parameters",
    [
        FireParameters(),
        FireParameters(flush_temperature=0.001),
        FireParameters(flush_temperature=0.001, air_to_air_flow=0.5, air_heat_kept=0.95, water_unburnt_share=0.5),
    ],
)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_fire(city, parameters, seed):
    """Scattered fires, water on burning and cold buildings, other burn rates for all: 120 steps, no difference."""
    random = np.random.default_rng(seed)
    n = city.n_buildings
    tables = fire.FireTables.of_city(city, parameters)
    expected = fire.FireState.cold(tables)
    buildings, cover, links = building_arrays(city, parameters), cover_arrays(city, parameters), link_arrays(city)
    constants, state = fire_constants(parameters), fresh_fire(city)
    for step in range(120):
        if step in (0, 30):
            chosen = random.choice(n, 3, replace=False)
            fire.ignite(tables, expected, chosen)
            for b in chosen:
                kernels.ignite(int(b), buildings, state)
        for b in random.choice(n, 2, replace=False):
            litres = int(random.integers(0, 4000)) * (step % 3 == 0)
            fire.pour(expected, b, litres)
            state.water[b] += litres
            state.watered[b] = 1
        rate = random.normal(0.15, 0.02, n)
        state.rate[:] = rate
        fire.advance_fire(tables, expected, rate)
        kernels.advance_fire(buildings, cover, links, state, constants, fresh_warmth(n, state.air.shape))
        np.testing.assert_array_equal(state.fieryness, expected.fieryness, err_msg=f"step {step}")
        np.testing.assert_array_equal(state.fuel, expected.fuel)
        np.testing.assert_array_equal(state.water, expected.water)
        np.testing.assert_allclose(state.energy, expected.energy, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(air_inside(city, state.air), expected.cells, rtol=1e-9, atol=1e-12)
    assert len(set(expected.fieryness)) >= 5, "the fire has been through many codes"


def test_air_beyond_the_cells_stays_empty(city):
    state = fresh_fire(city)
    state.energy[:] = 1e6
    buildings, cover, links = (
        building_arrays(city, FireParameters()),
        cover_arrays(city, FireParameters()),
        link_arrays(city),
    )
    warmth = fresh_warmth(city.n_buildings, state.air.shape)
    for _ in range(5):
        kernels.advance_fire(buildings, cover, links, state, fire_constants(FireParameters()), warmth)
    inside = state.air.copy()
    air_inside(city, inside)[:] = 0.0
    assert air_inside(city, state.air).all()
    assert not inside.any()


@pytest.mark.parametrize("share", [1.0, 0.2])
def test_health(share):
    """300 steps of 500 people in and out of burning buildings, with the draws that the kernel makes."""
    parameters = replace(HealthParameters(), initial_hp=1000)
    n, seed, first = 500, 7, 40
    codes = np.arange(9, dtype=np.uint8)
    building = (np.arange(n) % 10 - 1).astype(np.int32)
    hp, damage = np.full(n, 1000, dtype=np.int32), np.zeros(n)
    expected_hp, expected_damage = hp.copy(), damage.copy()
    exposed = np.isin(building, (1, 2, 3))
    for step in range(1, 301):
        draw = np.array([uniform(seed, DAMAGE, first + k, step) for k in range(n)])
        deviate = np.array([normal(seed, DAMAGE_NOISE, first + k, step) for k in range(n)])
        exposure = np.where(exposed, people.expose(draw, parameters, share=share), 0.0)
        noise = parameters.noise_mean + parameters.noise_sd * deviate
        people.suffer(expected_hp, expected_damage, exposure, noise, parameters)
        harm(building, hp, damage, codes, health_constants(parameters), share, seed, step, first)
        np.testing.assert_array_equal(hp, expected_hp, err_msg=f"step {step}")
        np.testing.assert_allclose(damage, expected_damage, rtol=1e-12)
    assert not hp[exposed].any()
    assert np.all(hp[~exposed] == 1000)


@given(
    st.lists(st.integers(-200, 700), min_size=1, max_size=4),
    st.integers(0, 900),
    st.tuples(st.integers(-60_000, 60_000), st.integers(-60_000, 60_000)),
)
@settings(max_examples=300)
def test_requests(litres, tank, target_mm):
    parameters = OFFICIAL_2011.brigades
    constants = brigade_constants(parameters)
    team = brigades.Brigades.with_tanks(np.array([3]), np.array([tank]))
    square = float(target_mm[0] ** 2 + target_mm[1] ** 2)
    for amount in litres:
        accepted, left = int(team.accepted_litres[0]), int(team.tank_litres[0])
        expected = brigades.request(team, parameters, brigade_id=3, target_mm=target_mm, litres=amount)
        assert brigade_kernels.judge_request(amount, accepted, left, square, constants) == expected
