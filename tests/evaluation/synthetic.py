"""A study made up: every value is known."""

from __future__ import annotations

import numpy as np

from fireworld.evaluation.runs import Outcomes
from fireworld.reproduction import paper
from fireworld.reproduction.study import (
    ALONE,
    TEAMS,
    TOGETHER,
    TOGETHER_WITHOUT_FLAGS,
    UNTAUGHT,
    LearningCurve,
    Study,
)

LEARNED = tuple(team for team in TEAMS if team not in UNTAUGHT)


def outcomes(seeds, *, score, score_max, burnt_out=100, steps=200, completed=True):
    """Every quantity is one value for all seeds, or a list of values."""
    n = len(seeds)
    kinds = (float, float, int, int, bool, int, float, float)
    values = (score, score_max, burnt_out, steps, completed, 0, -1.0, 0.0)
    columns = [np.broadcast_to(value, n).astype(kind).tolist() for value, kind in zip(values, kinds, strict=True)]
    return Outcomes(list(seeds), [*zip(*columns, strict=True)])


def study(*, together=0.75, alone=0.5, n_repetitions=2, n_seeds=3):
    """Every team but two reaches half of the greatest score; the paper's times and losses are met by ALONE."""
    seeds = list(range(n_seeds))
    share = dict.fromkeys(TEAMS, 0.5) | {TOGETHER: together, ALONE: alone}
    found = {}
    for row in paper.TESTS.tests:
        found[row.scenario] = {
            team: [
                outcomes(
                    seeds,
                    score=share[team] * row.score_max,
                    score_max=row.score_max,
                    burnt_out=int(row.burnt_out[0]),
                    steps=int(row.steps[0]),
                )
                for _ in range(n_repetitions if team in LEARNED else 1)
            ]
            for team in TEAMS
        }
    curves = [
        LearningCurve(
            repetition=repetition,
            team=team,
            scenario=row.scenario,
            scenario_number=number,
            converged=team == TOGETHER,
            score=row.score,
            score_max=row.score_max,
            total_reward=np.linspace(-9.0, -1.0, 30 + repetition),
            n_changed=np.arange(30 + repetition)[::-1],
        )
        for repetition in range(1, n_repetitions + 1)
        for team in (TOGETHER, TOGETHER_WITHOUT_FLAGS)
        for number, row in enumerate(paper.TESTS.table_1)
    ]
    return Study(
        n_repetitions=n_repetitions,
        seeds=seeds,
        curves=curves,
        outcomes=found,
        agreement=[0.25] * n_repetitions,
    )
