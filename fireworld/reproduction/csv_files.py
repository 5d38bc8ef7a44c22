"""The tables of a reproduction, and every run they rest on, as CSV files: equal studies give equal bytes."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Sequence
from typing import Final

from fireworld.evaluation.statistics import Estimate
from fireworld.outcome import COLUMNS
from fireworld.reproduction import paper
from fireworld.reproduction.paper_tables import PaperCell, PaperPair, PaperTables, cells_of
from fireworld.reproduction.study import LearningCurve, Study

_ESTIMATE = ("mean", "low_95", "high_95", "interquartile_mean", "repetitions", "seeds")

CSV_FILES: Final = (
    "table-1.csv", "table-2.csv", "table-3.csv", "cooperation.csv", "controls.csv", "comparisons.csv",
    "training.csv", "episodes.csv", "runs.csv",
)  # fmt: skip
"""Names of the files."""


def csv_files(study: Study, tables: PaperTables) -> dict[str, str]:
    """Return the text of every file, by its name."""
    texts = (
        _paper_file(tables.trainings),
        _paper_file(cells_of(tables.tests)),
        _paper_file(cells_of(tables.more_brigades)),
        _cooperation_file([*tables.tests, *tables.more_brigades]),
        _controls_file(tables),
        _comparisons_file(tables),
        _training_file(study.curves),
        _episodes_file(study.curves),
        _runs_file(study),
    )
    return dict(zip(CSV_FILES, texts, strict=True))


def _paper_file(cells: Iterable[PaperCell]) -> str:
    rows = [
        (cell.scenario, cell.quantity, cell.team, cell.paper, *_spread(cell.ours), cell.ours_max, cell.verdict)
        for cell in cells
    ]
    return _csv(("scenario", "quantity", "team", "paper", *_ESTIMATE, "max", "verdict"), rows)


def _cooperation_file(pairs: Iterable[PaperPair]) -> str:
    """What cooperation changes: with - without."""
    words = {None: "open", True: "as the paper says", False: "the other way round"}
    rows = []
    for pair in pairs:
        scenario, quantity = pair.together.scenario, pair.together.quantity
        change = f"{pair.together.paper - pair.without.paper:g}"
        rows.append((scenario, quantity, change, *_spread(pair.difference), words[pair.claim_holds]))
    return _csv(("scenario", "quantity", "paper_difference", *_ESTIMATE, "direction"), rows)


def _controls_file(tables: PaperTables) -> str:
    """Score as a share of the greatest; interval; by team and scenario."""
    rows: list[tuple[object, ...]] = []
    for table, shares in ((paper.TABLE_2, tables.shares), (paper.TABLE_3, tables.shares_more_brigades)):
        scenarios = [row.scenario for row in table]
        for share in shares:
            named = zip([*scenarios, "mean of " + " ".join(scenarios)], [*share.by_scenario, share.mean], strict=True)
            rows += [(share.team, scenario, *_spread(found)) for scenario, found in named]
    return _csv(("team", "scenario", *_ESTIMATE), rows)


def _comparisons_file(tables: PaperTables) -> str:
    rows = [
        (row.team, row.other, quantity, *_spread(found))
        for row in tables.comparisons
        for quantity, found in (
            ("difference of score / max", row.difference),
            ("probability of improvement", row.improvement),
        )
    ]
    return _csv(("team", "other", "quantity", *_ESTIMATE), rows)


def _training_file(curves: Iterable[LearningCurve]) -> str:
    rows: list[tuple[object, ...]] = []
    for curve in curves:
        ended = curve.converged, curve.score, curve.score_max, float(curve.total_reward[-1])
        rows.append((curve.repetition, curve.team, curve.scenario, curve.n_episodes, *ended))
    return _csv(("repetition", "team", "scenario", "episodes", "converged", "score", "max", "return"), rows)


def _episodes_file(curves: Iterable[LearningCurve]) -> str:
    """What the convergence graphs show: means over the repetitions that are still in the scenario."""
    groups: dict[tuple[str, str], list[LearningCurve]] = {}
    for curve in curves:
        groups.setdefault((curve.team, curve.scenario), []).append(curve)
    rows: list[tuple[object, ...]] = []
    for (team, scenario), group in groups.items():
        for episode in range(max(curve.n_episodes for curve in group)):
            in_it = [curve for curve in group if curve.n_episodes > episode]
            mean_return = math.fsum(float(curve.total_reward[episode]) for curve in in_it) / len(in_it)
            mean_changes = sum(int(curve.n_changed[episode]) for curve in in_it) / len(in_it)
            rows.append((team, scenario, episode, len(in_it), mean_return, mean_changes))
    return _csv(("team", "scenario", "episode", "repetitions", "mean_return", "mean_policy_changes"), rows)


def _runs_file(study: Study) -> str:
    rows: list[tuple[object, ...]] = []
    for scenario, teams in study.outcomes.items():
        for team, repetitions in teams.items():
            for number, outcomes in enumerate(repetitions, 1):
                of_seeds = zip(outcomes.seeds, outcomes.rows, strict=True)
                rows += [(scenario, team, number, seed, *row) for seed, row in of_seeds]
    return _csv(("scenario", "team", "repetition", "seed", *COLUMNS), rows)


def _spread(found: Estimate) -> tuple[object, ...]:
    return found.mean, found.low, found.high, found.interquartile_mean, found.n_repetitions, found.n_seeds


def _csv(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Write CSV; numbers in the shortest way that reads back as the same."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    writer.writerows([int(value) if isinstance(value, bool) else value for value in row] for row in rows)
    return text.getvalue()
