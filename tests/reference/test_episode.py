"""The compiled world and the numpy one live through the same episodes: no whole number differs after any step."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fireworld import draws
from fireworld.city.build import build_city
from fireworld.city.city import City
from fireworld.city.generator import generate_plan
from fireworld.kernels.observation import observe
from fireworld.parameters import PAPER
from fireworld.policy.kernel import always, at_random, each_another, from_tables
from fireworld.records import ACTIVITIES
from fireworld.scenario import load_scenario
from fireworld.world.stage import build_stage
from fireworld.world.world import World
from tests.reference import episode, luck, team

RANDOM = np.random.default_rng(5)
POLICIES = {
    "easiest": always(0),
    "nearest-to-civilian": always(1),
    "nearest-to-center": always(2),
    "nearest-to-me": always(3),
    "each-another": each_another(),
    "random": at_random(),
    "table": from_tables(RANDOM.random((2, 4320, 4)), epsilon=0.2),
    "small table": from_tables(RANDOM.random((3, 270, 4))),
}


def assert_same(compiled: World, plain: episode.World) -> None:
    """Compare everything that outlives a step."""
    step = f"step {compiled.step_number}"
    state, brigades, outcome = compiled.arrays.fire, compiled.arrays.brigades, compiled.arrays.outcome
    for name in ("fieryness", "fuel", "water", "watered"):
        np.testing.assert_array_equal(getattr(state, name), getattr(plain.fire, name), err_msg=f"{step} {name}")
    bound = 1e-9 * np.maximum(np.abs(plain.fire.energy), compiled.tables.buildings.capacity)
    assert np.all(np.abs(state.energy - plain.fire.energy) <= bound), step
    np.testing.assert_array_equal(compiled.arrays.sites.label, plain.memory.label, err_msg=step)
    assert int(compiled.arrays.sites.counts[1]) == plain.memory.last_number, step

    same_names = ("x", "y", "action", "target", "site", "activity", "refilling", "refuge", "hydrant")
    columns = {name: [getattr(one, name) for one in plain.team] for name in same_names} | {
        "street": [one.place.street for one in plain.team],
        "offset": [one.place.offset_mm for one in plain.team],
        "tank": [one.tank_litres for one in plain.team],
        "sprayed": [one.sprayed_litres for one in plain.team],
        "driven": [one.driven_mm for one in plain.team],
        "inside": plain.people.building[plain.people.n_civilians :].tolist(),
    }
    for name, expected in columns.items():
        assert getattr(brigades, name).tolist() == expected, (step, name)
    everybody = (compiled.arrays.civilians, brigades)
    assert np.concatenate([some.hp for some in everybody]).tolist() == plain.people.hp.tolist(), step
    np.testing.assert_allclose(np.concatenate([some.damage for some in everybody]), plain.people.damage, rtol=1e-12)

    told = plain.outcome
    counts = [told.n_burning, told.n_water_damaged, told.n_burnt_out, told.n_civilians_alive]
    assert outcome.counts.tolist() == counts, step
    assert outcome.reward.tolist() == [*told.reward, sum(told.reward), told.reward_so_far], step
    assert outcome.water[0] == told.water_litres, step
    assert outcome.score.tolist() == pytest.approx(
        [told.score, plain.people.n_civilians + 1, told.score_now], rel=1e-12, abs=1e-12
    ), step


@dataclass(frozen=True)
class Play:
    """A start for both worlds."""

    city: City
    tables: episode.Tables
    start: dict[str, Any]  # what both take to set up a world

    def run(self, policy: str, *, seed: int, n_steps: int) -> tuple[episode.World, list[set[int]]]:
        """Live through an episode; return the numpy world at its end, and what each brigade has done."""
        tables = self.tables
        plain = episode.World.at_start(tables, **self.start)
        compiled = World(
            self.city,
            tables.parameters,
            **self.start,
            seed=seed,
            n_steps_max=n_steps,
            reward_change=tables.reward_change,
            unit_volume_m3=tables.sites.volume_bounds[0],
        )
        ready, done = POLICIES[policy].for_brigades(compiled.n_brigades), [set() for _ in plain.team]
        assert_same(compiled, plain)
        for step in range(1, n_steps + 1):
            compiled.n_steps_max = step  # the whole-episode kernel, a step at a time
            compiled.run(ready)
            episode.advance(tables, plain, POLICIES[policy], seed=seed, step=step)
            assert_same(compiled, plain)
            for activities, brigade in zip(done, plain.team, strict=True):
                activities.add(brigade.activity)
            if compiled.terminated:
                break
        return plain, done


@cache
def shipped(name: str) -> Play:
    """Build a shipped scenario."""
    scenario = load_scenario(name)
    stage = build_stage(scenario)
    tables = episode.Tables.of_city(stage.city, scenario.parameters, unit_volume_m3=scenario.unit_volume_m3)
    setup = stage.setup
    start = {
        "ignited": setup.ignited,
        "civilian_building": setup.civilian_building,
        "civilian_mm": setup.civilian_mm,
        "brigade_refuge": setup.brigade_refuge,
    }
    return Play(stage.city, tables, start)


@pytest.mark.parametrize("policy", POLICIES)
@pytest.mark.parametrize("scenario", ["quick", "test-1", "test-2", "test-3"])
def test_shipped_scenarios(scenario, policy):
    for seed in (1, 2):
        plain, _ = shipped(scenario).run(policy, seed=seed, n_steps=200)
        assert plain.outcome.water_litres > 0


@cache
def rough(seed: int) -> Play:
    """Make a town of many fires, hydrants, small tanks, refuges that burn and somebody outdoors."""
    plan = generate_plan(
        columns=14, rows=12, seed=seed, hydrant_share=0.3, refuges=((0.1, 0.2), (0.5, 0.5), (0.9, 0.8))
    )
    plan = replace(plan, footprints=replace(plan.footprints, inflammable=np.ones_like(plan.footprints.inflammable)))
    parameters = replace(
        PAPER,
        health=replace(PAPER.health, brigade_share=1.0),
        brigades=replace(
            PAPER.brigades, tank_litres=1700, power_litres=800, refuge_refill_litres=300, range_m=23.7, speed_m=51.3
        ),
    )
    city = build_city(plan, parameters.fire, seed=seed)
    random = np.random.default_rng(seed)
    places = np.append(random.choice(city.n_buildings, 9, replace=False), -1)
    start = {
        "ignited": random.choice(city.n_buildings, 12, replace=False),
        "civilian_building": places,
        "civilian_mm": city.footprints.centroid_mm[places],
        "brigade_refuge": np.flatnonzero(city.footprints.refuge)[np.arange(7) % 3],
    }
    tables = episode.Tables.of_city(city, parameters, unit_volume_m3=700.0, reward_change=True)
    return Play(city, tables, start)


@pytest.mark.parametrize("policy", ["nearest-to-me", "random", "table"])
def test_a_town_where_everything_happens(policy):
    seen: set[int] = set()
    for seed in (1, 2, 3):
        plain, done = rough(seed).run(policy, seed=seed, n_steps=250)
        seen |= set().union(*done)
        assert plain.outcome.n_burnt_out > 20
        assert plain.memory.last_number > 5
    assert seen >= set(range(1, len(ACTIVITIES))), "from driving to death"


@given(st.integers(0, 2**32 - 1))
@settings(deadline=None, max_examples=60)
def test_sites_of_fires_that_jump_about(seed):
    """Far wilder than real fires: sites merge, split and trade numbers at every step."""
    play, random = shipped("quick"), np.random.default_rng(seed)
    compiled = World(play.city, play.tables.parameters, **play.start, seed=0, n_steps_max=1)
    fire, found = compiled.arrays.fire, compiled.arrays.sites
    plain = episode.World.at_start(play.tables, **play.start)
    n = play.city.n_buildings
    for _ in range(12):
        changing = random.random(n) < random.choice([0.05, 0.3])
        fire.fieryness[changing] = random.choice([0, 1, 3, 4, 8], changing.sum(), p=[0.7, 0.1, 0.1, 0.05, 0.05])
        people = compiled.arrays.civilians
        people.hp[:] = random.integers(0, 2, len(people.hp))
        compiled._look()
        plain.fire.fieryness = fire.fieryness.copy()
        plain.people.hp[: len(people.hp)] = people.hp
        seen = episode.look(play.tables, plain)
        assert found.label.tolist() == plain.memory.label.tolist()
        assert found.counts[1] == plain.memory.last_number
        assert compiled.arrays.brigades.site.tolist() == [brigade.site for brigade in plain.team]
        if seen is None:
            assert found.counts[0] == 0
            continue
        n_sites = found.counts[0]
        assert found.number[:n_sites].tolist() == seen.number
        assert found.free_sides[:n_sites].tolist() == seen.free_sides
        for site in range(n_sites):
            of_site = found.member[found.start[site] : found.start[site + 1]]
            assert sorted(of_site.tolist()) == seen.member[seen.members(site)].tolist()
        np.testing.assert_array_equal(found.building_civilian_square[seen.member], seen.civilian_square)
        for who in range(compiled.n_brigades):
            features = np.zeros(8, dtype=np.int64)
            state = observe(who, compiled.arrays.brigades, found, compiled.constants.observation, features)
            assert state == team.observe(plain.team, who, seen)


@given(
    st.integers(-(2**63), 2**63 - 1),
    st.sampled_from([draws.BURN_RATE, draws.DAMAGE]),
    st.lists(st.integers(0, 5000), min_size=1, max_size=60),
    st.integers(0, 1000),
)
@settings(deadline=None, max_examples=60)
def test_draws(seed, purpose, entities, step):
    """Many at once are the same luck as one by one; the episodes above show that it is that of the kernels."""
    many = np.array(entities)
    assert luck.uniforms(seed, purpose, many, step).tolist() == [
        draws.uniform(seed, purpose, e, step) for e in entities
    ]
    expected = [luck.normal_of(draws.hash_key(seed, purpose, entity, step)) for entity in entities]
    assert luck.normals(seed, purpose, many, step).tolist() == expected
