"""Study: everything that a reproduction of the paper has measured, before any of it is judged."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from fireworld.evaluation.runs import Outcomes
from fireworld.kernels.arrays import Array
from fireworld.reproduction.paper import TESTS, World
from fireworld.training.log.records import Episode
from fireworld.training.methods.sarsa import EpisodeReport

ALONE: Final = "non-cooperative"
TOGETHER: Final = "cooperative"
TOGETHER_WITHOUT_FLAGS: Final = "270-states-in-team"
RANDOM_TABLES: Final = "random-tables"
RANDOM_ALONE: Final = "random-270"
RANDOM_ALONE_FOR_ALL: Final = "random-270-for-all"
DIFFERENT_ALONE: Final = "non-cooperative-different"
PLANNER: Final = "planner"
NO_WATER: Final = "no-water"
FIXED: Final = ("easiest", "nearest-to-civilian", "nearest-to-center", "nearest-to-me", "each-another", "chief")
"""Policies that are rules, neither learned nor random."""

TEAMS: Final[Mapping[str, str]] = {
    TOGETHER: "the paper's cooperative team: 4320 states, trained alone, then together",
    ALONE: "the paper's non-cooperative team: 270 states, trained alone",
    TOGETHER_WITHOUT_FLAGS: "control: 270 states, trained alone, then together",
    DIFFERENT_ALONE: "control: 270 states, trained alone, every brigade the table of another training",
    RANDOM_ALONE_FOR_ALL: "control: 270 states, one table for all, every entry drawn at random",
    RANDOM_ALONE: "control: 270 states, every entry drawn at random",
    RANDOM_TABLES: "control: 4320 states, every entry drawn at random",
    "random": "control: a random action in every step",
    **dict.fromkeys(FIXED[:4], "control: always this action"),
    "each-another": "control: every brigade another action",
    "chief": "control: a rule written by hand",
    PLANNER: "control: tries out actions in copies of the world",
    NO_WATER: "control: the fire left to itself",
}
"""What is tested, by name."""
RULES: Final = ("random", *FIXED, NO_WATER)
UNTAUGHT: Final = (*RULES, PLANNER)  # teams that do not differ between repetitions
MIXED: Final = (DIFFERENT_ALONE, RANDOM_ALONE_FOR_ALL, RANDOM_ALONE)  # tested once all repetitions are trained
LEARNED: Final = tuple(team for team in TEAMS if team not in (*UNTAUGHT, *MIXED))

Tested = dict[str, dict[str, Outcomes]]  # outcomes by scenario and team


@dataclass(frozen=True)
class LearningCurve:
    """How one team learned in one scenario of its training."""

    repetition: int
    team: str
    """TOGETHER or TOGETHER_WITHOUT_FLAGS; both begin with the same stage alone, listed once, as ALONE."""
    scenario: str
    scenario_number: int  # counted through the curriculum, from 0
    converged: bool
    score: float  # of the last episode
    score_max: float
    total_reward: Array  # (episodes,) return of each episode
    n_changed: Array  # (episodes,) states whose greedy action changed

    @property
    def n_episodes(self) -> int:
        """Episodes until the policy had settled, or until the method gave up."""
        return len(self.total_reward)


def learning_curve(
    episodes: Sequence[EpisodeReport | Episode], *, repetition: int, team: str, scenario: str, number: int
) -> LearningCurve:
    """Return how a team learned in a scenario.

    Args:
        episodes: all of the scenario, in their order.
        repetition: number of the repetition.
        team: as `LearningCurve.team`.
        scenario: its name.
        number: of the scenario, counted through the curriculum, from 0.
    """
    last = episodes[-1]
    return LearningCurve(
        repetition=repetition,
        team=team,
        scenario=scenario,
        scenario_number=number,
        converged=last.converged,
        score=last.score,
        score_max=last.score_max,
        total_reward=np.array([episode.total_reward for episode in episodes]),
        n_changed=np.array([episode.n_changed for episode in episodes], dtype=np.int64),
    )


@dataclass(frozen=True)
class Study:
    """All that was measured."""

    n_repetitions: int
    seeds: Sequence[int]  # of the test runs
    curves: Sequence[LearningCurve]  # of all repetitions
    outcomes: Mapping[str, Mapping[str, Sequence[Outcomes]]]
    """By scenario and team: one Outcomes a repetition, one in all for UNTAUGHT."""
    agreement: Sequence[float]  # of each repetition, see Repetition.agreement
    world: World = TESTS

    def values(self, scenario: str, team: str, quantity: str) -> Array:
        """Return one quantity, an attribute of Outcomes, of all runs: (repetitions or 1, seeds) float64."""
        rows = [getattr(outcomes, quantity) for outcomes in self.outcomes[scenario][team]]
        return np.array(rows, dtype=np.float64)

    def mean_share(self, scenarios: Sequence[str], team: str) -> Array:
        """Return the share of the greatest score, mean over scenarios, run by run: (repetitions or 1, seeds)."""
        total = self.values(scenarios[0], team, "score_share")
        for scenario in scenarios[1:]:
            total = total + self.values(scenario, team, "score_share")
        return total / len(scenarios)

    def curves_of(self, team: str, scenario: str) -> list[LearningCurve]:
        """Return how the repetitions of a team learned in one scenario."""
        return [curve for curve in self.curves if (curve.team, curve.scenario) == (team, scenario)]
