"""World: a city in which a fire is fought, one step at a time."""

from __future__ import annotations

import copy
from dataclasses import dataclass

import numpy as np

from fireworld.city.city import City
from fireworld.kernels.arrays import Array, CityArrays, Constants, Learner, PolicyArrays, WorldState
from fireworld.kernels.brigades import act, shelter
from fireworld.kernels.fire import advance_fire, draw_burn_rates, ignite
from fireworld.kernels.health import harm
from fireworld.kernels.observation import can_choose, find_target, observe
from fireworld.kernels.outcome import assess
from fireworld.kernels.sites import find_sites
from fireworld.outcome import Outcome
from fireworld.parameters import Parameters
from fireworld.policy.asking import ask, complete, keeps
from fireworld.policy.protocol import Action, Decision, Observation, Policy
from fireworld.simulation.city_arrays import city_arrays, world_constants
from fireworld.simulation.state import NO_LEARNER, copy_world, fresh_world

NO_DECISION = Decision(-1)


@dataclass(frozen=True)
class Choices:
    """What the brigades saw and decided in a step."""

    features: Array  # (b, 8) int64
    state_index: Array  # (b,) int64, -1 none
    decisions: tuple[Decision, ...]  # (b,)


class World:
    """A city, its team and its fire.

    Attributes:
        city: the City.
        city_arrays: its arrays as kernels read them.
        constants: scalars of the model.
        state: everything that a step changes.
        seed: seed of the run's luck.
        step_number: steps done so far.
        n_steps_max: the run is truncated after this step.
    """

    def __init__(
        self,
        city: City,
        parameters: Parameters,
        *,
        ignited: Array,
        civilian_building: Array,
        civilian_mm: Array,
        brigade_refuge: Array,
        seed: int,
        n_steps_max: int,
        reward_change: bool = False,
        unit_volume_m3: float | None = None,
        in_turn: bool = True,
        arrays: CityArrays | None = None,
    ) -> None:
        """Set up the world before its first step.

        Args:
            city: the city.
            parameters: of fire, health and brigades.
            ignited: (k,) indices of the buildings on fire at the start.
            civilian_building: (c,) index of the building each civilian is in, -1 outdoors.
            civilian_mm: (c, 2) their positions.
            brigade_refuge: (b,) index of the refuge building each brigade starts from.
            seed: seed of all draws.
            n_steps_max: last step.
            reward_change: reward the change of the stock instead of the stock.
            unit_volume_m3: unit of the volume feature; None: twice the mean building.
            in_turn: brigades see what those before them chose in this step; if not, what all chose in the last one.
            arrays: of the same city and parameters, if they have been built already.
        """
        self.city = city
        self.parameters = parameters
        self.city_arrays = arrays if arrays is not None else city_arrays(city, parameters.fire)
        self.constants: Constants = world_constants(
            city, parameters, reward_change=reward_change, unit_volume_m3=unit_volume_m3, in_turn=in_turn
        )
        self.seed = seed
        self.n_steps_max = n_steps_max
        self.step_number = 0
        self.state: WorldState = fresh_world(
            city,
            parameters,
            civilian_building=civilian_building,
            civilian_mm=civilian_mm,
            brigade_refuge=brigade_refuge,
        )
        for b in np.asarray(ignited, dtype=np.int64):
            ignite(b, self.city_arrays.buildings, self.state.fire)
        self._assess()
        self.state.outcome.reward[:] = 0.0

    @property
    def n_brigades(self) -> int:
        """Number of brigades."""
        return len(self.state.brigades.hp)

    @property
    def outcome(self) -> Outcome:
        """How the world stands after the last step."""
        outcome, people = self.state.outcome, self.state.civilians
        score, score_max, score_now = outcome.score.tolist()
        n_burning, n_water_damaged, n_burnt_out, n_alive = outcome.counts.tolist()
        return Outcome(
            steps=self.step_number,
            completed=self.terminated,
            score=score,
            score_max=score_max,
            score_now=score_now,
            n_buildings=self.city.n_buildings,
            n_burning=n_burning,
            n_water_damaged=n_water_damaged,
            n_burnt_out=n_burnt_out,
            n_civilians=len(people.hp),
            n_civilians_alive=n_alive,
            total_reward=float(outcome.reward[5]),
            water_used_litres=float(outcome.water[0]),
        )

    @property
    def terminated(self) -> bool:
        """Whether nothing burns any more."""
        return bool(self.state.outcome.counts[0] == 0)

    @property
    def truncated(self) -> bool:
        """Whether the last step is done while something burns."""
        return not self.terminated and self.step_number >= self.n_steps_max

    def copy(self) -> World:
        """Return a world in the same state, which shares nothing that a step changes."""
        copied = copy.copy(self)
        copied.state = copy_world(self.state)
        return copied

    def observe(self) -> tuple[Observation | None, ...]:
        """Return what each brigade sees before anyone decides in the next step; None of one that will not decide.

        The world stays as it is; the observations have its state in that moment, in arrays of their own.
        """
        ahead = self.copy()
        ahead.step_number += 1
        ahead._look()  # noqa: SLF001 - a world as this one
        brigades, sites, features = ahead.state.brigades, ahead.state.sites, np.zeros(8, dtype=np.int64)
        known, seen = brigades.target.copy(), list[Observation | None]()
        for brigade in range(self.n_brigades):
            state = int(observe(brigade, brigades.action, brigades, sites, self.constants.observation, features))
            decides = can_choose(brigade, brigades, sites)
            seen.append(ahead._observation(brigade, features, state, known) if decides else None)  # noqa: SLF001
        return tuple(seen)

    def step(self, policy: Policy) -> Choices:
        """Run one step: look, decide one after another, act, burn, hurt, assess."""
        self.step_number += 1
        self._look()
        brigades, before = self.state.brigades, (self.state.brigades.action.copy(), self.state.brigades.target.copy())
        try:
            choices = self._decide(complete(policy))
        except BaseException:  # nothing but the choices has changed: the step can be tried again
            self.step_number -= 1
            brigades.action[:], brigades.target[:] = before
            raise
        self._act()
        self._burn()
        self._hurt()
        self._assess()
        return choices

    def run(self, policy: PolicyArrays, learner: Learner = NO_LEARNER) -> int:
        """Run to the end without a word to Python; return the last step. Same phases, same luck, same outcome.

        Args:
            policy: what the brigades follow.
            learner: what they learn meanwhile; by default nothing.
        """
        if self.terminated or self.truncated:
            return self.step_number
        from fireworld.kernels.episode import run_episode  # the largest kernel: compiled only where it is used

        self.step_number = int(
            run_episode(
                self.city_arrays,
                self.state,
                self.constants,
                policy,
                learner,
                self.seed,
                self.step_number + 1,
                self.n_steps_max,
            )
        )
        return self.step_number

    def _look(self) -> None:
        state = self.state
        tables = self.city_arrays
        find_sites(
            tables.buildings,
            tables.links,
            tables.near,
            tables.geometry,
            state.fire,
            state.civilians,
            state.brigades,
            state.sites,
        )

    def _decide(self, policy: Policy) -> Choices:
        features = np.zeros((self.n_brigades, 8), dtype=np.int64)
        states = np.full(self.n_brigades, -1, dtype=np.int64)
        decisions = [NO_DECISION] * self.n_brigades
        brigades = self.state.brigades
        before, target_before = brigades.action.copy(), brigades.target.copy()
        in_turn = self.constants.observation.in_turn
        shown, known = (brigades.action, brigades.target) if in_turn else (before, target_before)
        for brigade in range(self.n_brigades):
            states[brigade] = observe(
                brigade, shown, brigades, self.state.sites, self.constants.observation, features[brigade]
            )
            target = -1
            if can_choose(brigade, brigades, self.state.sites):
                last = Decision(int(before[brigade]), target=int(target_before[brigade]))
                if self._can_keep(brigade, last) and keeps(policy, brigade, last.action, self.step_number):
                    decisions[brigade] = last
                else:
                    decisions[brigade] = self._ask(policy, brigade, features[brigade], int(states[brigade]), known)
                target = self._target(brigade, decisions[brigade])
            brigades.action[brigade], brigades.target[brigade] = decisions[brigade].action, target
        return Choices(features=features, state_index=states, decisions=tuple(decisions))

    def _can_keep(self, brigade: int, last: Decision) -> bool:
        """Tell whether a last choice can be kept: a target of one's own only while it burns in the brigade's site."""
        if last.action != Action.OWN_TARGET:
            return True
        arrays, burns = self.state, 1 <= self.state.fire.fieryness[last.target] <= 3
        return bool(burns and arrays.sites.label[last.target] == arrays.brigades.site[brigade])

    def _target(self, brigade: int, decision: Decision) -> int:
        if decision.action == Action.OWN_TARGET and decision.target is not None:
            return decision.target
        arrays, tables = self.state, self.city_arrays
        action, geometry, sites = decision.action, tables.geometry, arrays.sites
        return int(find_target(brigade, action, arrays.brigades, tables.buildings, arrays.fire, geometry, sites))

    def _ask(self, policy: Policy, brigade: int, features: Array, state: int, known: Array) -> Decision:
        return ask(policy, self._observation(brigade, features, state, known))

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

    def _act(self) -> None:
        state = self.state
        streets, geometry = self.city_arrays.streets, self.city_arrays.geometry
        state.outcome.water[0] += act(state.brigades, state.fire, streets, geometry, self.constants.brigades)

    def _burn(self) -> None:
        tables, fire, constants = self.city_arrays, self.state.fire, self.constants.fire
        rates = draw_burn_rates(tables.buildings, fire, constants, self.seed, self.step_number)
        self.state.outcome.draws[0] = rates
        advance_fire(tables.buildings, tables.cover, tables.links, fire, constants)

    def _hurt(self) -> None:
        arrays, health, seed, step = self.state, self.constants.health, self.seed, self.step_number
        people, brigades, codes = arrays.civilians, arrays.brigades, arrays.fire.fieryness
        draws = harm(people.building, people.hp, people.damage, codes, health, 1.0, seed, step, 0)
        shelter(brigades)
        share, first = health.brigade_share, len(people.hp)
        draws += harm(brigades.inside, brigades.hp, brigades.damage, codes, health, share, seed, step, first)
        arrays.outcome.draws[1] = draws

    def _assess(self) -> None:
        assess(
            self.state.fire,
            self.state.civilians,
            self.city_arrays.geometry,
            self.constants.reward_change,
            self.state.outcome,
        )
