"""A small generated town and worlds in it with fires, people and brigades by draw."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np

from fireworld.city.build import build_city
from fireworld.city.city import City
from fireworld.city.generator import generate_plan
from fireworld.kernels.arrays import CityArrays
from fireworld.parameters import PAPER, Parameters
from fireworld.policy.kernel import (
    KernelPolicy,
    allocating,
    always,
    at_random,
    each_another,
    from_assignment,
    from_rankings,
    from_tables,
)
from fireworld.policy.protocol import Policy
from fireworld.rewards import Reward
from fireworld.scenario.document import Choices
from fireworld.simulation.city_arrays import city_arrays
from fireworld.simulation.placement import Placement
from fireworld.simulation.world import World, prepare_start
from tests.networks import make_network

POLICIES = (
    "fixed",
    "each-another",
    "random",
    "table",
    "table-of-270",
    "ranking-of-named",
    "ranking-of-all",
    "assignment",
    "network-of-named",
    "network-of-all",
    "allocate",
)


@lru_cache
def town() -> City:
    """30 lots with two refuges, and hydrants at half of the crossings."""
    return build_city(generate_plan(columns=6, rows=5, seed=2, hydrant_share=0.5), PAPER.fire, seed=2)


@lru_cache
def town_tables() -> CityArrays:
    return city_arrays(town(), PAPER.fire)


def small_tanks(*, flush: bool = True) -> Parameters:
    """The paper's parameters with tanks that run dry within a few steps."""
    fire = replace(PAPER.fire, flush_temperature=0.001 if flush else 0.0)
    return replace(PAPER, fire=fire, brigades=replace(PAPER.brigades, tank_litres=5000))


def policy_named(name: str) -> KernelPolicy:
    """One policy of each kind that the kernels follow."""
    random = np.random.default_rng(11)
    return {
        "fixed": lambda: always(2),
        "each-another": each_another,
        "random": at_random,
        "table": lambda: from_tables(random.normal(size=(3, 4320, 4)), epsilon=0.3),
        "table-of-270": lambda: from_tables(random.normal(size=(1, 270, 4))),
        "ranking-of-named": lambda: from_rankings(random.normal(size=(2, 17)), own_targets=False),
        "ranking-of-all": lambda: from_rankings(random.normal(size=(2, 17)), own_targets=True),
        "assignment": lambda: from_assignment(random.normal(size=17)),
        "network-of-named": lambda: make_network().policy(),
        "network-of-all": lambda: make_network(own_targets=True).policy(),
        "allocate": allocating,
    }[name]()


class Asked(Policy):
    """Asks a policy that kernels could follow, brigade by brigade."""

    def __init__(self, policy):
        self._policy = policy

    def decide(self, observation):
        return self._policy.decide(observation)

    def keeps(self, brigade, last_action, step):
        return self._policy.keeps(brigade, last_action, step)


def town_world(
    *,
    seed: int,
    n_fires: int = 3,
    n_people: int = 5,
    n_brigades: int = 3,
    flush: bool = True,
    reward: Reward | None = None,
    choices: Choices = "in-turn",
    n_steps_max: int = 60,
) -> World:
    """A world whose fires and people lie where the seed says."""
    city = town()
    random = np.random.default_rng(seed)
    inflammable = np.flatnonzero(city.footprints.inflammable)
    chosen = random.permutation(inflammable)
    people = random.choice(inflammable, n_people)
    refuges = np.flatnonzero(city.footprints.refuge)
    placement = Placement(
        ignited=np.sort(chosen[:n_fires]),
        civilian_building=people,
        civilian_mm=city.footprints.centroid_mm[people],
        brigade_refuge=refuges[np.arange(n_brigades) % len(refuges)],
    )
    parameters = small_tanks(flush=flush)
    start = prepare_start(city, parameters, placement, reward=reward, choices=choices, arrays=town_tables())
    return World(start, seed=seed, n_steps_max=n_steps_max)


def begin(policy: KernelPolicy, world: World) -> KernelPolicy:
    policy.begin(world.city_arrays, world.n_brigades, world.seed)
    return policy


def play(world: World, policy: KernelPolicy, *, to: int | None = None) -> int:
    """Run step by step until nothing burns, or to a step; return the step."""
    begin(policy, world)
    while not (world.terminated or world.truncated) and world.step_number != to:
        world.step(policy)
    return world.step_number
