"""How a run came out: one table of quantities, which the terminal, pages, JSON, results and comparisons walk.

To add a score that follows from what is recorded, add a property to `Outcome` and a row to `QUANTITIES`; to compare
policies by it, a row to `METRICS`; and if it needs an attribute that results files do not hold yet, a row to `COLUMNS`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, TypeVar

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fireworld.records import CityRecord, Rewards, Score, StepRecord

NOT_RECORDED: Final = "not recorded"
"""What stands in the place of a number that an imported log does not have."""

Values = TypeVar("Values", float, "NDArray[Any]")


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """How a run stands after its last step."""

    steps: int
    """Last step done."""
    completed: bool
    """Nothing burns any more."""
    score: float
    """Official score of the paper's time."""
    score_max: float
    """Number of civilians + 1."""
    score_now: float
    """Official score of today."""
    n_buildings: int
    n_burning: int
    n_water_damaged: int
    n_burnt_out: int
    n_civilians: int
    n_civilians_alive: int
    total_reward: float
    """Undiscounted return of the team; NaN where it was not recorded."""
    water_used_litres: float
    """Sprayed by all brigades; NaN where it was not recorded."""

    @property
    def score_share(self) -> float:
        """Score as a share of its maximum."""
        return self.score / self.score_max

    @property
    def time_to_complete(self) -> int | None:
        """The step at which nothing burned any more; None if something still burns."""
        return self.steps if self.completed else None


def outcome_at(
    score: Score, rewards: Rewards, *, steps: int, completed: bool, n_buildings: int, n_civilians: int
) -> Outcome:
    """Return how a run stands, from what is recorded of a step."""
    return Outcome(
        steps=steps,
        completed=completed,
        score=score.score,
        score_max=score.score_max,
        score_now=score.score_now,
        n_buildings=n_buildings,
        n_burning=score.n_burning,
        n_water_damaged=score.n_water_damaged,
        n_burnt_out=score.n_burnt_out,
        n_civilians=n_civilians,
        n_civilians_alive=score.n_civilians_alive,
        total_reward=rewards.sum_so_far,
        water_used_litres=score.water_used_litres,
    )


def outcome_of(record: StepRecord, city: CityRecord) -> Outcome:
    """Return how a run stands after a recorded step.

    Args:
        record: the step.
        city: where it was.
    """
    return outcome_at(
        record.score,
        record.rewards,
        steps=record.step,
        completed=record.terminated,
        n_buildings=len(city.building_id),
        n_civilians=len(city.civilian_hp),
    )


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """One part of how a run came out."""

    name: str
    """Attribute of `Outcome`, and key in JSON."""
    label: str
    unit: str
    digits: int
    """Decimals of a mean."""
    higher_is_better: bool | None
    """None: neither is better by itself."""
    wording: Callable[[Outcome], str]
    """Returns it as text, with its unit, where it is known."""
    field: str = ""
    """Where a log has it step by step, as in "score.n_burnt_out"; empty if it only follows from other fields."""

    def text(self, outcome: Outcome) -> str:
        """Return it as text, with its unit."""
        return self.wording(outcome) if self.is_known(outcome) else NOT_RECORDED

    def is_known(self, outcome: Outcome) -> bool:
        """Return whether the log that the outcome is of has it."""
        value = getattr(outcome, self.name)
        return value is None or not math.isnan(value)


def _time(outcome: Outcome) -> str:
    if outcome.completed and 2 * outcome.n_burnt_out > outcome.n_buildings:
        return f"{outcome.steps} steps; the city burnt down"
    if outcome.completed:
        return f"{outcome.steps} steps"
    if outcome.n_burning == 0:  # a kernel continues when nothing burns any more
        return f"nothing burns after {outcome.steps} steps"
    return f"not within {outcome.steps} steps"


QUANTITIES: Final = (
    Quantity(
        name="score",
        label="score",
        unit="",
        digits=3,
        higher_is_better=True,
        wording=lambda outcome: f"{outcome.score:.3f} of {outcome.score_max:.0f}",
        field="score.score",
    ),
    Quantity(
        name="time_to_complete",
        label="time to complete",
        unit="steps",
        digits=1,
        higher_is_better=False,
        wording=_time,
    ),
    Quantity(
        name="n_burnt_out",
        label="burnt out",
        unit="buildings",
        digits=1,
        higher_is_better=False,
        wording=lambda outcome: f"{outcome.n_burnt_out} of {outcome.n_buildings} buildings",
        field="score.n_burnt_out",
    ),
    Quantity(
        name="n_burning",
        label="still burning",
        unit="buildings",
        digits=1,
        higher_is_better=False,
        wording=lambda outcome: str(outcome.n_burning),
        field="score.n_burning",
    ),
    Quantity(
        name="n_water_damaged",
        label="water-damaged",
        unit="buildings",
        digits=1,
        higher_is_better=None,
        wording=lambda outcome: str(outcome.n_water_damaged),
        field="score.n_water_damaged",
    ),
    Quantity(
        name="n_civilians_alive",
        label="civilians alive",
        unit="civilians",
        digits=2,
        higher_is_better=True,
        wording=lambda outcome: f"{outcome.n_civilians_alive} of {outcome.n_civilians}",
        field="score.n_civilians_alive",
    ),
    Quantity(
        name="total_reward",
        label="return",
        unit="",
        digits=0,
        higher_is_better=True,
        wording=lambda outcome: f"{outcome.total_reward:,.0f}",
        field="rewards.sum_so_far",
    ),
    Quantity(
        name="water_used_litres",
        label="water used",
        unit="litres",
        digits=0,
        higher_is_better=None,
        wording=lambda outcome: f"{outcome.water_used_litres:,.0f} litres",
        field="score.water_used_litres",
    ),
)
"""How a run came out, the most important first."""


@dataclass(frozen=True, kw_only=True)
class Metric:
    """What policies are compared by."""

    name: str
    """On the command line, in `fw.compare` and in JSON."""
    label: str
    attribute: str
    """Of `Outcome`; it must follow from `COLUMNS`."""
    unit: str
    digits: int
    """Decimals of a mean."""
    higher_is_better: bool

    def gain(self, difference: Values) -> Values:
        """Return a difference, or an array of them, with the sign that makes more better."""
        return difference if self.higher_is_better else -difference


def _metric(name: str, quantity: str, *, attribute: str = "", unit: str = "") -> Metric:
    """Return a quantity as a metric; where runs are compared by another attribute, in its unit."""
    found = next(each for each in QUANTITIES if each.name == quantity)
    return Metric(
        name=name,
        label=found.label,
        attribute=attribute or quantity,
        unit=unit or found.unit,
        digits=found.digits,
        higher_is_better=bool(found.higher_is_better),
    )


METRICS: Final = (
    _metric("score", "score", attribute="score_share", unit="of the maximum"),
    _metric("burnt-out", "n_burnt_out"),
    _metric("time", "time_to_complete", attribute="steps"),
    _metric("civilians", "n_civilians_alive"),
)
"""What policies are compared by, the default first. Time counts to the last step where something still burns."""

COLUMNS: Final = {
    "score": "score",
    "score_max": "score_max",
    "burnt_out": "n_burnt_out",
    "steps": "steps",
    "completed": "completed",
    "civilians_alive": "n_civilians_alive",
    "total_reward": "total_reward",
    "water_litres": "water_used_litres",
}
"""Columns of results files, and the attribute of `Outcome` in each. Add new ones at the end: files without them stay
readable, and their runs are made again where the new column is needed."""
