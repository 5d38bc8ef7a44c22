"""Rows of decisions: what it takes a brigade of a team with a network to choose a target, beside a weighted sum."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from benchmarks.loops import decide_again
from benchmarks.timing import Contender, Row, compare
from fireworld.evaluation.suites import suite
from fireworld.policy.kernel import KernelPolicy
from fireworld.policy.names import find_policy
from fireworld.simulation.built import CityCache
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


def contender(team: str, worlds: Sequence[World]) -> Contender:
    """Return the decisions of a team in fights of its own: those who decide change what they go for."""
    policy = kernel_policy(team)
    bound = [(world, world.bound(policy.for_brigades(world.n_brigades))) for world in worlds]  # the first outlives it
    n_decisions = sum(decide_again(one.row, world.step_number, 1) for world, one in bound)

    def decide(_: object) -> None:
        for world, one in bound:
            decide_again(one.row, world.step_number, N_TIMES)

    return Contender(team, decide, parts=N_TIMES * n_decisions)


def decision_row(name: str, step: int, ours: str, baseline: str, *, seconds: float) -> Row:
    """Time the decisions of two teams in the same fights, those of the first one."""
    worlds, others = (fights(name, step, kernel_policy(ours)) for _ in range(2))
    burning = sum(world.outcome.n_burning for world in worlds) / len(worlds)
    label = f"{name}: {len(worlds)} fights after {step} steps, {burning:.0f} burning"
    first, second = contender(ours, worlds), contender(baseline, others)
    return compare("decision", "a decision of a brigade", label, first, second, seconds=seconds)


def rows(*, quick: bool) -> Iterator[Row]:
    """Yield the rows of decisions."""
    for name, step in FIGHTS[:2] if quick else FIGHTS:
        yield decision_row(name, step, "best", "best-2026", seconds=0.3 if quick else 2.0)
