"""The fires on which teams are measured for docs/science.md, and how they are measured."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from fireworld.evaluation.runs import QUANTITIES, run_compiled, run_step_by_step
from fireworld.kernels.arrays import Array
from fireworld.policy.kernel import KernelPolicy
from fireworld.policy.protocol import Policy
from fireworld.scenario import Scenario, load_scenario
from fireworld.training.curriculum import load_curriculum
from fireworld.world.stage import Ground, Stage, build_stage

TESTS = ("test-1", "test-2", "test-3")
N_THREADS = 2
Fires = dict[str, list[Stage]]


def fires_by_group(grounds: dict[str, Ground], *, n_fires: int | None = None) -> Fires:
    """Build the paper's tests, contested fires of cities that no team learned in, and the same a quarter larger.

    Args:
        grounds: cities built before.
        n_fires: of each group at most, spread over the cities.
    """
    groups = {"tests": [load_scenario(name) for name in TESTS]}
    groups |= {stage.name: list(stage.scenarios) for stage in load_curriculum("unseen").stages}
    return {
        name: [build_stage(scenario, grounds=grounds) for scenario in _some(scenarios, n_fires)]
        for name, scenarios in groups.items()
    }


def _some(items: list[Scenario], n: int | None) -> list[Scenario]:
    return items if n is None or n >= len(items) else items[:: len(items) // n][:n]


def shares(stages: Sequence[Stage], policy: KernelPolicy | Policy, seeds: Sequence[int]) -> Array:
    """Return the score of every run as a share of its maximum, (fires, seeds)."""

    def share(stage: Stage, seed: int) -> float:
        run = run_compiled if isinstance(policy, KernelPolicy) else run_step_by_step
        row = dict(zip(QUANTITIES, run(stage, policy, seed=seed), strict=True))  # type: ignore[arg-type]
        return row["score"] / row["score_max"]

    n_threads = N_THREADS if isinstance(policy, KernelPolicy) else 1  # the planner has a memory
    with ThreadPoolExecutor(n_threads) as pool:
        runs = [pool.submit(share, stage, seed) for stage in stages for seed in seeds]
        return np.array([run.result() for run in runs]).reshape(len(stages), len(seeds))
