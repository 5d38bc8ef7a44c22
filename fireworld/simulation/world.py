"""World: a city in which a fire is fought, one step at a time."""

from __future__ import annotations

import copy
import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from fireworld.city.city import City
from fireworld.kernels.addresses import address_row
from fireworld.kernels.allocation import is_asked, join_site, may_name, stays
from fireworld.kernels.arrays import BURNING, Array, CityArrays, Constants, Learner, PolicyArrays, Seen, WorldState
from fireworld.kernels.episode_arrays import SEED, STEP
from fireworld.kernels.fire import ignite
from fireworld.kernels.observation import BY_ACTION, can_choose, flag_targets, observe
from fireworld.kernels.outcome import assess
from fireworld.kernels.step import finish, look
from fireworld.outcome import Outcome, outcome_at
from fireworld.parameters import Parameters
from fireworld.policy.asking import ask, complete, keeps
from fireworld.policy.kernel import KernelPolicy, given
from fireworld.policy.protocol import Action, Decision, Observation, Policy, named_target
from fireworld.rewards import Reward, reward_of
from fireworld.scenario import document
from fireworld.scenario.observed import Observed
from fireworld.simulation.bound import NOTHING_SEEN, Bound, bind, fresh_seen
from fireworld.simulation.choices import Choices, Made, NotedChoices
from fireworld.simulation.city_arrays import (
    brigade_constants,
    city_arrays,
    fire_constants,
    health_constants,
    observation_constants,
)
from fireworld.simulation.packing import Packing
from fireworld.simulation.placement import Placement
from fireworld.simulation.state import NO_LEARNER, fresh_world, rewards_of, score_of, take_snapshot

NO_DECISION = Decision(-1)
NOBODY: Final = given(0)
"""Whoever decides is not asked by kernels."""


@dataclass(frozen=True)
class Start:
    """What all worlds of a scenario have in common, and the state each of them begins with; not to be changed."""

    city: City
    city_arrays: CityArrays
    constants: Constants
    state: WorldState

    @cached_property
    def packing(self) -> Packing:
        """Where the arrays of a world's state lie in its memory; and the memory of the state above."""
        return Packing(self.state)

    @cached_property
    def row(self) -> Array:
        """The address row of the city and the constants."""
        return np.concatenate((address_row(self.city_arrays), address_row(self.constants)))

    @cached_property
    def frame(self) -> Array:
        """West and south end of the streets, their width and height, (4,) mm."""
        x, y = self.city_arrays.streets.node_x, self.city_arrays.streets.node_y
        return np.array([x.min(), y.min(), max(np.ptp(x), 1.0), max(np.ptp(y), 1.0)])


def prepare_start(
    city: City,
    parameters: Parameters,
    placement: Placement,
    *,
    reward: Reward | None = None,
    choices: document.Choices = "in-turn",
    unit_volume_m3: float | None = None,
    observed: Observed | None = None,
    allocation: document.Allocation = "fixed",
    targets: document.Targets = "anew",
    arrays: CityArrays | None = None,
) -> Start:
    """Place everybody in a city and set it on fire; arguments are named as in a scenario.

    A reward of None is the paper's; the city's arrays are built unless they are given.
    """
    arrays = arrays if arrays is not None else city_arrays(city, parameters.fire)
    if len(placement.later_step):
        later = {"later_step": placement.later_step, "later_building": placement.later_building}
        arrays = arrays._replace(buildings=arrays.buildings._replace(**later))
    constants = Constants(
        fire=fire_constants(parameters.fire),
        health=health_constants(parameters.health),
        brigades=brigade_constants(parameters.brigades, free=allocation == "free", keeps=targets == "kept"),
        observation=observation_constants(city, unit_volume_m3, in_turn=choices == "in-turn", observed=observed),
        reward=reward if reward is not None else reward_of("stock"),
    )
    state = fresh_world(city, arrays.streets, parameters, placement)
    for building in placement.ignited.tolist():
        ignite(building, arrays.buildings, state.fire)
    assess(state.fire, state.civilians, arrays.geometry, constants.reward, state.outcome, np.zeros(9, dtype=np.int64))
    state.outcome.reward[:] = 0.0  # the start is not rewarded
    return Start(city, arrays, constants, state)


