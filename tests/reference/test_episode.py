"""The compiled world and the numpy one live through the same episodes: no whole number differs after any step."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fireworld import draws
from fireworld.city.build import build_city
from fireworld.city.city import City, StreetMap
from fireworld.city.generator import generate_plan
from fireworld.city.streets import streets_of
from fireworld.kernels.observation import observe
from fireworld.kernels.ranking import N_WEIGHTS
from fireworld.parameters import PAPER
from fireworld.policy.kernel import always, at_random, each_another, from_rankings, from_tables
from fireworld.policy.teams.network_layers import SEEN
from fireworld.records import ACTIVITIES
from fireworld.rewards import reward_of
from fireworld.scenario import load_scenario
from fireworld.simulation.built import build_scenario
from fireworld.simulation.placement import Placement
from fireworld.simulation.world import World, prepare_start
from tests.kernels.small import assess
from tests.networks import make_network
from tests.reference import episode, outcome, random_draws, sites, team

pytestmark = pytest.mark.slow

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
    "kept choices": from_tables(RANDOM.random((2, 4320, 4)), epsilon=0.5, commit=3),
    "ranking of named": from_rankings(RANDOM.normal(size=(2, 17)), own_targets=False),
    "ranking of all": from_rankings(RANDOM.normal(size=(2, 17)), own_targets=True),
    "network of named": make_network(17, 9, 6, 1, features=SEEN[:N_WEIGHTS]).policy(),
    "network of all": make_network(activation="relu", own_targets=True).policy(),
}


def assert_same(compiled: World, plain: episode.World) -> None:
    """Compare everything that outlives a step."""
    step = f"step {compiled.step_number}"
    state, brigades, outcome = compiled.state.fire, compiled.state.brigades, compiled.state.outcome
    for name in ("fieryness", "fuel", "water", "watered"):
        np.testing.assert_array_equal(getattr(state, name), getattr(plain.fire, name), err_msg=f"{step} {name}")
    bound = 1e-9 * np.maximum(np.abs(plain.fire.energy), compiled.city_arrays.buildings.capacity)
    assert np.all(np.abs(state.energy - plain.fire.energy) <= bound), step
    np.testing.assert_array_equal(compiled.state.sites.label, plain.memory.label, err_msg=step)
    assert int(compiled.state.sites.counts[1]) == plain.memory.last_number, step

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
    everybody = (compiled.state.civilians, brigades)
    assert np.concatenate([some.hp for some in everybody]).tolist() == plain.people.hp.tolist(), step
    np.testing.assert_allclose(np.concatenate([some.damage for some in everybody]), plain.people.damage, rtol=1e-12)

    assert outcome.water[0] == plain.outcome.water_litres, step
    assert_same_outcome(compiled, plain)


def assert_same_outcome(compiled: World, plain: episode.World) -> None:
    """Compare counts, rewards and scores."""
    step, outcome, told = f"step {compiled.step_number}", compiled.state.outcome, plain.outcome
    counts = [told.n_burning, told.n_water_damaged, told.n_burnt_out, told.n_civilians_alive]
    assert outcome.counts.tolist() == counts, step
    assert outcome.reward.tolist() == [*told.reward, sum(told.reward), told.reward_so_far], step
    scores = [told.score, plain.people.n_civilians + 1, told.score_now]
    assert outcome.score.tolist() == pytest.approx(scores, rel=1e-12, abs=1e-12), step


@dataclass(frozen=True)
class Play:
    """A start for both worlds."""

    city: City
    tables: episode.Tables
    start: dict[str, Any]  # what both take to set up a world

    def worlds(self, *, seed: int, n_steps: int) -> tuple[World, episode.World]:
        """Set up both worlds."""
        tables = self.tables
        weights = asdict(tables.reward)
        start = prepare_start(
            self.city,
            tables.parameters,
            Placement(**self.start),
            reward=reward_of("change" if weights.pop("change") else "stock", weights),
            choices="in-turn" if tables.in_turn else "simultaneous",
            unit_volume_m3=tables.sites.volume_bounds[0],
        )
        compiled = World(start, seed=seed, n_steps_max=n_steps)
        return compiled, episode.World.at_start(tables, **self.start)

    def run(self, policy: str, *, seed: int, n_steps: int) -> tuple[episode.World, set[int]]:
        """Live through an episode; return the numpy world at its end, and all that brigades have done."""
        compiled, plain = self.worlds(seed=seed, n_steps=n_steps)
        done: set[int] = set()
        assert_same(compiled, plain)
        for step in range(1, n_steps + 1):
            step_both(compiled, plain, self.tables, policy, step=step)
            done |= {brigade.activity for brigade in plain.team}
            if compiled.terminated:
                break
        return plain, done


def step_both(compiled: World, plain: episode.World, tables: episode.Tables, policy: str, *, step: int) -> None:
    """Run one step in both worlds and compare them."""
    compiled.n_steps_max = step  # the whole-episode kernel, a step at a time
    compiled.run(POLICIES[policy].for_brigades(compiled.n_brigades))
    episode.advance(tables, plain, POLICIES[policy], seed=compiled.seed, step=step)
    assert_same(compiled, plain)


@cache
def shipped(name: str, *, in_turn: bool = True) -> Play:
    """Build a shipped scenario."""
    scenario = load_scenario(name)
    built = build_scenario(scenario)
    tables = episode.Tables.of_city(
        built.city, scenario.resolved_parameters, unit_volume_m3=scenario.unit_volume_m3, in_turn=in_turn
    )
    setup = built.placement
    start = {
        "ignited": setup.ignited,
        "civilian_building": setup.civilian_building,
        "civilian_mm": setup.civilian_mm,
        "brigade_refuge": setup.brigade_refuge,
    }
    return Play(built.city, tables, start)


@pytest.mark.parametrize("policy", POLICIES)
@pytest.mark.parametrize("scenario", ["quick", "test-1", "test-2", "test-3"])
def test_shipped_scenarios(scenario, policy):
    for seed in (1, 2):
        plain, _ = shipped(scenario).run(policy, seed=seed, n_steps=200)
        assert plain.outcome.water_litres > 0


@pytest.mark.parametrize("policy", ["table", "kept choices", "ranking of named", "ranking of all", "network of named"])
def test_simultaneous_choices(policy):
    plain, _ = shipped("test-1", in_turn=False).run(policy, seed=3, n_steps=200)
    other, _ = shipped("test-1").run(policy, seed=3, n_steps=200)
    assert plain.outcome.reward_so_far != other.outcome.reward_so_far, "what brigades hear of each other matters"


REWARDS = {
    1: outcome.Reward(change=True),
    2: outcome.Reward(water_damaged=0.5, burning=-1.25, burnt_out=0.0, civilians=0.01),
    3: outcome.Reward(water_damaged=0.0, burning=-1.0, burnt_out=-7.0, civilians=0.3, change=True),
}
"""By the town."""


@cache
def rough(seed: int) -> Play:
    """Make a town of many fires, hydrants, small tanks, refuges that burn and somebody outdoors."""
    plan = generate_plan(
        columns=14, rows=12, seed=seed, hydrant_share=0.3, refuges=((0.1, 0.2), (0.5, 0.5), (0.9, 0.8))
    )
    plan = replace(plan, footprints=replace(plan.footprints, inflammable=np.ones_like(plan.footprints.inflammable)))
    parameters = replace(
        PAPER,
        health=replace(PAPER.health, brigade_share=0.6),
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
    tables = episode.Tables.of_city(city, parameters, unit_volume_m3=700.0, reward=REWARDS[seed])
    return Play(city, tables, start)


@pytest.mark.parametrize(
    "policy", ["nearest-to-me", "random", "table", "ranking of named", "ranking of all", "network of all"]
)
def test_a_town_where_everything_happens(policy):
    seen: set[int] = set()
    for seed in (1, 2, 3):
        plain, done = rough(seed).run(policy, seed=seed, n_steps=250)
        seen |= done
        assert plain.outcome.n_burnt_out > 20
        assert plain.memory.last_number > 5
    assert seen >= set(range(1, len(ACTIVITIES))), "from driving to death"


def lattice() -> StreetMap:
    """Make streets of 25 m, all listed twice in no order: most ways tie with others, and every street with its twin."""
    side = np.arange(9)
    x, y = (axis.ravel() for axis in np.meshgrid(side, side))
    node = np.arange(len(x)).reshape(9, 9)
    east, north = np.stack([node[:, :-1], node[:, 1:]]), np.stack([node[:-1], node[1:]])
    street = np.concatenate([east.reshape(2, -1).T, north.reshape(2, -1).T] * 2)
    return StreetMap(
        node_mm=(np.stack([x, y], axis=1) * 25_000).astype(np.int32),
        street=np.random.default_rng(2).permutation(street).astype(np.int32),
        hydrant_node=np.array([40, 12], dtype=np.int32),
    )


def place_at(play: Play, compiled: World, plain: episode.World, places: list[team.Place]) -> None:
    """Put the brigades somewhere, in both worlds."""
    for who, place in enumerate(places):
        brigades, brigade = compiled.state.brigades, plain.team[who]
        brigades.street[who], brigades.offset[who] = place
        brigade.place = place
        brigade.x, brigade.y = play.tables.streets.locate(place)
        brigades.x[who], brigades.y[who] = brigade.x, brigade.y


def test_driving_where_ways_tie_and_refilling_where_brigades_queue():
    play = rough(3)
    streets = streets_of(lattice(), play.city.footprints.centroid_mm)
    city = replace(play.city, streets=streets)
    play = Play(city, episode.Tables.of_city(city, play.tables.parameters), play.start)
    random = np.random.default_rng(4)
    for seed in range(60):
        compiled, plain = play.worlds(seed=seed, n_steps=3)
        street = random.integers(0, len(streets.street), len(plain.team))
        offset = random.integers(0, 3, len(plain.team)) * 12_500  # at an end, or halfway
        places = [team.Place(int(a), int(b)) for a, b in zip(street, offset, strict=True)]
        of_hydrant = int(np.flatnonzero((streets.street == streets.hydrant_node[seed % 2]).any(axis=1))[0])
        places[2:5] = [play.tables.streets.end(of_hydrant, int(streets.hydrant_node[seed % 2]))] * 3
        place_at(play, compiled, plain, places)
        for brigade, tank in enumerate(random.choice([0, 300, 1700], len(plain.team)).tolist()):
            compiled.state.brigades.tank[brigade] = plain.team[brigade].tank_litres = tank
            compiled.state.brigades.refilling[brigade] = plain.team[brigade].refilling = tank == 0
        for step in (1, 2, 3):
            step_both(compiled, plain, play.tables, "random", step=step)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=60)
def test_sites_of_fires_that_jump_about(seed):
    """Far wilder than real fires: sites merge, split and trade numbers at every step."""
    play, random = rough(1), np.random.default_rng(seed)
    compiled, plain = play.worlds(seed=0, n_steps=1)
    fire, people, found = compiled.state.fire, compiled.state.civilians, compiled.state.sites
    n = play.city.n_buildings
    share = random.choice([0.03, 0.1, 0.2])  # that burns
    for _ in range(12):
        changing = random.random(n) < random.choice([0.05, 0.5])
        codes = random.choice([0, 1, 3, 4, 6, 8], n, p=[0.8 - share, share / 2, share / 2, 0.1, 0.05, 0.05])
        fire.fieryness[changing] = codes[changing]
        plain.fire.fieryness = fire.fieryness.copy()
        people.hp[:] = random.integers(0, 2, len(people.hp))
        plain.people.hp[: len(people.hp)] = people.hp
        if random.random() < 0.5:  # as if the buildings had burnt in quite other sites
            last = int(found.counts[1]) + 1
            found.label[:] = random.integers(0, last, n)
            plain.memory.label = found.label.astype(np.int64)
            for who, brigade in enumerate(plain.team):
                brigade.site = compiled.state.brigades.site[who] = int(random.integers(0, last))
        compiled.look()
        seen = episode.look(play.tables, plain)
        assert found.label.tolist() == plain.memory.label.tolist()
        assert found.counts[1] == plain.memory.last_number
        assert compiled.state.brigades.site.tolist() == [brigade.site for brigade in plain.team]
        assert_same_sites(compiled, plain, seen)
        assess(compiled)
        episode.assess(play.tables, plain)
        assert_same_outcome(compiled, plain)


def assert_same_sites(compiled: World, plain: episode.World, seen: sites.Sites | None) -> None:
    """Compare the sites of a moment, and what the brigades make of them."""
    found = compiled.state.sites
    n_sites = found.counts[0]
    assert n_sites == (0 if seen is None else len(seen.number))
    if seen is None:
        return
    assert found.number[:n_sites].tolist() == seen.number
    assert found.free_sides[:n_sites].tolist() == seen.free_sides
    for site in range(n_sites):
        of_site = found.member[found.start[site] : found.start[site + 1]]
        assert sorted(of_site.tolist()) == seen.member[seen.members(site)].tolist()
    np.testing.assert_array_equal(found.building_civilian_square[seen.member], seen.civilian_square)
    for who in range(compiled.n_brigades):
        features = np.zeros(8, dtype=np.int64)
        state = observe(
            who,
            compiled.state.brigades.action,
            compiled.state.brigades.site,
            found,
            compiled.constants.observation,
            features,
        )
        others = [brigade.action for brigade in plain.team if brigade is not plain.team[who]]
        assert state == team.observe(plain.team[who], others, seen)


@given(
    st.integers(-(2**63), 2**63 - 1),
    st.sampled_from([draws.BURN_RATE, draws.DAMAGE]),
    st.lists(st.integers(0, 5000), min_size=1, max_size=60),
    st.integers(0, 1000),
)
@settings(max_examples=60)
def test_draws(seed, purpose, entities, step):
    """Many at once are the same draws as one by one; the episodes above show that it is that of the kernels."""
    many = np.array(entities)
    assert random_draws.uniforms(seed, purpose, many, step).tolist() == [
        draws.uniform(seed, purpose, e, step) for e in entities
    ]
    expected = [random_draws.normal_of(draws.hash_key(seed, purpose, entity, step)) for entity in entities]
    assert random_draws.normals(seed, purpose, many, step).tolist() == expected
