"""The tables of a reproduction, and every run they rest on, as CSV: equal studies give equal bytes."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Sequence
from typing import Final

from fireworld.evaluation.runs import QUANTITIES
from fireworld.evaluation.statistics import Estimate
from fireworld.reproduction import paper
from fireworld.reproduction.paper_tables import Cell, Pair, Standing, Tables
from fireworld.reproduction.study import Lesson, Study

_ESTIMATE = ("mean", "low_95", "high_95", "interquartile_mean", "repetitions", "seeds")

SHEETS: Final = (
    "table-1.csv",
    "table-2.csv",
    "table-3.csv",
    "cooperation.csv",
    "controls.csv",
    "comparisons.csv",
    "training.csv",
    "episodes.csv",
    "runs.csv",
)
"""Names of the files."""


def sheets(study: Study, tables: Tables) -> dict[str, str]:
    """Return the text of every CSV file, by file name."""
    texts = (
        _paper_sheet(tables.lessons),
        _paper_sheet(_cells(tables.tests)),
        _paper_sheet(_cells(tables.more_brigades)),
        _cooperation_sheet([*tables.tests, *tables.more_brigades]),
        _controls_sheet(tables),
        _comparisons_sheet(tables),
        _training_sheet(study.lessons),
        _episodes_sheet(study.lessons),
        _runs_sheet(study),
    )
    return dict(zip(SHEETS, texts, strict=True))


def _cells(pairs: Iterable[Pair]) -> list[Cell]:
    return [cell for pair in pairs for cell in (pair.without, pair.together)]


def _paper_sheet(cells: Iterable[Cell]) -> str:
    head = ("scenario", "quantity", "team", "paper", *_ESTIMATE, "max", "verdict")
    return _csv(
        head,
        (
            (cell.scenario, cell.quantity, cell.team, cell.paper, *_spread(cell.ours), cell.ours_max, cell.verdict)
            for cell in cells
        ),
    )


def _cooperation_sheet(pairs: Iterable[Pair]) -> str:
    """What cooperation changes: with less without."""
    words = {None: "open", True: "as the paper says", False: "the other way round"}
    head = ("scenario", "quantity", "paper_difference", *_ESTIMATE, "direction")
    return _csv(
        head,
        (
            (
                pair.together.scenario,
                pair.together.quantity,
                f"{pair.together.paper - pair.without.paper:g}",
                *_spread(pair.difference),
                words[pair.claim_holds],
            )
            for pair in pairs
        ),
    )


def _controls_sheet(tables: Tables) -> str:
    """Score as a share of the greatest; interval; by team and scenario."""
    rows: list[tuple[object, ...]] = []
    for scenarios, standings in (
        ([row.scenario for row in paper.TABLE_2], tables.standings),
        ([row.scenario for row in paper.TABLE_3], tables.standings_more_brigades),
    ):
        for standing in standings:
            rows += _standing_rows(standing, scenarios)
    return _csv(("team", "scenario", *_ESTIMATE), rows)


def _standing_rows(standing: Standing, scenarios: Sequence[str]) -> list[tuple[object, ...]]:
    named = [*zip(scenarios, standing.by_scenario, strict=True), ("mean of " + " ".join(scenarios), standing.mean)]
    return [(standing.team, scenario, *_spread(found)) for scenario, found in named]


def _comparisons_sheet(tables: Tables) -> str:
    head = ("team", "other", "quantity", *_ESTIMATE)
    rows: list[tuple[object, ...]] = []
    for row in tables.comparisons:
        rows.append((row.team, row.other, "difference of score / max", *_spread(row.difference)))
        rows.append((row.team, row.other, "probability of improvement", *_spread(row.improvement)))
    return _csv(head, rows)


def _training_sheet(lessons: Iterable[Lesson]) -> str:
    head = ("repetition", "team", "scenario", "episodes", "converged", "score", "max", "return")
    return _csv(
        head,
        (
            (
                lesson.repetition,
                lesson.team,
                lesson.scenario,
                lesson.n_episodes,
                int(lesson.converged),
                lesson.score,
                lesson.score_max,
                float(lesson.total_reward[-1]),
            )
            for lesson in lessons
        ),
    )


def _episodes_sheet(lessons: Iterable[Lesson]) -> str:
    """What the convergence graphs show: means over the repetitions that are still in the scenario."""
    groups: dict[tuple[str, str], list[Lesson]] = {}
    for lesson in lessons:
        groups.setdefault((lesson.team, lesson.scenario), []).append(lesson)
    rows: list[tuple[object, ...]] = []
    for (team, scenario), group in groups.items():
        for episode in range(max(lesson.n_episodes for lesson in group)):
            going_on = [lesson for lesson in group if lesson.n_episodes > episode]
            rewards = [float(lesson.total_reward[episode]) for lesson in going_on]
            changes = [int(lesson.n_changed[episode]) for lesson in going_on]
            n = len(going_on)
            rows.append((team, scenario, episode, n, math.fsum(rewards) / n, sum(changes) / n))
    return _csv(("team", "scenario", "episode", "repetitions", "mean_return", "mean_policy_changes"), rows)


def _runs_sheet(study: Study) -> str:
    rows: list[tuple[object, ...]] = []
    for scenario, teams in study.outcomes.items():
        for team, repetitions in teams.items():
            for number, outcomes in enumerate(repetitions, 1):
                columns = [outcomes.seed, *(getattr(outcomes, quantity) for quantity in QUANTITIES)]
                values = zip(*(column.tolist() for column in columns), strict=True)
                rows += [(scenario, team, number, *map(_plain, row)) for row in values]
    return _csv(("scenario", "team", "repetition", "seed", *QUANTITIES), rows)


def _plain(value: object) -> object:
    return int(value) if isinstance(value, bool) else value


def _spread(found: Estimate) -> tuple[object, ...]:
    return found.mean, found.low, found.high, found.interquartile_mean, found.n_repetitions, found.n_seeds


def _csv(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Write CSV; numbers in the shortest way that reads back as the same."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    writer.writerows(rows)
    return text.getvalue()
