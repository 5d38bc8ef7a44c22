"""The tables of a reproduction, and every run they rest on, as CSV files: equal studies give equal bytes."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Final

from fireworld.evaluation.statistics import Estimate
from fireworld.outcome import COLUMNS
from fireworld.reproduction.paper_tables import PaperCell, PaperPair, PaperTables, cells_of
from fireworld.reproduction.study import LearningCurve, Study

Rows = Iterator[Sequence[object]]  # the first has the heads

_ESTIMATE = ("mean", "low_95", "high_95", "interquartile_mean", "repetitions", "seeds")

CSV_FILES: Final = (
    "table-1.csv", "table-2.csv", "table-3.csv", "cooperation.csv", "controls.csv", "comparisons.csv",
    "training.csv", "episodes.csv", "runs.csv",
)  # fmt: skip
"""Names of the files."""


def csv_files(study: Study, tables: PaperTables) -> dict[str, str]:
    """Return the text of every file, by its name."""
    contents = (
        _paper_rows(tables.trainings),
        _paper_rows(cells_of(tables.tests)),
        _paper_rows(cells_of(tables.more_brigades)),
        _cooperation_rows([*tables.tests, *tables.more_brigades]),
        _controls_rows(tables),
        _comparisons_rows(tables),
        _training_rows(study.curves),
        _episodes_rows(study.curves),
        _runs_rows(study),
    )
    return dict(zip(CSV_FILES, map(_csv, contents), strict=True))


def _paper_rows(cells: Iterable[PaperCell]) -> Rows:
    yield "scenario", "quantity", "team", "paper", *_ESTIMATE, "max", "verdict"
    for cell in cells:
        yield cell.scenario, cell.quantity, cell.team, cell.paper, *_spread(cell.ours), cell.ours_max, cell.verdict


def _cooperation_rows(pairs: Iterable[PaperPair]) -> Rows:
    """What cooperation changes: with - without."""
    words = {None: "open", True: "as the paper says", False: "the other way round"}
    yield "scenario", "quantity", "paper_difference", *_ESTIMATE, "direction"
    for pair in pairs:
        cell, change = pair.together, f"{pair.together.paper - pair.without.paper:g}"
        yield cell.scenario, cell.quantity, change, *_spread(pair.difference), words[pair.claim_holds]


def _controls_rows(tables: PaperTables) -> Rows:
    """Score as a share of the greatest; interval; by team and scenario."""
    world = tables.world
    yield "team", "scenario", *_ESTIMATE
    for table, shares in ((world.table_2, tables.shares), (world.table_3, tables.shares_more_brigades)):
        scenarios = [row.scenario for row in table]
        for share in shares:
            for scenario, found in zip(scenarios, share.by_scenario, strict=True):
                yield share.team, scenario, *_spread(found)
            yield share.team, "mean of " + " ".join(scenarios), *_spread(share.mean)


def _comparisons_rows(tables: PaperTables) -> Rows:
    yield "team", "other", "quantity", *_ESTIMATE
    for row in tables.comparisons:
        yield row.team, row.other, "difference of score / max", *_spread(row.difference)
        yield row.team, row.other, "probability of improvement", *_spread(row.improvement)


def _training_rows(curves: Iterable[LearningCurve]) -> Rows:
    yield "repetition", "team", "scenario", "episodes", "converged", "score", "max", "return"
    for curve in curves:
        ended = curve.converged, curve.score, curve.score_max, float(curve.total_reward[-1])
        yield curve.repetition, curve.team, curve.scenario, curve.n_episodes, *ended


def _episodes_rows(curves: Iterable[LearningCurve]) -> Rows:
    """What the convergence graphs show: means over the repetitions that are still in the scenario."""
    yield "team", "scenario", "episode", "repetitions", "mean_return", "mean_policy_changes"
    groups: dict[tuple[str, str], list[LearningCurve]] = {}
    for curve in curves:
        groups.setdefault((curve.team, curve.scenario), []).append(curve)
    for (team, scenario), group in groups.items():
        for episode in range(max(curve.n_episodes for curve in group)):
            in_it = [curve for curve in group if curve.n_episodes > episode]
            mean_return = math.fsum(float(curve.total_reward[episode]) for curve in in_it) / len(in_it)
            mean_changes = sum(int(curve.n_changed[episode]) for curve in in_it) / len(in_it)
            yield team, scenario, episode, len(in_it), mean_return, mean_changes


def _runs_rows(study: Study) -> Rows:
    yield "scenario", "team", "repetition", "seed", *COLUMNS
    for scenario, teams in study.outcomes.items():
        for team, repetitions in teams.items():
            for number, outcomes in enumerate(repetitions, 1):
                for seed, row in zip(outcomes.seeds, outcomes.rows, strict=True):
                    yield scenario, team, number, seed, *row


def _spread(found: Estimate) -> tuple[object, ...]:
    return found.mean, found.low, found.high, found.interquartile_mean, found.n_repetitions, found.n_seeds


def _csv(rows: Rows) -> str:
    """Write CSV; numbers in the shortest way that reads back as the same."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerows([int(value) if isinstance(value, bool) else value for value in row] for row in rows)
    return text.getvalue()
