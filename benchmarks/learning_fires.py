"""The fires on which teams are measured for docs/science.md, and how they are measured."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from fireworld.evaluation.runs import run_compiled, run_step_by_step
from fireworld.executors import AnyExecutor, in_this_process, workers_for
from fireworld.interrupt import Interrupted
from fireworld.kernels.arrays import Array
from fireworld.policy.kernel import KernelPolicy
from fireworld.policy.protocol import Policy
from fireworld.scenario import Scenario, load_scenario
from fireworld.simulation.built import BuiltScenario, CityCache
from fireworld.training.curriculum import load_curriculum

TESTS = ("test-1", "test-2", "test-3")
N_THREADS = 2
FEW = 10
"""With fewer fires than that the seeds are drawn anew in place of the fires."""
Fires = dict[str, list[BuiltScenario]]


def fires_by_group(cities: CityCache, *, n_fires: int | None = None) -> Fires:
    """Build the paper's tests, contested fires of cities that no team learned in, and the same a quarter larger.

    Args:
        cities: cities built before.
        n_fires: of each group at most, spread over the cities.
    """
    groups = {"tests": [load_scenario(name) for name in TESTS]}
    groups |= {built.name: list(built.scenarios) for built in load_curriculum("unseen").stages}
    return {
        name: [cities.build(scenario) for scenario in _some(scenarios, n_fires)] for name, scenarios in groups.items()
    }


def _some(items: list[Scenario], n: int | None) -> list[Scenario]:
    return items if n is None or n >= len(items) else items[:: len(items) // n][:n]


def shares(
    stages: Sequence[BuiltScenario], policy: KernelPolicy | Policy, seeds: Sequence[int], executor: AnyExecutor = None
) -> Array:
    """Return the score of every run as a share of its maximum, (fires, seeds); `executor`: who runs them."""
    run = run_compiled if isinstance(policy, KernelPolicy) else run_step_by_step
    if in_this_process(executor):
        executor = (executor or N_THREADS) if isinstance(policy, KernelPolicy) else 1  # the planner has a memory
    tasks = [partial(run, built, policy, seed=seed) for built in stages for seed in seeds]  # type: ignore[arg-type]
    found = workers_for(executor).run(tasks)
    if found is None:
        raise Interrupted("interrupted")
    return np.array([outcome.score_share for outcome in found]).reshape(len(stages), len(seeds))


def table_of(runs: Array) -> Array:
    """Return means as (teams, fires), or (teams, seeds) if there are few fires, of (teams, fires, seeds)."""
    means: Array = runs.mean(axis=1) if runs.shape[1] < FEW else runs.mean(axis=2)
    return means