class World:
    """A city, its team and its fire: `state` is everything that a step changes. Truncated after step `n_steps_max`."""

    def __init__(self, start: Start, *, seed: int, n_steps_max: int) -> None:
        self.start, self.city, self.city_arrays, self.constants = start, start.city, start.city_arrays, start.constants
        self.seed = seed
        self.n_steps_max = n_steps_max
        self.step_number = 0
        self._keep(start.packing.memory)

    @property
    def n_brigades(self) -> int:
        """Number of brigades."""
        return len(self.state.brigades.hp)

    @property
    def terminated(self) -> bool:
        """Whether nothing burns any more, and no fire is lit later on."""
        n_burning, later = int(self.state.outcome.counts[BURNING]), self.city_arrays.buildings.later_step
        return n_burning == 0 and (len(later) == 0 or int(later[-1]) <= self.step_number)

    @property
    def truncated(self) -> bool:
        """Whether the last step is done while something burns."""
        return not self.terminated and self.step_number >= self.n_steps_max

    @property
    def outcome(self) -> Outcome:
        """How the world stands after the last step."""
        return outcome_at(
            score_of(self.state),
            rewards_of(self.state),
            steps=self.step_number,
            completed=self.terminated,
            n_buildings=self.city.n_buildings,
            n_civilians=len(self.state.civilians.hp),
        )

    def copy(self) -> World:
        """Return a world in the same state, which shares nothing that a step changes."""
        copied = copy.copy(self)
        copied._keep(self.memory)  # noqa: SLF001 - a world as this one
        return copied

    def _keep(self, memory: Array) -> None:
        """Begin in the state of a memory, of which this world gets its own copy."""
        self.memory = memory.copy()
        self.state = self.start.packing.state(self.memory)
        self._bound: Bound | None = None
        self._seen, self._given = fresh_seen(self.n_brigades), given(self.n_brigades)

    def observe(self) -> tuple[Observation | None, ...]:
        """Return what each brigade sees before anyone decides in the next step; None of one that will not decide.

        The world stays as it is; the observations have its state in that moment, in arrays of their own.
        """
        ahead = self.copy()
        ahead.look()
        ahead.step_number += 1
        brigades, sites, features = ahead.state.brigades, ahead.state.sites, np.zeros(8, dtype=np.int64)
        known, seen = brigades.target.copy(), list[Observation | None]()
        for brigade in range(self.n_brigades):
            state = ahead._see(brigade, brigades.action, known, features)  # noqa: SLF001
            decides = is_asked(brigade, brigades, sites, self.constants.brigades)
            seen.append(ahead._observation(brigade, features, state, known) if decides else None)  # noqa: SLF001
        return tuple(seen)

    def look(self) -> None:
        """Begin the coming step: light what is lit in it, and find the fire sites."""
        look(self._bind(NOBODY, NO_LEARNER, NOTHING_SEEN).row)

    def step(self, policy: Policy) -> Choices:
        """Run one step: the brigades look and decide one after another, then come the phases of `finish_step`."""
        ready = policy.ready(self.n_brigades) if isinstance(policy, KernelPolicy) else None
        if ready is not None:
            return self._step_in_kernel(ready)
        self.look()
        self.step_number += 1
        before = Made.of(self.state.brigades)
        try:
            choices = self._decide(complete(policy), before)
        except BaseException:  # nothing but the choices has changed: the step can be tried again
            self.step_number -= 1
            before.put_back(self.state.brigades)
            raise
        finish(self._bind(NOBODY, NO_LEARNER, NOTHING_SEEN).row)
        return choices

    def _step_in_kernel(self, policy: PolicyArrays) -> Choices:
        bound = self._bind(policy, NO_LEARNER, self._seen)
        self.step_number = bound.run(self.seed, self.step_number, self.step_number + 1)
        brigades, seen = self.state.brigades, Seen(*[array.copy() for array in self._seen])
        made = brigades.action.copy(), brigades.target.copy(), bound.scratch.target_before.copy()
        return NotedChoices(policy, seen, *made)

    def act(self, actions: Sequence[int]) -> None:
        """Run one step in which the brigades that choose do (b,) `actions`, 0..3: as `step` does, but nothing is noted.

        For loops that others own.
        """
        bound = self._bind(self._given, NO_LEARNER, NOTHING_SEEN)
        self._given.action[:] = actions
        self.step_number = bound.run(self.seed, self.step_number, self.step_number + 1)

    def run(self, policy: PolicyArrays, learner: Learner = NO_LEARNER) -> int:
        """Run the whole episode in compiled code and return the last step; it comes out as step by step."""
        if not (self.terminated or self.truncated):
            bound = self._bind(policy, learner, NOTHING_SEEN)
            self.step_number = bound.run(self.seed, self.step_number, self.n_steps_max)
        return self.step_number

    def row(self) -> Array:
        """Return the address row of the state."""
        return self.start.packing.row(self.memory, self.state.ways)

    def bound(self, policy: PolicyArrays, *, describes: bool = True) -> Bound:
        """Return what kernels take of this world and a team, for loops of kernels of their own.

        Args:
            policy: the team.
            describes: there is room for the features of buildings, whether the team needs them or not.
        """
        return bind(self.start.row, self.row(), self.state.fire, policy, describes=describes)

    def digest(self) -> str:
        """Return a digest of all that the rest of the run follows from: state, seed and step."""
        found = hashlib.sha256(f"{self.seed} {self.step_number}".encode())
        for name, array in take_snapshot(self.state).items():
            found.update(name.encode() + array.tobytes())
        return found.hexdigest()

    def _bind(self, policy: PolicyArrays, learner: Learner, seen: Seen) -> Bound:
        """Return what kernels take of this world and those who act in it, with the clock as it stands."""
        bound = self._bound
        if bound is None or bound.policy is not policy or bound.learner is not learner or bound.seen is not seen:
            bound = self._bound = bind(self.start.row, self.row(), self.state.fire, policy, learner, seen)
        bound.clock[SEED], bound.clock[STEP] = self.seed, self.step_number
        return bound

    def _decide(self, policy: Policy, before: Made) -> Choices:
        """Ask for all decisions; `before` is what the brigades did in the last step, and where they belong."""
        features = np.zeros((self.n_brigades, 8), dtype=np.int64)
        made = [
            self.ask(brigade, policy, before.action, before.target, features[brigade])
            for brigade in range(self.n_brigades)
        ]
        states = np.array([state for state, _ in made], dtype=np.int64)
        return Choices(features, states, before.site, [decision for _, decision in made])

    def ask(
        self, brigade: int, policy: Policy, before: Array, target_before: Array, features: Array
    ) -> tuple[int, Decision]:
        """Let a brigade look and decide, and note what it does; in a step that has begun, `step_number`.

        Args:
            brigade: its number.
            policy: whom it asks.
            before: (b,) what the brigades did in the last step.
            target_before: (b,) what they went for.
            features: (8,) int64, written: what it sees.

        Returns:
            The state that it sees, -1 none, and what it decides.
        """
        brigades, sites, thresholds = self.state.brigades, self.state.sites, self.constants.observation
        shown, known = (brigades.action, brigades.target) if thresholds.in_turn else (before, target_before)
        state = self._see(brigade, shown, known, features)
        decision, target = NO_DECISION, -1
        if can_choose(brigade, brigades.hp, brigades.refilling, sites.counts):
            last = Decision(int(before[brigade]), target=int(target_before[brigade]))
            if stays(brigade, brigades, sites, self.constants.brigades):
                decision, target = last, int(target_before[brigade])
            else:
                if self._can_keep(brigade, last) and keeps(policy, brigade, last.action, self.step_number):
                    decision = last
                else:
                    decision = ask(policy, self._observation(brigade, features, state, known))
                target = self._target(brigade, decision)
        brigades.action[brigade], brigades.target[brigade] = decision.action, target
        join_site(brigade, target, brigades.site, sites, self.constants.brigades.free)
        return state, decision

    def _see(self, brigade: int, shown: Array, known: Array, features: Array) -> int:
        """Write the (8,) features that a brigade sees and return its state; (b,) actions and targets that it knows."""
        brigades, sites, fire = self.state.brigades, self.state.sites, self.state.fire
        constants, city = self.constants.observation, self.city_arrays
        state = observe(brigade, shown, brigades.site, sites, constants, features)
        if constants.flags != BY_ACTION:
            where = brigades, city.buildings, city.links, fire, city.geometry, sites
            state = flag_targets(brigade, known, *where, constants, features)
        return int(state)

    def _can_keep(self, brigade: int, last: Decision) -> bool:
        """Return whether a choice can be repeated: a target of its own only while the brigade may name it."""
        if last.action != Action.OWN_TARGET:
            return True
        state, free = self.state, self.constants.brigades.free
        return bool(may_name(brigade, last.target, state.brigades.site, state.sites, free))

    def _target(self, brigade: int, decision: Decision) -> int:
        if decision.action == Action.OWN_TARGET and decision.target is not None:
            return decision.target
        return named_target(brigade, decision.action, self.city_arrays, self.state, self.constants)

    def _observation(self, brigade: int, features: Array, state: int, known: Array) -> Observation:
        seen = [int(feature) for feature in features]
        return Observation(
            brigade=brigade,
            step=self.step_number,
            seed=self.seed,
            state_index=state,
            free_edges=seen[0],
            distance_from_center=seen[1],
            distance_from_civilian=seen[2],
            volume=seen[3],
            others=(bool(seen[4]), bool(seen[5]), bool(seen[6]), bool(seen[7])),
            known_targets=known,
            city=self.city_arrays,
            world=self.state,
            constants=self.constants,
        )
