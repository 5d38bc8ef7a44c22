"""Rows of decisions: what it takes a brigade of a team with a network to choose a target, beside a weighted sum."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from benchmarks.loops import decide_again
from benchmarks.timing import Contender, Row, compare
from fireworld.evaluation.suites import suite
from fireworld.kernels.addresses import address_row
from fireworld.kernels.arrays import WorldState
from fireworld.policy.kernel import KernelPolicy
from fireworld.policy.names import find_policy
from fireworld.simulation.bound import Bound, bind
from fireworld.simulation.built import CityCache
from fireworld.simulation.state import copy_world
from fireworld.simulation.world import World

FIGHTS: Final = (
    ("tests", 10),
    ("contested", 10),
    ("larger", 10),
    ("larger", 60),
    ("official-like", 10),
    ("official-like", 60),
)
"""Suites, and after how many steps of a fight the brigades are asked; what burns after 60 is being lost."""
N_TIMES: Final = 50
"""They are asked so often in a repetition."""


def kernel_policy(name: str) -> KernelPolicy:
    """Return a policy that kernels follow."""
    policy = find_policy(name).policy
    assert isinstance(policy, KernelPolicy)
    return policy


def fights(name: str, step: int, team: KernelPolicy) -> list[World]:
    """Return the fights of a team in a suite, some steps after their start; those that are over are left out."""
    cities, found = CityCache(), []
    for scenario in suite(name).scenarios:
        built = cities.build(scenario)
        world = built.world(seed=1, n_steps_max=step)
        world.run(team.for_brigades(world.n_brigades))
        if world.outcome.n_burning:
            found.append(world)
    return found


def bound_to(world: World, team: KernelPolicy) -> tuple[Bound, WorldState]:
    """Return a copy of a world bound to a team, and what must outlive that."""
    state = copy_world(world.state)
    city_row = np.concatenate((address_row(world.city_arrays), address_row(world.constants)))
    return bind(city_row, address_row(state), state.fire, team.for_brigades(world.n_brigades)), state


def decision_row(name: str, step: int, ours: str, baseline: str, *, seconds: float) -> Row:
    """Time the decisions of two teams in the same fights, those of the first one."""
    worlds = fights(name, step, kernel_policy(ours))

    def contender(team: str) -> Contender:
        bound = [bound_to(world, kernel_policy(team)) for world in worlds]
        n_decisions = sum(int(decide_again(one.row, step, 1)) for one, _ in bound)

        def decide(_: object) -> None:
            for one, _ in bound:
                decide_again(one.row, step, N_TIMES)

        return Contender(team, decide, parts=N_TIMES * n_decisions)

    burning = sum(world.outcome.n_burning for world in worlds) / len(worlds)
    label = f"{name}: {len(worlds)} fights after {step} steps, {burning:.0f} burning"
    return compare("decision", "a decision of a brigade", label, contender(ours), contender(baseline), seconds=seconds)


def rows(*, quick: bool) -> Iterator[Row]:
    """Yield the rows of decisions."""
    for name, step in FIGHTS[:2] if quick else FIGHTS:
        yield decision_row(name, step, "best", "best-2026", seconds=0.3 if quick else 2.0)
