"""Forecast: the value of a joint assignment of actions, tried out on a copy of the world."""

from __future__ import annotations

from typing import Final

from fireworld.kernels.arrays import WorldState
from fireworld.policy.kernel import always
from fireworld.policy.protocol import Observation
from fireworld.simulation.state import NO_LEARNER, copy_into, score_of

Assignment = tuple[int, ...]
"""(b,) the action of each brigade."""

FIRST_SEED: Final = 1 << 32
"""Seeds of runs lie below, those of rollouts at and above: no plan knows the random draws of the run."""
BURNING_COST: Final = 0.005
"""Cost of a building that still burns at the end of a rollout, as a share of the maximal score."""


class Forecast:
    """Values of assignments at one moment; each is computed once.

    All assignments see the same random draws, so their values differ by what the brigades do, not by chance.

    Args:
        observation: the moment.
        copy: arrays of the same shapes as the world's, overwritten by every rollout.
        horizon: steps of a rollout.
        rollouts: rollouts of each assignment, each with random draws of its own.
    """

    def __init__(self, observation: Observation, copy: WorldState, *, horizon: int, rollouts: int) -> None:
        self._observation = observation
        self._copy = copy
        self._horizon = horizon
        self._rollouts = rollouts
        self._policy = always(0).for_brigades(len(observation.world.brigades.action))
        self._values: dict[Assignment, float] = {}

    def value(self, assignment: Assignment) -> float:
        """Return the value of an assignment that all brigades follow until the horizon: a mean over the rollouts.

        score / maximal score - 0.005 * burning buildings, at the end of the rollout. The second term stands for the
        further cost of the fire that is left.
        """
        held = self._values.get(assignment)
        if held is None:
            self._policy.action[:] = assignment
            total = 0.0
            for rollout in range(self._rollouts):
                total += self._roll_out(rollout)
            held = self._values[assignment] = total / self._rollouts
        return held

    def _roll_out(self, rollout: int) -> float:
        from fireworld.kernels.episode import run_episode  # the largest kernel: compiled only where it is used

        moment, copy = self._observation, self._copy
        copy_into(copy, moment.world)
        seed = FIRST_SEED + moment.step * self._rollouts + rollout
        last_step = moment.step + self._horizon - 1
        run_episode(moment.city, copy, moment.constants, self._policy, NO_LEARNER, seed, moment.step, last_step)
        score = score_of(copy)
        return score.score / score.score_max - BURNING_COST * score.n_burning
