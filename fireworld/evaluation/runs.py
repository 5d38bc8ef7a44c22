"""Runs of one policy on one scenario under many seeds: the one way in which teams are measured."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields

import numpy as np

from fireworld.kernels.arrays import Array
from fireworld.policy.asking import begin
from fireworld.policy.kernel import KernelPolicy
from fireworld.policy.protocol import Policy
from fireworld.simulation.built import BuiltScenario
from fireworld.simulation.world import World


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


Row = tuple[float, ...]
"""How one run ended: QUANTITIES in their order."""


def evaluate(built: BuiltScenario, policy: KernelPolicy, seeds: Sequence[int], *, n_threads: int = 1) -> Outcomes:
    """Run a policy once under every seed; policies measured on the same seeds meet the same luck.

    Args:
        built: the scenario, built.
        policy: what the brigades follow.
        seeds: of the runs' luck.
        n_threads: runs at a time; the outcome does not depend on it.
    """

    def run(seed: int) -> Row:
        return run_compiled(built, policy, seed=seed)

    if n_threads == 1:
        rows = [run(seed) for seed in seeds]
    else:
        with ThreadPoolExecutor(n_threads) as pool:
            rows = list(pool.map(run, seeds))
    return outcomes(seeds, rows)


def run_compiled(built: BuiltScenario, policy: KernelPolicy, *, seed: int) -> Row:
    """Run a policy that the kernels follow by themselves, as one compiled episode."""
    world = built.world(seed=seed)
    world.run(policy.for_brigades(world.n_brigades))
    return _ending(world)


def run_step_by_step(built: BuiltScenario, policy: Policy, *, seed: int) -> Row:
    """Run any policy: it is asked in every step.

    Raises:
        PolicyError: the policy failed.
    """
    world = built.world(seed=seed)
    begin(policy, world.city_arrays, n_brigades=world.n_brigades, seed=seed)
    while not (world.terminated or world.truncated):
        world.step(policy)
    return _ending(world)


def outcomes(seeds: Sequence[int], rows: Sequence[Row]) -> Outcomes:
    """Put runs together, one for each seed."""
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


def _ending(world: World) -> Row:
    outcome = world.state.outcome
    score, score_max = outcome.score[:2].tolist()
    _, _, burnt_out, alive = outcome.counts.tolist()
    steps, total_reward, water = world.step_number, float(outcome.reward[5]), float(outcome.water[0])
    return score, score_max, burnt_out, steps, world.terminated, alive, total_reward, water
