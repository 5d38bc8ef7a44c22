"""The planner: every few steps, the joint assignment of actions that comes out best in rollouts."""

from __future__ import annotations

import hashlib
from dataclasses import astuple, dataclass, fields
from difflib import get_close_matches
from typing import Final, NoReturn

from fireworld.errors import PolicyError, expected
from fireworld.kernels.arrays import CityArrays, WorldState
from fireworld.planning.forecast import BURNING_COST, Assignment, Forecast
from fireworld.planning.search import action_values, climb
from fireworld.policy.protocol import Decision, Observation
from fireworld.records import ACTIONS
from fireworld.simulation.state import copy_world

OPTION_MAX: Final = 1000


@dataclass(frozen=True)
class PlannerOptions:
    """How far, how often and how often over the planner looks ahead; whole numbers from 1 to 1000."""

    horizon: int = 30
    """Steps of a rollout."""
    interval: int = 4
    """Steps that an assignment is kept for."""
    rollouts: int = 1
    """Rollouts of each assignment, each with luck of its own."""

    def __post_init__(self) -> None:
        """Refuse numbers out of range.

        Raises:
            PolicyError: a number is not from 1 to 1000.
        """
        for field in fields(self):
            number = getattr(self, field.name)
            if not 1 <= number <= OPTION_MAX:
                _refuse(field.name, number)


class Planner:
    """Tries out joint assignments of actions in copies of the world, through the kernels that run the world itself.

    It knows the true model and the state of the world, but not its luck. It is what a policy that looks at eight
    features is measured by, and taught by: its Q-values are what each action of a brigade is worth while the others
    keep to the plan.
    """

    def __init__(self, options: PlannerOptions | None = None) -> None:
        self.options = options if options is not None else PlannerOptions()
        self._room: WorldState | None = None
        self._planned_at = -1
        self._plan: Assignment = ()
        self._values: tuple[tuple[float, ...], ...] = ()

    @property
    def digest(self) -> str:
        """SHA-256 of what the planner does."""
        return hashlib.sha256(repr((astuple(self.options), BURNING_COST)).encode()).hexdigest()

    def begin(self, city: CityArrays, n_brigades: int, seed: int) -> None:
        """Forget the run before."""
        del city, n_brigades, seed  # the seed above all: a plan must not know the luck of the run
        self._room, self._planned_at, self._plan = None, -1, ()

    def decide(self, observation: Observation) -> Decision:
        """Do what the plan says; the first brigade that chooses in a period of `interval` steps makes the plan.

        Periods follow the clock, not the age of the plan: a run taken up in its midst plans at the same steps.
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


def planner(text: str = "") -> Planner:
    """Return a planner with options as they stand on the command line.

    Args:
        text: "horizon=30,interval=4,rollouts=1"; what is left out keeps its default.

    Raises:
        PolicyError: an unknown option, one given twice, or not a whole number from 1 to 1000.
    """
    given: dict[str, int] = {}
    for part in text.split(",") if text else ():
        name, _, number = part.partition("=")
        known = [field.name for field in fields(PlannerOptions)]
        if name not in known:
            near = get_close_matches(name, known, n=1)
            hint = f"try {near[0]}" if near else ""
            raise PolicyError(expected("--policy", "planner", "options " + ", ".join(known), name, hint))
        if name in given:
            raise PolicyError(expected("--policy", "planner", "every option once", f"{name} twice"))
        if not (number.isascii() and number.isdecimal() and len(number) < 10):
            _refuse(name, number)
        given[name] = int(number)
    return Planner(PlannerOptions(**given))


def _refuse(name: str, number: object) -> NoReturn:
    raise PolicyError(expected("--policy", f"planner:{name}", f"a whole number from 1 to {OPTION_MAX}", number))
