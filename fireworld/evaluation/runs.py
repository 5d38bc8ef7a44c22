"""Runs of one policy on one scenario under many seeds, in compiled code: the one way in which teams are measured."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields

import numpy as np

from fireworld.kernels.arrays import Array
from fireworld.policy.kernel import KernelPolicy
from fireworld.world.stage import Stage


@dataclass(frozen=True)
class Outcomes:
    """How the runs ended, one entry for each seed; arrays of shape (n_seeds,)."""

    seed: Array  # int64
    score: Array  # float64
    score_max: Array  # float64, civilians + 1
    burnt_out: Array  # int64, buildings
    steps: Array  # int64, last step: the time to complete where the fire is out
    completed: Array  # bool, nothing burns any more
    civilians_alive: Array  # int64
    total_reward: Array  # float64, undiscounted return
    water_litres: Array  # float64, sprayed by all brigades

    @property
    def score_share(self) -> Array:
        """(n_seeds,) score as a share of its maximum."""
        share: Array = self.score / self.score_max
        return share


QUANTITIES = tuple(item.name for item in fields(Outcomes) if item.name != "seed")
"""What is measured of a run."""


def evaluate(stage: Stage, policy: KernelPolicy, seeds: Sequence[int], *, n_threads: int = 1) -> Outcomes:
    """Run a policy once under every seed; policies measured on the same seeds meet the same luck.

    Args:
        stage: the scenario, built.
        policy: what the brigades follow.
        seeds: of the runs' luck.
        n_threads: runs at a time; the outcome does not depend on it.
    """

    def run(seed: int) -> tuple[float, ...]:
        world = stage.world(seed=seed)
        steps = world.run(policy.for_brigades(world.n_brigades))
        outcome = world.arrays.outcome
        score, score_max = outcome.score[:2]
        _, _, burnt_out, alive = outcome.counts
        return score, score_max, burnt_out, steps, world.terminated, alive, outcome.reward[5], outcome.water[0]

    if n_threads == 1:
        rows = [run(seed) for seed in seeds]
    else:
        with ThreadPoolExecutor(n_threads) as pool:
            rows = list(pool.map(run, seeds))
    score, score_max, burnt_out, steps, completed, alive, total_reward, water = zip(*rows, strict=True)
    return Outcomes(
        seed=np.array(seeds, dtype=np.int64),
        score=np.array(score, dtype=np.float64),
        score_max=np.array(score_max, dtype=np.float64),
        burnt_out=np.array(burnt_out, dtype=np.int64),
        steps=np.array(steps, dtype=np.int64),
        completed=np.array(completed, dtype=np.bool_),
        civilians_alive=np.array(alive, dtype=np.int64),
        total_reward=np.array(total_reward, dtype=np.float64),
        water_litres=np.array(water, dtype=np.float64),
    )
