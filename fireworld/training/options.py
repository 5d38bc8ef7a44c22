"""What the options of a team's decisions are worth: some are tried out in rollouts, in its own fights. MODEL 11."""

from __future__ import annotations

from dataclasses import dataclass
from heapq import nlargest
from threading import Event
from typing import Final

import numpy as np

from fireworld.draws import MOMENT, OPTION, ROLLOUT, hash_key, uniform
from fireworld.kernels.addresses import address_row
from fireworld.kernels.arrays import Array, WorldState
from fireworld.kernels.choice import GIVEN
from fireworld.kernels.network import value_by_network, widest
from fireworld.planning.planner import FIRST_SEED, worth_of
from fireworld.policy.kernel import KernelPolicy
from fireworld.policy.protocol import Action, Decision, Observation, Policy
from fireworld.policy.seen_targets import seen_targets
from fireworld.simulation.bound import bind
from fireworld.simulation.state import copy_into, copy_world, score_of
from fireworld.simulation.world import World

FIRST_STEPS: Final = 12
"""So long after the start options are tried out most often: what is lost then is lost for good."""
LATER_SHARE: Final = 1 / 3
"""How often they are later, as a share of that."""


@dataclass(frozen=True)
class Trial:
    """How options are tried out.

    Attributes:
        share: of the first 12 steps in which some are; of later steps a third of it.
        n_brigades: that are asked in such a step.
        n_options: targets of a brigade that are tried, its own choice among them.
        n_likely: so many of the others are those that the team values next; the rest is drawn.
        n_rollouts: of each.
        commit: steps for which the brigade goes for the target, while that burns.
        horizon: steps of a rollout.
    """

    share: float
    n_brigades: int
    n_options: int
    n_likely: int
    n_rollouts: int
    commit: int
    horizon: int


@dataclass(frozen=True)
class TriedDecision:
    """A decision whose options were tried out.

    Attributes:
        seen: (k, 30) float64, what the brigade saw of each target; its own choice is the first.
        worth: (k,) float64: the mean of what the rollouts came to, above that of its own choice.
    """

    seen: Array
    worth: Array


def try_options(world: World, policy: KernelPolicy, trial: Trial, stop: Event) -> list[TriedDecision]:
    """Let a team fight to the end, and try out options of some of its decisions on the way.

    Args:
        world: at its start; it is left at its end.
        policy: of the team, whose brigades value targets.
        trial: how.
        stop: set it, and the fight is left.
    """
    found = list[TriedDecision]()
    rollouts = Rollouts(world, policy, trial)
    policy.begin(world.city_arrays, world.n_brigades, world.seed)
    while not (world.terminated or world.truncated or stop.is_set()):
        step = world.step_number + 1
        if uniform(world.seed, MOMENT, 0, step) >= trial.share * (1.0 if step <= FIRST_STEPS else LATER_SHARE):
            world.step(policy)
            continue
        order = sorted(range(world.n_brigades), key=lambda brigade: hash_key(world.seed, OPTION, brigade, step))
        asking = Asking(policy, order[: trial.n_brigades], trial.n_likely)
        before = copy_world(world.state)
        world.step(asking)
        found += [rollouts.tried(before, step, asked) for asked in asking.asked if len(asked.targets) > 1]
    return found


@dataclass(frozen=True)
class Asked:
    """What a brigade could choose from, in the order in which it is tried; the first is what it chose."""

    brigade: int
    targets: list[int]
    seen: Array


class Asking(Policy):
    """Decides as a team does, and notes what some brigades could choose from."""

    def __init__(self, policy: KernelPolicy, brigades: list[int], n_likely: int) -> None:
        self._policy, self._brigades, self._n_likely = policy, brigades, n_likely
        self._work = np.zeros((2, widest(policy.network)))
        self.asked: list[Asked] = []

    def decide(self, observation: Observation) -> Decision:
        """Decide as the team does; see `Policy.decide`."""
        decision = self._policy.decide(observation)
        if observation.brigade in self._brigades:
            targets, seen = seen_targets(observation)
            own = targets.index(int(decision.target if decision.target is not None else -1))
            n, seed, step = len(observation.known_targets), observation.seed, observation.step
            others = [k for k in range(len(targets)) if k != own]
            likely = nlargest(self._n_likely, others, key=lambda k: self._value(seen[k]))
            rest = (k for k in others if k not in likely)
            places = [own, *likely, *sorted(rest, key=lambda k: hash_key(seed, OPTION, n + targets[k], step))]
            self.asked.append(Asked(observation.brigade, [targets[k] for k in places], seen[places]))
        return decision

    def _value(self, seen: Array) -> float:
        """Return what the team values a target by, of which a brigade sees (30,) float64."""
        return float(value_by_network(self._policy.network, seen, self._work))


class Rollouts:
    """Rollouts of a team in a world, in which one brigade goes for a target of somebody's choice first."""

    def __init__(self, world: World, policy: KernelPolicy, trial: Trial) -> None:
        self._seed, self._trial = world.seed, trial
        self._policy = policy.for_brigades(world.n_brigades)
        kind, action, table_of = self._policy.kind, self._policy.action, self._policy.table_of
        self._forced = self._policy._replace(kind=kind.copy(), action=action.copy(), table_of=table_of.copy())
        self._room = copy_world(world.state)
        self._bound = bind(world.start.row, address_row(self._room), self._room.fire, self._forced)

    def tried(self, before: WorldState, step: int, asked: Asked, *, first: int = 0) -> TriedDecision:
        """Return what the options of a brigade are worth, in a step that begins in a state.

        Args:
            before: the state.
            step: the step.
            asked: the options.
            first: number of the first rollout; rollouts of other numbers have other random draws.
        """
        trial, seeds = self._trial, list[int]()
        for rollout in range(first, first + trial.n_rollouts):
            seeds.append(FIRST_SEED + (hash_key(self._seed, ROLLOUT, rollout, step) >> 32))
        targets = asked.targets[: trial.n_options]
        worth = np.array(
            [sum(self._worth(before, step, asked.brigade, target, seed) for seed in seeds) for target in targets]
        )
        return TriedDecision(asked.seen[: trial.n_options].copy(), (worth - worth[0]) / trial.n_rollouts)

    def _worth(self, before: WorldState, step: int, brigade: int, target: int, seed: int) -> float:
        """Return what it comes to if a brigade goes for a target first: as the planner values it."""
        trial, room, bound, (policy, forced) = self._trial, self._room, self._bound, (self._policy, self._forced)
        copy_into(room, before)
        forced.kind[brigade], forced.action[brigade], forced.table_of[brigade] = GIVEN, Action.OWN_TARGET, target
        done, last = step - 1, step - 1 + trial.horizon
        while done < step - 1 + trial.commit and (done < step or 1 <= room.fire.fieryness[target] <= 3):
            if bound.run(seed, done, done + 1) == done:  # nothing burns any more
                break
            done += 1
        for name in ("kind", "action", "table_of"):
            getattr(forced, name)[brigade] = getattr(policy, name)[brigade]
        if done < last and score_of(room).n_burning:
            bound.run(seed, done, last)
        return worth_of(room)
