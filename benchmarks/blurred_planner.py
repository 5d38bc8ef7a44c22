"""A planner that knows the fire nearly only: it looks ahead from heat and fuel that are off by about so much.

    python -m benchmarks.by_condition best benchmarks.blurred_planner:BlurredPlanner:blur=0.1 --drawn 40

What looking ahead needs to know is what a team that does not look ahead would have to foretell.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.blurred import blurred
from fireworld.kernels.arrays import CityArrays
from fireworld.planning.planner import Planner
from fireworld.policy.protocol import Decision, Observation, Policy


class BlurredPlanner(Policy):
    """Plans as a planner does, each time in the fire with the heat and fuel of every burning building changed.

    All rollouts of a plan begin in the same changed fire. Brigades that follow the team see the fire as it is.
    """

    def __init__(self, *, blur: float, over: str = "best") -> None:
        """Make a planner.

        Args:
            blur: how far the numbers around 1 spread by which heat and fuel are multiplied, from one building to the
                next and from plan to plan; 0: the planner over that team.
            over: a policy that kernels follow.
        """
        self._blur, self._planner, self._draws = blur, Planner(over=over), np.random.default_rng(0)

    def begin(self, city: CityArrays, n_brigades: int, seed: int) -> None:
        """Forget the run before; other seeds have other numbers."""
        self._draws = np.random.default_rng(seed)
        self._planner.begin(city, n_brigades, seed)

    def decide(self, observation: Observation) -> Decision:
        """Follow the plan; the first brigade that chooses in a period makes it, in a fire nearly like this one."""
        if self._planner.plans_in(observation.step):
            nearly = replace(observation, world=blurred(observation.world, self._blur, self._draws))
            self._planner.decide(nearly)
        return self._planner.decide(observation)  # by the plan that there is now
