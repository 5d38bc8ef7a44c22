"""A second world that follows an environment's decisions and gives the records of its steps, as a run would."""

from __future__ import annotations

import numpy as np

from fireworld.kernels.arrays import Array
from fireworld.policy.asking import complete
from fireworld.policy.given import Given
from fireworld.policy.protocol import Action, Decision
from fireworld.records import StepRecord
from fireworld.simulation.observer import Observer
from fireworld.simulation.world import World


class Follower:
    """Follows a world from the state that it is given, step by step.

    Attributes:
        record: of the last step followed, or of the beginning.
    """

    def __init__(self, world: World) -> None:
        self._world, self._observer = world, Observer(world)
        self.record: StepRecord = self._observer.record()

    def follow(self, action: Array, target: Array) -> StepRecord:
        """Run a step and return its record; (b,) actions and buildings are those of `Worlds.decisions` in a world."""
        decisions = [
            Decision(int(one), target=int(building)) if one == Action.OWN_TARGET else Decision(max(int(one), 0))
            for one, building in zip(action[: self._world.n_brigades], np.asarray(target), strict=False)
        ]
        self.record = self._observer.record(self._world.step(complete(Given(decisions))))
        return self.record
