"""The planner: every few steps, the joint assignment of options that comes out best on copies of the world.

A brigade's options are the four actions, and to follow a policy where the planner is `over` one. An assignment is tried
out in rollouts; the search starts from the best of a few and changes one brigade's option at a time.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Iterable
from dataclasses import astuple, dataclass, replace
from typing import Final

import numpy as np

from fireworld.errors import PolicyError, expected
from fireworld.kernels.addresses import address_row
from fireworld.kernels.arrays import CityArrays, WorldState
from fireworld.kernels.choice import FIXED
from fireworld.policy.kernel import KernelPolicy, always
from fireworld.policy.names import find_policy
from fireworld.policy.protocol import Decision, Observation, Policy
from fireworld.records import ACTIONS
from fireworld.simulation.bound import bind
from fireworld.simulation.state import copy_into, copy_world, score_of

Assignment = tuple[int, ...]
"""(b,) the option of each brigade: an action, or FOLLOW."""
Value = Callable[[Assignment], float]
FOLLOW: Final = -1
"""The option to decide as the policy does that the planner is over."""
ACTION_OPTIONS: Final = tuple(range(len(ACTIONS)))

OPTION_MAX: Final = 1000
MILLISECONDS_MAX: Final = 60_000
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
            checked_option(name, number, least=1, most=OPTION_MAX)


def checked_option(name: str, number: object, *, least: int, most: int) -> int:
    """Return an option's number; PolicyError if it is none, or out of range."""
    if type(number) is not int or not least <= number <= most:
        raise PolicyError(expected("--policy", f"planner:{name}", f"a whole number from {least} to {most}", number))
    return number


class Forecast:
    """Values of assignments at one moment; each is computed once, in rollouts that overwrite a copy of the world.

    All assignments see the same random draws, so their values differ by what the brigades do, not by chance.
    """

    def __init__(
        self, observation: Observation, copy: WorldState, options: PlannerOptions, followed: KernelPolicy | None = None
    ) -> None:
        self._observation, self._copy, self._options = observation, copy, options
        n_brigades = len(observation.world.brigades.action)
        self.followed = (always(0) if followed is None else followed).for_brigades(n_brigades)
        self._policy = self.followed._replace(kind=self.followed.kind.copy(), action=self.followed.action.copy())
        city_row = np.concatenate((address_row(observation.city), address_row(observation.constants)))
        self._bound = bind(city_row, address_row(copy), copy.fire, self._policy)
        self._values: dict[Assignment, float] = {}

    def value(self, assignment: Assignment) -> float:
        """Return the value of an assignment that all brigades follow until the horizon: the mean of `worth_of`."""
        held = self._values.get(assignment)
        if held is None:
            self._assign(assignment)
            n_rollouts, total = self._options.rollouts, 0.0
            for rollout in range(n_rollouts):
                total += self._roll_out(self._observation.step * n_rollouts + rollout)
            held = self._values[assignment] = total / n_rollouts
        return held

    def _assign(self, assignment: Assignment) -> None:
        """Let each brigade of the rollouts do what an assignment says."""
        option = np.array(assignment)
        follows, policy, followed = option == FOLLOW, self._policy, self.followed
        policy.kind[:] = np.where(follows, followed.kind, FIXED)
        policy.action[:] = np.where(follows, followed.action, option)

    def _roll_out(self, number: int) -> float:
        moment, copy = self._observation, self._copy
        copy_into(copy, moment.world)
        seed, last_step = FIRST_SEED + number, moment.step + self._options.horizon - 1
        self._bound.run(seed, moment.step - 1, last_step)
        return worth_of(copy)


def worth_of(world: WorldState) -> float:
    """Return what a rollout has come to: score / maximal score - 0.005 * burning buildings.

    The second term stands for the further cost of the fire that is left.
    """
    score = score_of(world)
    return score.score / score.score_max - BURNING_COST * score.n_burning


def with_option(assignment: Assignment, brigade: int, option: int) -> Assignment:
    """Return an assignment in which one brigade takes another option."""
    return (*assignment[:brigade], option, *assignment[brigade + 1 :])


def option_values(
    value: Value, assignment: Assignment, brigade: int, options: Iterable[int] = ACTION_OPTIONS
) -> dict[int, float]:
    """Return the values of a brigade's options while the others follow the assignment."""
    return {option: value(with_option(assignment, brigade, option)) for option in options}


