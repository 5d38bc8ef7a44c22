"""Tables of a reproduction: the paper's values beside ours, with a plain verdict for every cell."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from fireworld.evaluation.statistics import Estimate, estimate, paired_difference, probability_of_improvement
from fireworld.kernels.arrays import Array
from fireworld.reproduction import paper
from fireworld.reproduction.study import (
    ALONE,
    DIFFERENT_ALONE,
    FIXED,
    RANDOM_ALONE,
    RANDOM_ALONE_FOR_ALL,
    RANDOM_TABLES,
    TEAMS,
    TOGETHER,
    TOGETHER_WITHOUT_FLAGS,
    Study,
)

WITHIN: Final = "within the interval"
NEAR: Final = "within 25 %"
APART: Final = "not"
_NEAR_SHARE: Final = 0.25


@dataclass(frozen=True)
class PaperCell:
    """One value of the paper, and what we measured."""

    scenario: str
    quantity: str
    team: str
    paper: float
    ours: Estimate
    ours_max: float | None = None  # greatest possible value, of a score

    @property
    def verdict(self) -> str:
        """Whether the paper's value lies within our interval, our mean within 25 % of it, or neither."""
        if self.ours.low <= self.paper <= self.ours.high:
            return WITHIN
        return NEAR if self.is_near else APART

    @property
    def is_near(self) -> bool:
        """Whether our mean lies within 25 % of the paper's value: says more than an interval that is wide."""
        return abs(self.ours.mean - self.paper) <= _NEAR_SHARE * self.paper


@dataclass(frozen=True)
class PaperPair:
    """A value of Table 2 or 3 without and with cooperation, and what cooperation changes."""

    without: PaperCell
    together: PaperCell
    difference: Estimate  # with - without, run by run

    @property
    def claim_holds(self) -> bool | None:
        """Whether cooperation changes the value the way the paper says; None: the interval spans zero."""
        change = self.difference
        if not (change.above_zero or change.below_zero):
            return None
        return change.above_zero == (self.together.paper > self.without.paper)


@dataclass(frozen=True)
class TeamShare:
    """How a team does, as a share of the greatest score."""

    team: str
    by_scenario: Sequence[Estimate]
    mean: Estimate


@dataclass(frozen=True)
class TeamComparison:
    """Two teams on the same repetitions and seeds; share of the greatest score, mean over tests."""

    team: str
    other: str
    question: str
    difference: Estimate
    improvement: Estimate  # probability that a run of the first is the better one


@dataclass(frozen=True)
class PaperTables:
    """All tables of a reproduction."""

    world: paper.World
    trainings: Sequence[PaperCell]
    converged: Sequence[Estimate]
    """Share of the repetitions in which the policy settled, by rows of Table 1."""
    tests: Sequence[PaperPair]
    more_brigades: Sequence[PaperPair]
    shares: Sequence[TeamShare]  # over the tests of Table 2
    shares_more_brigades: Sequence[TeamShare]  # over the tests of Table 3
    comparisons: Sequence[TeamComparison]  # over the tests of Table 2
    agreement: Estimate
    """Share of the states met in which all brigades of the cooperative team prefer the same action."""


def make_tables(study: Study) -> PaperTables:
    """Judge a study."""
    world = study.world
    names_2, names_3 = [row.scenario for row in world.table_2], [row.scenario for row in world.table_3]
    shares = _shares(study, names_2)
    return PaperTables(
        world=world,
        trainings=[cell for row in world.table_1 for cell in _training_cells(study, row)],
        converged=[
            estimate(_column(curve.converged for curve in study.curves_of(TOGETHER, row.scenario)))
            for row in world.table_1
        ],
        tests=[pair for row in world.table_2 for pair in _pairs(study, row)],
        more_brigades=[pair for row in world.table_3 for pair in _pairs(study, row)],
        shares=shares,
        shares_more_brigades=_shares(study, names_3),
        comparisons=_comparisons(study, names_2, shares),
        agreement=estimate(_column(study.agreement)),
    )


def cells_of(pairs: Iterable[PaperPair]) -> list[PaperCell]:
    """Return the cells of pairs, one after another."""
    return [cell for pair in pairs for cell in (pair.without, pair.together)]


def _column(values: Iterable[float]) -> Array:
    """Return one value a repetition as (repetitions, 1)."""
    return np.array([[value] for value in values], dtype=np.float64)


def _training_cells(study: Study, row: paper.PaperTraining) -> list[PaperCell]:
    curves = study.curves_of(TOGETHER, row.scenario)
    episodes = estimate(_column(curve.n_episodes for curve in curves))
    score = estimate(_column(curve.score for curve in curves))
    return [
        PaperCell(row.scenario, "convergence episode", TOGETHER, row.convergence_episode, episodes),
        PaperCell(row.scenario, "score", TOGETHER, row.score, score, curves[0].score_max),
    ]


def _pairs(study: Study, row: paper.PaperTest) -> list[PaperPair]:
    made = []
    for quantity, key, values in (
        ("time to complete", "steps", row.steps),
        ("burnt out", "n_burnt_out", row.burnt_out),
        ("score", "score", row.score),
    ):
        without, together = study.values(row.scenario, ALONE, key), study.values(row.scenario, TOGETHER, key)
        best = float(study.values(row.scenario, ALONE, "score_max")[0, 0]) if key == "score" else None
        made.append(
            PaperPair(
                PaperCell(row.scenario, quantity, ALONE, values[0], estimate(without), best),
                PaperCell(row.scenario, quantity, TOGETHER, values[1], estimate(together), best),
                paired_difference(together, without),
            )
        )
    return made


def _shares(study: Study, scenarios: Sequence[str]) -> list[TeamShare]:
    return [
        TeamShare(
            team=team,
            by_scenario=[estimate(study.values(scenario, team, "score_share")) for scenario in scenarios],
            mean=estimate(study.mean_share(scenarios, team)),
        )
        for team in TEAMS
    ]


def _comparisons(study: Study, scenarios: Sequence[str], shares: Sequence[TeamShare]) -> list[TeamComparison]:
    best_rule = max((row for row in shares if row.team in FIXED), key=lambda row: row.mean.mean).team
    asked = [
        (TOGETHER, ALONE, "is the paper's cooperative team better than its non-cooperative one?"),
        (TOGETHER, TOGETHER_WITHOUT_FLAGS, "do the flags that tell what the others do help?"),
        (TOGETHER_WITHOUT_FLAGS, ALONE, "does training in the team help, without the flags?"),
        (TOGETHER, RANDOM_TABLES, "is what the team learned better than tables drawn at random?"),
        (RANDOM_ALONE, RANDOM_ALONE_FOR_ALL, "does it help that brigades differ, where nothing is learned?"),
        (DIFFERENT_ALONE, ALONE, "does it help that brigades differ, where each was trained alone?"),
        (RANDOM_TABLES, RANDOM_ALONE, "do the flags help where nothing is learned?"),
        (ALONE, RANDOM_ALONE_FOR_ALL, "is what one brigade learned alone better than one table drawn at random?"),
        (TOGETHER, "random", "is it better than random actions?"),
        (TOGETHER, best_rule, "is it better than the best of the rules that learn nothing (chosen on these tests)?"),
    ]
    made = []
    for team, other, question in asked:
        values = study.mean_share(scenarios, team), study.mean_share(scenarios, other)
        made.append(
            TeamComparison(team, other, question, paired_difference(*values), probability_of_improvement(*values))
        )
    return made
