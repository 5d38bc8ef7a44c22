"""Free allocation: brigades name targets of any site and belong to the site of the one that they go for."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import fireworld as fw
from fireworld.errors import PolicyError
from fireworld.kernels.allocation import join_site, may_name, named_range
from fireworld.policy.kernel import KernelPolicy, allocating, from_rankings, given
from fireworld.policy.protocol import Action, Decision, Policy
from fireworld.policy.teams.network_layers import FEATURES
from fireworld.scenario import Scenario
from fireworld.simulation.built import BuiltScenario, build_scenario
from fireworld.simulation.observer import Observer
from fireworld.simulation.state import named_arrays
from fireworld.simulation.world import World
from tests.kernels.small import burn, make_city, make_world, site_numbers, square
from tests.networks import make_network
from tests.simulation.town import Asked, begin, play

THREE_FIRES: dict[str, Any] = {
    "name": "three-fires",
    "city": {"generated": {"columns": 9, "rows": 7, "seed": 5, "hydrant_share": 0.5}},
    "fires": [
        {"at": [0.1, 0.1], "n_buildings": 7},
        {"at": [0.9, 0.9], "n_buildings": 5},
        {"at": [0.1, 0.9], "step": 9},
    ],
    "civilians": {"n": 4, "seed": 3},
    "brigades": {"n": 5, "allocation": "free"},
    "parameters": {"brigades": {"tank_litres": 5000}},
    "steps": 40,
}


def built_with(**values: Any) -> BuiltScenario:
    return build_scenario(Scenario.from_dict(THREE_FIRES).with_values(values))


def policy_named(name: str) -> KernelPolicy:
    if name == "network":
        return make_network(own_targets=True).policy()
    if name == "allocate":
        return allocating()
    weights = np.random.default_rng(4).normal(size=(3, 17))
    weights[:, FEATURES.index("mine")], weights[:, FEATURES.index("beyond_range")] = (
        -9.0,
        9.0,
    )  # it likes to be elsewhere
    return from_rankings(weights, own_targets=True)


class Noted:
    """A world that notes, step by step, what the brigades did and to which sites they belong then."""

    def __init__(self, world: World) -> None:
        self.world, self.made, self.sites = world, [], []

    def play(self, policy: Policy) -> None:
        world = self.world
        while not (world.terminated or world.truncated):
            world.step(policy)
            brigades = world.state.brigades
            self.made.append((brigades.action.copy(), brigades.target.copy()))
            self.sites.append(brigades.site.copy())

    @property
    def n_moves(self) -> int:
        """How often a brigade changed its site."""
        before, after = np.array(self.sites[:-1]), np.array(self.sites[1:])
        return int(((before != after) & (before > 0) & (after > 0)).sum())


def assert_same_state(world: World, other: World) -> None:
    assert world.step_number == other.step_number
    for (name, array), (_, expected) in zip(named_arrays(world.state), named_arrays(other.state), strict=True):
        assert array.tobytes() == expected.tobytes(), name


@pytest.mark.parametrize("choices", ["in-turn", "simultaneous"])
@pytest.mark.parametrize("name", ["ranking", "network", "allocate"])
def test_whole_episodes_single_steps_questions_and_given_decisions_agree(name, choices):
    built, policy = built_with(choices=choices), policy_named(name)
    whole, stepped, asked, told = (built.world(seed=6) for _ in range(4))
    whole.run(policy.for_brigades(whole.n_brigades))
    play(stepped, policy)
    assert_same_state(stepped, whole)
    noted = Noted(asked)
    noted.play(Asked(begin(policy, asked)))
    assert_same_state(asked, whole)
    assert noted.n_moves > (2 if name == "allocate" else 10), "brigades went from site to site"
    team = given(told.n_brigades)
    bound = told.bound(team)
    for action, target in noted.made:
        team.action[:], team.table_of[:] = np.maximum(action, 0), target
        told.step_number = bound.run(told.seed, told.step_number, told.step_number + 1)
    assert told.state.brigades.site.tolist() == whole.state.brigades.site.tolist()
    assert told.digest() == whole.digest()


@pytest.mark.parametrize("name", ["ranking", "network", "allocate"])
def test_with_one_site_free_and_fixed_are_the_same(name):
    fires = [{"at": [0.5, 0.5], "n_buildings": 4}]
    ends = []
    for allocation in ("free", "fixed"):
        world = built_with(fires=fires, **{"brigades.allocation": allocation, "steps": 12}).world(seed=2)
        play(world, policy_named(name))
        ends.append(world.digest())
    assert ends[0] == ends[1]


def two_sites(*, free: bool) -> World:
    """Buildings 0 and 1 are a site, 2 another one, 3 does not burn; the brigade belongs to the first."""
    outlines = [square(0, 0), square(30, 0), square(600, 0), square(900, 0)]
    world = make_world(make_city(*outlines), ignited=[0, 1, 2], brigades=[3, 3], free=free)
    burn(world, 0, 1, 2)
    assert site_numbers(world) == {0: 1, 1: 1, 2: 2}
    world.state.brigades.site[:] = 1
    return world


@pytest.mark.parametrize(("free", "can"), [(False, [0, 1]), (True, [0, 1, 2])])
def test_what_may_be_named(free, can):
    world = two_sites(free=free)
    sites, site_of = world.state.sites, world.state.brigades.site
    first, end = named_range(0, site_of, sites, free)
    assert sites.member[first:end].tolist() == can
    assert [b for b in range(-1, 4) if may_name(0, b, site_of, sites, free)] == can
    site_of[0] = 2
    first, end = named_range(0, site_of, sites, free)
    assert sites.member[first:end].tolist() == ([0, 1, 2] if free else [2])
    burn(world)
    assert named_range(0, site_of, sites, free) == (0, 0), "nothing burns"
    assert not may_name(0, 0, site_of, sites, free)


@pytest.mark.parametrize(("target", "site"), [(-1, 1), (0, 1), (2, 2), (3, 1)])
def test_whom_a_target_draws_to_its_site(target, site):
    world = two_sites(free=True)
    for free, expected in ((False, 1), (True, site)):
        join_site(1, target, world.state.brigades.site, world.state.sites, free)
        assert world.state.brigades.site.tolist() == [1, expected]


class Names(Policy):
    """The first brigade goes for a building of its own; what each sees is kept."""

    def __init__(self, target: int, *, fails: bool = False) -> None:
        self._target, self._fails, self.seen = target, fails, []

    def decide(self, observation):
        self.seen.append((observation.burning.tolist(), observation.targets))
        if observation.brigade == 0:
            return Decision(Action.OWN_TARGET, target=self._target)
        if self._fails:
            raise ValueError("no idea")
        return Action.NEAREST_TO_ME


def test_a_brigade_that_named_a_target_of_another_site_belongs_there():
    world, policy = two_sites(free=True), Names(2)
    world.step(policy)
    assert world.state.brigades.site.tolist() == [2, 1]
    assert world.state.brigades.target.tolist()[0] == 2
    world.step(policy)
    named = [targets for _, targets in policy.seen]
    assert set(named[0]) <= {0, 1}, "the four actions name buildings of its site"
    assert named[2] == (2, 2, 2, 2)
    assert [sorted(burning) for burning, _ in policy.seen] == [[0, 1, 2]] * 4


def test_fixed_a_brigade_cannot_name_it():
    world = two_sites(free=False)
    with pytest.raises(PolicyError, match=r"one of observation\.burning, got target 2"):
        world.step(Names(2))
    assert world.state.brigades.site.tolist() == [1, 1]


def test_a_step_that_fails_leaves_sites_as_they_were():
    world = two_sites(free=True)
    before = world.digest()
    with pytest.raises(PolicyError, match="no idea"):
        world.step(Names(2, fails=True))
    assert world.state.brigades.site.tolist() == [1, 1]
    assert world.digest() == before


class KeepsOn(Names):
    """It never asks anew while it can go on."""

    def keeps(self, brigade, last_action, step):
        return True


def test_a_target_of_another_site_is_kept_while_it_burns():
    world, policy = two_sites(free=True), KeepsOn(2)
    for _ in range(3):
        world.step(policy)
    assert len(policy.seen) == 2, "each was asked once"
    assert world.state.brigades.target[0] == 2
    burn(world, 0, 1)
    with pytest.raises(PolicyError, match="got target 2"):
        world.step(policy)


def test_a_recorded_run_is_replayed_and_forked(tmp_path):
    """The log of a free run holds all that another process needs."""
    path = tmp_path / "a.mcap"
    run = fw.run(Scenario.from_dict(THREE_FIRES), policy="best", seed=3, record=path)
    assert fw.verify(path)
    assert fw.fork(path, at=7).digest == run.digest
    assert fw.fork(path, at=7, policy="recorded").digest == run.digest
    sites = np.array([record.observations.site for record in run if record.step])
    assert (np.diff(sites, axis=0) != 0).any()


@pytest.mark.parametrize("asked", [False, True])
def test_recorded_is_the_site_that_a_brigade_belonged_to_before_it_chose(asked):
    world = built_with().world(seed=6)
    policy = begin(policy_named("ranking"), world)
    observer, n_moves = Observer(world), 0
    observer.record()
    while not (world.terminated or world.truncated):
        ahead = world.copy()
        ahead.look()
        seen = observer.record(world.step(Asked(policy) if asked else policy)).observations.site
        belonged = ahead.state.brigades.site
        assert seen.tolist() == np.where(belonged > 0, belonged, -1).tolist()
        n_moves += int((belonged != world.state.brigades.site).sum())
    assert n_moves > 5
