"""The planner: every few steps, the joint assignment of actions that comes out best on copies of the world.

An assignment is tried out in rollouts; the search starts from the best of a few and changes one brigade's action at a
time.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable
from dataclasses import astuple, dataclass
from typing import Final

import numpy as np

from fireworld.errors import PolicyError, expected
from fireworld.kernels.addresses import address_row
from fireworld.kernels.arrays import CityArrays, WorldState
from fireworld.policy.kernel import always
from fireworld.policy.protocol import Decision, Observation, Policy
from fireworld.records import ACTIONS
from fireworld.simulation.bound import bind
from fireworld.simulation.state import copy_into, copy_world, score_of

Assignment = tuple[int, ...]
"""(b,) the action of each brigade."""
Value = Callable[[Assignment], float]

OPTION_MAX: Final = 1000
FIRST_SEED: Final = 1 << 32
"""Seeds of runs lie below, those of rollouts at and above: no plan knows the random draws of the run."""
BURNING_COST: Final = 0.005
"""Cost of a building that still burns at the end of a rollout, as a share of the maximal score."""


@dataclass(frozen=True)
class PlannerOptions:
    """How far, how often and with how many rollouts the planner looks ahead; whole numbers from 1 to 1000."""

    horizon: int
    """Steps of a rollout."""
    interval: int
    """Steps for which a plan is followed."""
    rollouts: int
    """Rollouts of each assignment, each with random draws of its own."""

    def __post_init__(self) -> None:
        """Raise PolicyError for numbers out of range."""
        for name, number in vars(self).items():
            if type(number) is not int or not 1 <= number <= OPTION_MAX:
                wanted = f"a whole number from 1 to {OPTION_MAX}"
                raise PolicyError(expected("--policy", f"planner:{name}", wanted, number))


class Forecast:
    """Values of assignments at one moment; each is computed once, in rollouts that overwrite a copy of the world.

    All assignments see the same random draws, so their values differ by what the brigades do, not by chance.
    """

    def __init__(self, observation: Observation, copy: WorldState, options: PlannerOptions) -> None:
        self._observation, self._copy, self._options = observation, copy, options
        self._policy = always(0).for_brigades(len(observation.world.brigades.action))
        city_row = np.concatenate((address_row(observation.city), address_row(observation.constants)))
        self._bound = bind(city_row, address_row(copy), copy.fire, self._policy)
        self._values: dict[Assignment, float] = {}

    def value(self, assignment: Assignment) -> float:
        """Return the value of an assignment that all brigades follow until the horizon: a mean over the rollouts.

        score / maximal score - 0.005 * burning buildings, at the end of the rollout. The second term stands for the
        further cost of the fire that is left.
        """
        held = self._values.get(assignment)
        if held is None:
            self._policy.action[:] = assignment
            n_rollouts, total = self._options.rollouts, 0.0
            for rollout in range(n_rollouts):
                total += self._roll_out(self._observation.step * n_rollouts + rollout)
            held = self._values[assignment] = total / n_rollouts
        return held

    def _roll_out(self, number: int) -> float:
        moment, copy = self._observation, self._copy
        copy_into(copy, moment.world)
        seed, last_step = FIRST_SEED + number, moment.step + self._options.horizon - 1
        self._bound.run(seed, moment.step - 1, last_step)
        score = score_of(copy)
        return score.score / score.score_max - BURNING_COST * score.n_burning


def with_action(assignment: Assignment, brigade: int, action: int) -> Assignment:
    """Return an assignment in which one brigade takes another action."""
    return (*assignment[:brigade], action, *assignment[brigade + 1 :])


def action_values(value: Value, assignment: Assignment, brigade: int) -> tuple[float, ...]:
    """Return the values of a brigade's four actions while the others follow the assignment."""
    return tuple(value(with_action(assignment, brigade, action)) for action in range(len(ACTIONS)))


def climb(value: Value, starts: Iterable[Assignment]) -> Assignment:
    """Return an assignment that no brigade can improve alone: coordinate ascent.

    The best start (ties: the lowest assignment) is improved brigade after brigade, until a whole round changes
    nothing. A change must be worth strictly more, so the climb ends; equal changes: the lowest action. The number of
    values grows with the number of brigades, that of all assignments as its power.
    """
    best = max(sorted(starts), key=value)
    n_settled = 0
    brigade = 0
    while n_settled < len(best):
        values = action_values(value, best, brigade)
        action = values.index(max(values))
        if values[action] > values[best[brigade]]:
            best = with_action(best, brigade, action)
            n_settled = 0
        n_settled += 1
        brigade = (brigade + 1) % len(best)
    return best


class Planner(Policy):
    """Tries out joint assignments of actions in copies of the world, through the kernels that run the world itself.

    It knows the true model and the state of the world, but not its random draws. Policies that see eight features are
    measured by it, and taught by it: its Q-values are the values of a brigade's actions while the others follow the
    plan.
    """

    def __init__(self, *, horizon: int = 30, interval: int = 4, rollouts: int = 1) -> None:
        self.options = PlannerOptions(horizon, interval, rollouts)
        self.digest = hashlib.sha256(repr((astuple(self.options), BURNING_COST)).encode()).hexdigest()
        self._room: WorldState | None = None
        self._planned_at = -1
        self._plan: Assignment = ()
        self._values: tuple[tuple[float, ...], ...] = ()

    def begin(self, city: CityArrays, n_brigades: int, seed: int) -> None:
        """Forget the run before."""
        del city, n_brigades, seed  # the seed above all: a plan must not know the random draws of the run
        self._room, self._planned_at, self._plan = None, -1, ()

    def decide(self, observation: Observation) -> Decision:
        """Follow the plan; the first brigade that chooses in a period of `interval` steps makes it.

        Periods follow the step number, not the age of the plan: a run that is resumed plans at the same steps.
        """
        step, brigade, interval = observation.step, observation.brigade, self.options.interval
        if not self._plan or step // interval != self._planned_at // interval:
            self._make_plan(observation)
        values = self._values[brigade] if step == self._planned_at else None
        return Decision(self._plan[brigade], q_values=values)

    def _make_plan(self, observation: Observation) -> None:
        if self._room is None:
            self._room = copy_world(observation.world)
        self._planned_at = observation.step
        n_brigades = len(observation.world.brigades.action)
        forecast = Forecast(observation, self._room, self.options)
        starts = [(action,) * n_brigades for action in range(len(ACTIONS))]
        if self._plan:
            starts.append(self._plan)
        self._plan = climb(forecast.value, starts)
        self._values = tuple(action_values(forecast.value, self._plan, brigade) for brigade in range(n_brigades))
