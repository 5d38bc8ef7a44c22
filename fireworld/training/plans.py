"""What a planner makes of the options of brigades, while they do what it says or what a team says. MODEL 13."""

from __future__ import annotations

from threading import Event
from typing import Final

import numpy as np

from fireworld.planning.planner import ACTION_OPTIONS, FOLLOW, Planner
from fireworld.policy.kernel import KernelPolicy
from fireworld.policy.protocol import Decision, Observation, Policy, named_target
from fireworld.policy.seen_targets import seen_targets
from fireworld.simulation.world import World
from fireworld.training.options import TriedDecision

N_PLAN_OPTIONS: Final = 1 + len(ACTION_OPTIONS)
"""To follow the team that the planner is over, and the actions."""


def follow_and_plan(world: World, planner: Planner, team: KernelPolicy | None, stop: Event) -> list[TriedDecision]:
    """Let a planner plan in a fight to the end; return what it made of the brigades' options, at each of its plans.

    Args:
        world: at its start; it is left at its end.
        planner: who plans, over a team that names its own targets.
        team: what the brigades do; None: what the planner says.
        stop: set it, and the fight is left.
    """
    asking = _Asking(planner, team)
    for policy in (planner, *(() if team is None else (team,))):
        policy.begin(world.city_arrays, world.n_brigades, world.seed)
    while not (world.terminated or world.truncated or stop.is_set()):
        world.step(asking)
    return asking.found


class _Asking(Policy):
    """Decides as a planner or a team does, and notes what the planner makes of the options."""

    def __init__(self, planner: Planner, team: KernelPolicy | None) -> None:
        self._planner, self._team = planner, team
        self.found: list[TriedDecision] = []

    def decide(self, observation: Observation) -> Decision:
        planned = self._planner.decide(observation)
        if observation.step == self._planner.planned_at:
            self._note(observation, self._planner.values[observation.brigade])
        return planned if self._team is None else self._team.decide(observation)

    def _note(self, observation: Observation, values: dict[int, float]) -> None:
        """Note what the options' targets are worth; of options with one target, the one that is worth the most."""
        assert self._planner.followed is not None  # noqa: S101 - it is over a team
        followed, burning = self._planner.followed.decide(observation).target, observation.burning
        worth = {-1 if followed is None else followed: values[FOLLOW]}
        where = observation.city, observation.world, observation.constants
        for action in ACTION_OPTIONS:
            target = int(named_target(observation.brigade, action, *where))
            if target in burning:  # what an action names need not burn: `observation.easiest: heated`
                worth[target] = max(values[action], worth.get(target, -np.inf))
        if len(worth) > 1:
            targets, seen = seen_targets(observation)
            of_options = np.array([*worth.values()])
            places = [targets.index(target) for target in worth]
            self.found.append(TriedDecision(seen[places], of_options - of_options[0]))
