"""The numpy engine is the official program: its traces, hand-worked numbers and what must hold of any state."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fireworld.city.city import AirCells
from fireworld.parameters import OFFICIAL_2013, FireParameters, HealthParameters
from tests.reference import brigades, fire, people, traces

pytestmark = pytest.mark.slow

MISC = np.load(traces.TRACES / "misc.npz")
MINI = traces.Trace.named("mini").tables()
OFFICIAL_HEALTH = HealthParameters()


def states(trace: traces.Trace, tables: fire.FireTables) -> Iterator[fire.FireState]:
    return (row.fire for row in traces.replay(trace, tables))


@pytest.mark.parametrize("name", traces.CITIES)
def test_every_trace_is_reproduced(name):
    trace = traces.Trace.named(name)
    expected = trace.arrays
    row_of = {int(step): row for row, step in enumerate(trace.kept_steps)}
    air_of = {int(step): row for row, step in enumerate(expected["air_t"])}
    for step, seen in enumerate(states(trace, trace.tables())):
        np.testing.assert_array_equal(seen.fieryness, expected["fieryness"][step], err_msg=f"step {step}")
        if step in row_of:
            row = row_of[step]
            energy = expected["energy"][row]
            assert np.all(np.abs(seen.energy - energy) <= 1e-9 * np.maximum(np.abs(energy), 1.0)), step
            np.testing.assert_array_equal(seen.fuel, expected["fuel"][row])
            np.testing.assert_array_equal(seen.water, expected["water"][row])
            if "ever_watered" in expected:
                np.testing.assert_array_equal(seen.watered, expected["ever_watered"][row])
        if step in air_of:
            np.testing.assert_allclose(seen.cells, expected["air"][air_of[step]], rtol=1e-9, atol=1e-9)


def test_requests_and_tanks_are_those_of_the_trace():
    trace = traces.Trace.named("mini_brigades")
    results = []
    for step, seen in enumerate(traces.replay(trace, trace.tables())):
        np.testing.assert_array_equal(seen.tank_litres, trace.arrays["tank"][step], err_msg=f"step {step}")
        results += seen.results
    assert results == trace.arrays["requests"][:, 4].tolist()
    assert set(results) == {1, -1, -2, -3, -4, -5}


def test_another_order_is_noticed():
    """The traces can tell a wrong order of the air exchange from the right one."""
    trace = traces.Trace.named("grid_dry")
    backwards = replace(trace, arrays=trace.arrays | {"order": trace.arrays["order"][::-1]})
    codes = [state.fieryness.copy() for state in states(backwards, backwards.tables())]
    assert np.count_nonzero(np.array(codes) != trace.arrays["fieryness"]) > 100


@st.composite
def exchanges(draw):
    """A few buildings over a small grid, in some order."""
    shape = draw(st.tuples(st.integers(1, 4), st.integers(1, 4)))
    cells = [(x, y) for x in range(shape[0]) for y in range(shape[1])]
    covers = draw(st.lists(st.lists(st.sampled_from(cells), min_size=1, unique=True), min_size=1, max_size=6))
    order = draw(st.permutations(range(len(covers))))
    flat = [cell for building in covers for cell in sorted(building)]
    air = AirCells(
        origin_mm=(0, 0),
        cell_mm=5000,
        shape=shape,
        ptr=np.cumsum([0, *map(len, covers)], dtype=np.int32),
        x=np.array([x for x, _ in flat], dtype=np.int32),
        y=np.array([y for _, y in flat], dtype=np.int32),
        percent=np.array(draw(st.lists(st.integers(1, 100), min_size=len(flat), max_size=len(flat))), dtype=np.int32),
    )
    return air, np.array(order), draw(st.integers(0, 2**32 - 1))


@given(exchanges())
@settings(max_examples=100)
def test_ranks_give_exactly_what_one_building_after_another_gives(exchange):
    air, order, seed = exchange
    parameters = FireParameters()
    n = len(order)
    ones = np.ones(n, dtype=np.float32)
    links = traces.Links(np.zeros(n + 1, np.int32), np.zeros(0, np.int32), np.zeros(0, np.float32))
    tables = fire.FireTables.of_arrays(
        capacity=100 * ones,
        initial_fuel=ones,
        ignition_point=47 * ones,
        inflammable=ones,
        wall_area_m2=ones,
        order=order,
        air=air,
        links=links,
        parameters=parameters,
    )
    state = fire.FireState.cold(tables)
    random = np.random.default_rng(seed)
    state.energy[:] = random.uniform(0, 1e5, n)
    state.cells[:] = random.uniform(0, 500, air.shape)

    cells, energy = state.cells.copy(), state.energy.copy()
    flow = float(np.float32(parameters.air_to_building_flow))
    for b in order:
        temperature = energy[b] / 100.0
        gain = 0.0
        for k in range(air.ptr[b], air.ptr[b + 1]):
            x, y = air.x[k], air.y[k]
            q = (cells[x, y] - temperature) * (flow * (air.percent[k] / 100.0) * 5000)
            cells[x, y] -= q / tables.cell_capacity
            gain += q
        energy[b] += gain

    fire.exchange_with_air(tables, state)
    np.testing.assert_array_equal(state.cells, cells)
    np.testing.assert_allclose(state.energy, energy, rtol=1e-12, atol=1e-9)  # the gains are summed in another order


def test_cover_is_a_share_and_a_cell_gives_what_a_building_gains():
    """Cover 40 %: (100 - 0) * 0.0015 * 0.4 * 5000 = 300, and a cell holds 0.004 * 5000 = 20 a degree: 15 degrees."""
    air = AirCells((0, 0), 5000, (1, 1), np.array([0, 1]), np.array([0]), np.array([0]), np.array([40]))
    one = np.ones(1, np.float32)
    links = traces.Links(np.zeros(2, np.int32), np.zeros(0, np.int32), np.zeros(0, np.float32))
    tables = fire.FireTables.of_arrays(
        capacity=one,
        initial_fuel=one,
        ignition_point=one,
        inflammable=one,
        wall_area_m2=one,
        order=np.array([0]),
        air=air,
        links=links,
        parameters=FireParameters(),
    )
    state = fire.FireState.cold(tables)
    state.cells[:] = 100.0
    fire.exchange_with_air(tables, state)
    assert state.energy[0] == pytest.approx(300.0)
    assert state.cells[0, 0] == pytest.approx(85.0)


@pytest.mark.parametrize(
    ("fuel_share", "hot", "watered", "expected"),
    [
        (1.0, False, False, 0),
        (1.0, True, False, 1),
        (0.5, True, True, 2),
        (0.1, True, False, 3),
        (1.0, False, True, 4),
        (0.7, False, False, 5),
        (0.5, False, True, 6),
        (0.1, False, False, 7),
        (0.0, False, True, 8),
        (0.0, True, False, 8),
    ],
)
def test_codes(fuel_share, hot, watered, expected):
    state = fire.FireState.cold(MINI)
    state.fuel[:] = MINI.initial_fuel * np.float32(fuel_share)
    state.energy[:] = MINI.capacity * 50.0 * hot
    state.watered[:] = watered
    np.testing.assert_array_equal(fire.code(MINI, state), np.where(MINI.inflammable, expected, 0))


def test_ignition_acts_on_codes_0_and_4_only():
    state = fire.FireState.cold(MINI)
    state.watered[1] = True
    state.fuel[2] /= 2
    state.fieryness = fire.code(MINI, state)
    refuge = int(np.flatnonzero(~MINI.inflammable)[0])
    fire.ignite(MINI, state, np.array([0, 1, 2, refuge]))
    assert state.energy[[0, 1]] / MINI.capacity[[0, 1]] == pytest.approx(70.5)
    assert not state.energy[[2, refuge]].any()


def test_cooling_by_hand():
    """20 a litre on a burning building, 4 on another; what is too much stays; cold buildings keep all of it."""
    state = fire.FireState.cold(MINI)
    state.energy[:4] = (MINI.capacity * 100)[:4]
    state.energy[1:3] = (100.0, 41.0)
    state.energy[3] = -1.0
    before = state.energy.copy()
    state.water[:4] = (10, 10, 12, 5)
    fire.cool(MINI, state)
    assert before[0] - state.energy[0] == pytest.approx(200.0)
    assert before[1] - state.energy[1] == pytest.approx(40.0)
    assert state.energy[2] == pytest.approx(0.0, abs=1e-9)
    assert state.energy[3] == -1.0
    assert state.water[:4].tolist() == [0, 0, 2, 5]  # 10.25 litres needed: 10 used


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 0.5))
@settings(max_examples=60)
def test_fuel_never_rises_and_water_is_never_made(seed, rate):
    random = np.random.default_rng(seed)
    n = len(MINI.capacity)
    state = fire.FireState.cold(MINI)
    state.energy[:] = random.uniform(0, 300, n) * MINI.capacity * random.integers(0, 2, n)
    state.fuel *= random.uniform(0, 1, n).astype(np.float32)
    state.water[:] = random.integers(0, 3000, n)
    state.cells[:] = random.uniform(0, 200, state.cells.shape)
    for _ in range(5):
        before = state.copy()
        fire.advance_fire(MINI, state, np.full(n, rate))
        assert np.all(state.fuel <= before.fuel)
        assert np.all(state.fuel >= 0)
        assert np.all((state.water >= 0) & (state.water <= before.water))
        assert np.all(state.energy >= -1e-6)
        assert not state.air[0].any()
        assert not state.air[:, -1].any()


def test_flush_removes_tiny_heat_only():
    tables = replace(MINI, flush_temperature=0.001)
    state = fire.FireState.cold(tables)
    state.energy[:2] = tables.capacity[:2] * (0.0009, 0.5)
    fire.settle(tables, state)
    assert state.energy[0] == 0
    assert state.energy[1] > 0


def test_health_without_noise_is_the_official_one():
    """`damage`, its rounding, HP and the step of death, for an initial damage of 5, 20 and 100."""
    for row, initial in enumerate(MISC["initial_damage"]):
        hp, damage = np.array([10_000]), np.array([float(initial)])
        for step in range(301):
            assert damage[0] == pytest.approx(MISC["damage"][0, row, step], rel=1e-12)
            assert np.floor(damage[0] + 0.5) == MISC["damage_rounded"][0, row, step]
            assert hp[0] == MISC["hp"][0, row, step]
            people.suffer(hp, damage, np.zeros(1), np.full(1, 0.1), OFFICIAL_HEALTH)


def test_death_comes_in_the_official_step_for_every_initial_damage():
    deaths = MISC["death_step"][0]
    damage = np.arange(len(deaths), dtype=np.float64)
    hp = np.full(len(deaths), 10_000)
    died = np.full(len(deaths), -1)
    for step in range(1, 301):
        people.suffer(hp, damage, np.zeros(len(hp)), np.full(len(hp), 0.1), OFFICIAL_HEALTH)
        died[(hp == 0) & (died < 0)] = step
    np.testing.assert_array_equal(died, deaths)


@pytest.mark.parametrize("row", range(6))
def test_exposed_people_fare_like_the_official_ones(row):
    """4000 people with noise after 1 to 300 steps inside fire: survivors and mean HP within sampling error."""
    steps, final = MISC["exposure_steps"][row], MISC["mc_final_hp"][row]
    random = np.random.default_rng(row)
    n = 40_000
    hp, damage = np.full(n, 10_000), np.zeros(n)
    for step in range(1, 301):
        exposure = people.expose(random.random(n), OFFICIAL_HEALTH) if step <= steps else np.zeros(n)
        people.suffer(hp, damage, exposure, random.normal(0.1, 0.01, n), OFFICIAL_HEALTH)
        mean = MISC["mc_mean_hp"][row, step]
        spread = hp.std() * np.sqrt(1 / 4000 + 1 / n)
        assert abs(hp.mean() - mean) <= 4.5 * spread + 1e-9
    share, official = (hp > 0).mean(), (final > 0).mean()
    assert abs(share - official) <= 4 * np.sqrt(share * (1 - share) / 4000) + 1e-9


def test_damages_exclude_each_other_and_brigades_take_a_fifth():
    uniform = np.array([0.0, 0.39, 0.41, 0.59, 0.61, 0.69, 0.71, 0.99])
    assert people.expose(uniform, OFFICIAL_HEALTH).tolist() == [5, 5, 20, 20, 100, 100, 0, 0]
    assert people.expose(uniform, OFFICIAL_HEALTH, share=0.2).tolist() == [1, 1, 4, 4, 20, 20, 0, 0]


def test_the_lowest_brigade_draws_from_a_hydrant():
    team = brigades.Brigades.with_tanks(np.array([7, 3, 5]), np.array([0, 0, 14_000]))
    team.place(7, (0, 0), at_refuge=False, hydrant=1)
    team.place(3, (0, 0), at_refuge=False, hydrant=1)
    team.place(5, (0, 0), at_refuge=True, hydrant=brigades.NOWHERE)
    brigades.refill(team, OFFICIAL_2013.brigades)
    assert team.brigade_id.tolist() == [3, 5, 7]
    assert team.tank_litres.tolist() == [400, 15_000, 0]