def climb(
    value: Value,
    starts: Iterable[Assignment],
    options: tuple[int, ...] = ACTION_OPTIONS,
    is_late: Callable[[], bool] = lambda: False,
) -> Assignment:
    """Return an assignment that no brigade can improve alone: coordinate ascent.

    The best start (ties: the lowest assignment) is improved brigade after brigade, until a whole round changes
    nothing. A change must be worth strictly more, so the climb ends; equal changes: the first option. The number of
    values grows with the number of brigades, that of all assignments as its power. Once it is late, the best so far.
    """
    best = max(sorted(starts), key=value)
    n_settled = 0
    brigade = 0
    while n_settled < len(best) and not is_late():
        values = option_values(value, best, brigade, options)
        option = max(options, key=lambda option: values[option])
        if values[option] > values[best[brigade]]:
            best = with_option(best, brigade, option)
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

    def __init__(
        self, *, horizon: int = 30, interval: int = 4, rollouts: int = 1, over: object = None, milliseconds: int = 0
    ) -> None:
        """Make a planner.

        Args:
            horizon: steps of a rollout, 1 to 1000.
            interval: steps for which a plan is followed.
            rollouts: of each assignment.
            over: a policy that kernels follow, in any form that `find_policy` takes: to decide as it does is an
                option of each brigade, so that the planner improves it. None: only the four actions are.
            milliseconds: of processor time a step to search in, before the options are valued once more; 0: no limit.
                With a limit no two runs need be the same.

        Raises:
            PolicyError: there is no such policy, or kernels cannot follow it; a number is out of range.
        """
        self.options = PlannerOptions(horizon, interval, rollouts)
        self.followed = None if over is None else _followed(over)
        """The policy that the planner is over, None if there is none."""
        self._options = ACTION_OPTIONS if over is None else (FOLLOW, *ACTION_OPTIONS)
        self._milliseconds = checked_option("milliseconds", milliseconds, least=0, most=MILLISECONDS_MAX)
        identity: tuple[object, ...] = (astuple(self.options), BURNING_COST)
        if self.followed is not None or self._milliseconds:
            identity += ("" if self.followed is None else self.followed.digest, self._milliseconds)
        self.digest = hashlib.sha256(repr(identity).encode()).hexdigest()
        self._room: WorldState | None = None
        self.planned_at = -1
        """The step in which the last plan was made, -1 before the first."""
        self._plan: Assignment = ()
        self.values: tuple[dict[int, float], ...] = ()
        """(b,) of each brigade what every option is worth in that step, while the others follow the plan."""

    def begin(self, city: CityArrays, n_brigades: int, seed: int) -> None:
        """Forget the run before."""
        self._room, self.planned_at, self._plan = None, -1, ()
        if self.followed is not None:  # no plan knows the random draws of the run; a policy that is followed may
            self.followed.begin(city, n_brigades, seed)

    def decide(self, observation: Observation) -> Decision:
        """Follow the plan; the first brigade that chooses in a period of `interval` steps makes it.

        Periods follow the step number, not the age of the plan: a run that is resumed plans at the same steps.
        """
        step, brigade = observation.step, observation.brigade
        if self.plans_in(step):
            self._make_plan(observation)
        option, values, worth = self._plan[brigade], None, None
        if step == self.planned_at:
            own = self.values[brigade]
            values, worth = tuple(own[action] for action in ACTION_OPTIONS), own[option]
        if option != FOLLOW:
            return Decision(option, q_values=values)
        assert self.followed is not None  # noqa: S101 - nobody else has the option
        return replace(self.followed.decide(observation), q_values=values, value=worth)

    def plans_in(self, step: int) -> bool:
        """Return whether the next brigade that chooses in a step makes a plan: there is none of this period."""
        interval = self.options.interval
        return not self._plan or step // interval != self.planned_at // interval

    def _make_plan(self, observation: Observation) -> None:
        if self._room is None:
            self._room = copy_world(observation.world)
        self.planned_at = observation.step
        n_brigades = len(observation.world.brigades.action)
        forecast = Forecast(observation, self._room, self.options, self.followed)
        starts = [(option,) * n_brigades for option in self._options]
        if self._plan:
            starts.append(self._plan)
        late = time.thread_time() + self._milliseconds * self.options.interval / 1000.0
        self._plan = climb(
            forecast.value, starts, self._options, lambda: self._milliseconds > 0 and time.thread_time() >= late
        )
        self.values = tuple(
            option_values(forecast.value, self._plan, brigade, self._options) for brigade in range(n_brigades)
        )


def _followed(given: object) -> KernelPolicy:
    """Return a policy that rollouts can follow."""
    named = find_policy(given)
    if not isinstance(named.policy, KernelPolicy):
        wanted = "a rule, a team or a network, which kernels follow"
        raise PolicyError(expected("--policy", "planner:over", wanted, named.name))
    return replace(named.policy)
