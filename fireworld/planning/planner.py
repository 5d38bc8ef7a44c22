"""The planner: every few steps, the joint assignment of actions that comes out best in rollouts."""

from __future__ import annotations

import hashlib
from dataclasses import astuple, dataclass
from typing import Final

from fireworld.errors import PolicyError, expected
from fireworld.kernels.arrays import CityArrays, WorldState
from fireworld.planning.forecast import BURNING_COST, Assignment, Forecast
from fireworld.planning.search import action_values, climb
from fireworld.policy.protocol import Decision, Observation, Policy
from fireworld.records import ACTIONS
from fireworld.simulation.state import copy_world

OPTION_MAX: Final = 1000


@dataclass(frozen=True)
class PlannerOptions:
    """How far, how often and with how many rollouts the planner looks ahead; whole numbers from 1 to 1000."""

    horizon: int = 30
    """Steps of a rollout."""
    interval: int = 4
    """Steps for which a plan is followed."""
    rollouts: int = 1
    """Rollouts of each assignment, each with random draws of its own."""

    def __post_init__(self) -> None:
        """Raise PolicyError for numbers out of range."""
        for name, number in vars(self).items():
            if type(number) is not int or not 1 <= number <= OPTION_MAX:
                wanted = f"a whole number from 1 to {OPTION_MAX}"
                raise PolicyError(expected("--policy", f"planner:{name}", wanted, number))


class Planner(Policy):
    """Tries out joint assignments of actions in copies of the world, through the kernels that run the world itself.

    It knows the true model and the state of the world, but not its random draws. Policies that see eight features are
    measured by it, and taught by it: its Q-values are the values of a brigade's actions while the others follow the
    plan.
    """

    def __init__(self, options: PlannerOptions | None = None) -> None:
        self.options = options if options is not None else PlannerOptions()
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
        options, n_brigades = self.options, len(observation.world.brigades.action)
        forecast = Forecast(observation, self._room, horizon=options.horizon, rollouts=options.rollouts)
        starts = [(action,) * n_brigades for action in range(len(ACTIONS))]
        if self._plan:
            starts.append(self._plan)
        self._plan = climb(forecast.value, starts)
        self._values = tuple(action_values(forecast.value, self._plan, brigade) for brigade in range(n_brigades))


def planner(
    *,
    horizon: int = PlannerOptions.horizon,
    interval: int = PlannerOptions.interval,
    rollouts: int = PlannerOptions.rollouts,
) -> Planner:
    """Return a planner, by its parameters on the command line; errors as for `PlannerOptions`."""
    return Planner(PlannerOptions(horizon, interval, rollouts))
