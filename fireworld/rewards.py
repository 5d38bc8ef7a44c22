"""The reward: what a step is worth to the team, a weighted sum of terms. Scenarios, kernels and docs all read this.

To add a kind of reward, add it to `Kind`, `KINDS` and `rewarded`. To add a term, add it to `TERMS` and `amounts`, and a
field of its name to `fireworld.records.Rewards`: what is not recorded cannot be compared.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple, TypeVar

if TYPE_CHECKING:
    from numpy.typing import NDArray

Kind = Literal["stock", "change"]
Values = TypeVar("Values", float, "NDArray[Any]")
KINDS: Final[dict[Kind, str]] = {
    "stock": "the weighted sum after the step, at every step anew",
    "change": "how that sum changed in the step",
}
"""How the reward follows from the weighted sum of the terms. The paper's is stock."""
STOCK, CHANGE = 0, 1
"""Positions in KINDS."""


class Term(NamedTuple):
    """One term of the reward."""

    name: str
    paper_weight: float
    meaning: str
    """What its amount is."""


TERMS: Final = (
    Term("water_damaged", -1.0, "the number of buildings with codes 4 to 7"),
    Term("burning", -2.0, "the number of buildings with codes 1 to 3"),
    Term("burnt_out", -3.0, "the number of buildings with code 8"),
    Term("civilians", 1.0, "HP - full HP, summed over the civilians"),
)
"""In the order in which they are recorded and added up."""


class Tally(NamedTuple):
    """What can be counted after a step."""

    n_burning: int
    n_water_damaged: int
    n_burnt_out: int
    n_civilians_alive: int
    hp: int
    """Of all civilians together."""
    full_hp: int
    """The same before anybody was hurt."""


class Reward(NamedTuple):
    """What kernels need to know of a reward."""

    kind: int
    """Position in KINDS."""
    weights: tuple[float, float, float, float]
    """One of each term."""


def amounts(tally: Tally) -> tuple[float, float, float, float]:
    """Return the amount of every term; compiled by `fireworld.kernels.outcome`."""
    return (
        float(tally.n_water_damaged),
        float(tally.n_burning),
        float(tally.n_burnt_out),
        float(tally.hp - tally.full_hp),
    )


def rewarded(kind: int, now: float, before: float) -> float:
    """Return a term's reward; compiled by `fireworld.kernels.outcome`.

    Args:
        kind: position in KINDS.
        now: weight * amount after the step.
        before: the same before the step.
    """
    return now - before if kind == CHANGE else now


def worth_of_building(code: int, weights: tuple[float, float, float, float]) -> float:
    """Return what a building adds to the weighted sum; compiled by `fireworld.kernels.own_reward`.

    Args:
        code: its fieryness.
        weights: one of each term.
    """
    if code == 0:
        return 0.0
    if code <= 3:
        return weights[1]
    return weights[0] if code <= 7 else weights[2]


def share_gained(score: Values, score_max: Values, before: Values) -> Values:
    """Return what a step is worth to learners in environments, if nothing else is asked for.

    Args:
        score: after the step.
        score_max: its maximum.
        before: score / maximum before the step.
    """
    gained: Values = score / score_max - before
    return gained


def reward_of(kind: Kind, weights: Mapping[str, float] | None = None) -> Reward:
    """Return a reward for kernels.

    Args:
        kind: one of KINDS.
        weights: by term; terms left out count 0. None: the paper's.
    """
    given = paper_weights() if weights is None else weights
    damaged, burning, burnt_out, health = (float(given.get(term.name, 0.0)) for term in TERMS)
    return Reward(list(KINDS).index(kind), (damaged, burning, burnt_out, health))


def paper_weights() -> dict[str, float]:
    """Return the paper's weights by term."""
    return {term.name: term.paper_weight for term in TERMS}
