"""A training as tables: which there are, and the rows that each part adds to them; as Parquet files or in memory."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import fields
from pathlib import Path
from typing import Any, Final

import numpy as np
from fireworld_recorder.text_tables import ColumnDoc, text_tables

from fireworld.errors import LogError, expected, nearest
from fireworld.files import new_folder
from fireworld.policy.teams.ranking_words import WEIGHTS
from fireworld.policy.teams.table_words import first_state
from fireworld.records import ACTION_NAMES, ACTIONS, CHOICES, Array
from fireworld.rewards import TERMS
from fireworld.training.log.learned import LearnedEpisode
from fireworld.training.log.played import Played
from fireworld.training.log.reader import Part, TrainingLog
from fireworld.training.log.records import Episode, Evolved, Improved, Lesson, Tables, Tried
from fireworld.training.log.rows_file import SUFFIX, Rows, RowsFile, check_pyarrow

TABLES: Final[Mapping[str, str]] = {
    "episodes": "an episode that tables learned from: how it went and how the policy changed",
    "steps": "a brigade in a step of an episode: what it saw, chose and got, and what its choice before taught",
    "tables": "a state of a table that was visited by then: after every scenario and every 50th episode",
    "generations": "a generation of a search: how its rankings fared",
    "candidates": "a ranking that was tried in a generation: its weights and its score",
    "fights": "a ranking on a fire of its generation",
    "lessons": "a lesson in which a network learned: how its fights went",
    "lesson_fights": "a fight of a lesson",
    "evolved": "a generation of an evolution: how its candidates fared, and what the checks said",
    "evolved_fights": "a candidate on a fire of its generation",
    "improved": "a generation of improvement by rollouts: its fights, what it learned from, and what the checks said",
    "improved_fights": "a fight in which options were tried",
    "played": "an episode that a learner played: how it went",
    "actions": "a brigade in a step of an episode that a learner played: what it did, as far as it is known",
}
"""What a row of each table is."""
OF_KIND: Final[Mapping[type[Any], tuple[str, ...]]] = {
    Episode: ("episodes", "steps", "tables"),
    Tried: ("generations", "candidates", "fights"),
    Lesson: ("lessons", "lesson_fights"),
    Evolved: ("evolved", "evolved_fights"),
    Improved: ("improved", "improved_fights"),
    Played: ("played", "actions"),
}

PLACE_DOCS: Final = {"scenario": "name of its scenario"}
"""Of columns that are not what the field of the log is."""


def tables_of(log: TrainingLog) -> tuple[str, ...]:
    """Return the names of the tables that a training has."""
    return next((names for kind, names in OF_KIND.items() if kind in log.trainer().topics), ())


def rows_of(log: TrainingLog, names: Collection[str]) -> Iterator[tuple[str, Rows]]:
    """Yield table and rows, part by part.

    Args:
        log: the training.
        names: of the tables wanted.

    Raises:
        LogError: there is no such table, or the log changed since it was opened.
    """
    known = tables_of(log)
    for name in names:
        if name not in known:
            raise LogError(expected("table", "", f"one of {', '.join(known)}", name, nearest(name, known)))
    trainer = log.trainer()
    scenarios = [one.name for one in log.scenarios]
    for number, part in enumerate(log.parts()):
        if Episode in part:
            yield from _episode_rows(log, trainer, number, part, scenarios, names)
        elif Played in part:
            yield from _played_rows(log, number, part[Played], names)
        elif Tried in part:
            yield from _generation_rows(part[Tried], scenarios, names)
        elif Lesson in part:
            yield from _lesson_rows(part[Lesson], scenarios, names)
        elif Evolved in part:
            yield from _evolved_rows(part[Evolved], scenarios, names)
        elif Improved in part:
            yield from _improved_rows(part[Improved], scenarios, names)


def table_arrays(log: TrainingLog, name: str) -> Rows:
    """Return a table whole, in memory; errors as for `rows_of`."""
    found = [rows for _, rows in rows_of(log, [name])]
    return {key: np.concatenate([rows[key] for rows in found]) for key in found[0]} if found else {}


def _episode_rows(
    log: TrainingLog, trainer: Any, number: int, part: Part, scenarios: list[str], names: Collection[str]
) -> Iterator[tuple[str, Rows]]:
    episode: Episode = part[Episode]
    place = {"part": number, "scenario": scenarios[episode.scenario], "episode": episode.episode}
    if "episodes" in names:
        values = {item.name: getattr(episode, item.name) for item in fields(episode) if "per" not in item.metadata}
        values |= {"tables_digest": episode.tables_digest.hex()}
        yield "episodes", {key: np.array([value]) for key, value in {**values, **place}.items()}
    if "steps" in names:
        yield "steps", _step_rows(place, log.learn(trainer, part, number))
    if "tables" in names and Tables in part:
        yield "tables", _table_rows(place, part[Tables])


def _step_rows(place: Mapping[str, Any], found: LearnedEpisode) -> Rows:
    n_brigades, n_rows = found.td_error.shape
    n_choices, n = found.state.shape[1], n_brigades * n_rows
    padded = {"state": -1, "action": 0, "choice": 0}
    columns: Rows = {key: np.full(n, value) for key, value in place.items()}
    columns["step"] = np.tile(np.arange(1, n_rows + 1, dtype=np.int32), n_brigades)
    columns["brigade"] = np.repeat(np.arange(n_brigades, dtype=np.int32), n_rows)
    for name, nothing in padded.items():
        whole = np.full((n_brigades, n_rows), nothing, dtype=np.int32)
        whole[:, :n_choices] = getattr(found, name)
        columns[name] = whole.ravel()
    chose = columns["choice"]
    columns["action"] = np.where(chose > 0, np.array(ACTIONS, dtype=object)[columns["action"]], "")
    columns["choice"] = np.array(CHOICES, dtype=object)[chose]
    rewards = np.full((len(TERMS), n_rows), np.nan)
    rewards[:, : found.reward.shape[1]] = found.reward
    for term, values in zip(TERMS, rewards, strict=True):
        columns[f"reward_{term.name}"] = np.tile(values, n_brigades)
    for name in ("value_before", "td_error", "value_after"):
        columns[name] = getattr(found, name).ravel()
    return columns


def _table_rows(place: Mapping[str, Any], record: Tables) -> Rows:
    values, visits = record.arrays
    table, state = np.nonzero(visits.any(axis=2))
    columns: Rows = {key: np.full(len(table), value) for key, value in place.items()}
    columns["table"] = table.astype(np.int32)
    columns["state"] = np.array([first_state(int(row), record.n_states) for row in state], dtype=np.int32)
    for k, action in enumerate(ACTIONS):
        name = action.replace("-", "_")
        columns[f"q_{name}"] = values[table, state, k]
        columns[f"visits_{name}"] = visits[table, state, k]
    return columns


def _generation_rows(tried: Tried, scenarios: list[str], names: Collection[str]) -> Iterator[tuple[str, Rows]]:
    n_weights, n_fires = len(tried.mean), len(tried.fire)
    n = len(tried.weights) // n_weights
    weights, scores = tried.weights.reshape(n, n_weights), tried.scores.reshape(n, n_fires)
    if "generations" in names:
        columns: Rows = {
            name: np.array([getattr(tried, name)]) for name in ("generation", "score_mean", "score_best", "spread_mean")
        }
        for k, weight in enumerate(WEIGHTS):
            columns[f"mean_{weight.name}"] = tried.mean[k : k + 1]
            columns[f"spread_{weight.name}"] = tried.spread[k : k + 1]
        yield "generations", columns
    if "candidates" in names:
        rank = {int(candidate): place for place, candidate in enumerate(tried.best)}
        yield (
            "candidates",
            {
                "generation": np.full(n, tried.generation),
                "candidate": np.arange(n),
                "score": scores.mean(axis=1),
                "place_among_best": np.array([rank.get(k, -1) for k in range(n)]),
                **{weight.name: weights[:, k] for k, weight in enumerate(WEIGHTS)},
            },
        )
    if "fights" in names:
        yield "fights", _fight_rows(tried, scores, scenarios)


def _fight_rows(record: Tried | Evolved, scores: Array, scenarios: list[str]) -> Rows:
    """Return the fights of a generation of their scores, (candidates, fires)."""
    n, n_fires = scores.shape
    return {
        "generation": np.full(n * n_fires, record.generation),
        "candidate": np.repeat(np.arange(n), n_fires),
        "scenario": np.tile([scenarios[k] for k in record.fire], n),
        "seed": np.tile(record.seed, n),
        "score": scores.ravel(),
    }


def _evolved_rows(evolved: Evolved, scenarios: list[str], names: Collection[str]) -> Iterator[tuple[str, Rows]]:
    if "evolved" in names:
        values = {item.name: getattr(evolved, item.name) for item in fields(evolved) if "per" not in item.metadata}
        yield "evolved", {name: np.array([one]) for name, one in values.items()}
    if "evolved_fights" in names:
        scores = evolved.scores.reshape(-1, len(evolved.fire))
        yield "evolved_fights", _fight_rows(evolved, scores, scenarios)


def _improved_rows(improved: Improved, scenarios: list[str], names: Collection[str]) -> Iterator[tuple[str, Rows]]:
    if "improved" in names:
        values = {item.name: getattr(improved, item.name) for item in fields(improved) if "per" not in item.metadata}
        yield "improved", {name: np.array([one]) for name, one in values.items()}
    if "improved_fights" in names:
        place = {"generation": np.full(len(improved.fire), improved.generation)}
        fires = np.array([scenarios[k] for k in improved.fire], dtype=object)
        columns = {name: getattr(improved, name) for name in ("seed", "score", "n_tried")}
        yield "improved_fights", {**place, "scenario": fires, **columns}


def _lesson_rows(lesson: Lesson, scenarios: list[str], names: Collection[str]) -> Iterator[tuple[str, Rows]]:
    if "lessons" in names:
        of_lesson = ("lesson", "epsilon", "alpha", "score_mean", "error_mean")
        yield "lessons", {name: np.array([getattr(lesson, name)]) for name in of_lesson}
    if "lesson_fights" in names:
        place = {"lesson": np.full(len(lesson.fire), lesson.lesson)}
        fires = np.array([scenarios[k] for k in lesson.fire], dtype=object)
        columns = {name: getattr(lesson, name) for name in ("seed", "score", "n_steps")}
        yield "lesson_fights", {**place, "scenario": fires, **columns}


def _played_rows(log: TrainingLog, number: int, played: Played, names: Collection[str]) -> Iterator[tuple[str, Rows]]:
    scenario = log.scenarios[played.scenario]
    place = {"part": number, "scenario": scenario.name, "world": played.world, "episode": played.episode}
    if "played" in names:
        values = {item.name: getattr(played, item.name) for item in fields(played) if "per" not in item.metadata}
        values |= {"state": played.state.hex(), "left": played.left, "replayable": played.replayable}
        yield "played", {key: np.array([value]) for key, value in {**values, **place}.items()}
    if "actions" in names:
        action, target = (one.T.ravel() for one in played.decided(scenario.brigades.n))
        n_rows = len(action) // scenario.brigades.n
        columns: Rows = {key: np.full(len(action), value) for key, value in place.items()}
        first = 0 if played.replayable else played.first_step
        columns["step"] = np.tile(np.arange(first + 1, first + n_rows + 1, dtype=np.int32), scenario.brigades.n)
        columns["brigade"] = np.repeat(np.arange(scenario.brigades.n, dtype=np.int32), n_rows)
        columns["action"] = np.array([*ACTION_NAMES, ""], dtype=object)[action]
        yield "actions", {**columns, "target": target}


def export_training(
    log: TrainingLog,
    folder: Path,
    *,
    tables: Collection[str] | None = None,
    force: bool = False,
    on_part: Callable[[], object] = lambda: None,
) -> dict[str, int]:
    """Write a training as a folder of Parquet files, which is there only once it is complete.

    Args:
        log: the training, as far as it is good.
        folder: the folder to make.
        tables: names of the tables to write; None: all that it has.
        force: replace an earlier export.
        on_part: called after each part.

    Returns:
        Rows by table.

    Raises:
        LogError: there is no such table, or the log changed since it was opened.
        OutputError: pyarrow is not installed, or the folder exists or cannot be written.
    """
    check_pyarrow("export")
    names = tables_of(log) if tables is None else tuple(tables)
    with new_folder(folder, own={f"{name}{SUFFIX}" for name in TABLES}, force=force) as scratch, ExitStack() as stack:
        paths = {name: scratch / f"{name}{SUFFIX}" for name in names}
        files = {name: stack.enter_context(RowsFile(path, _facts(log, name))) for name, path in paths.items()}
        for name, rows in rows_of(log, names):
            files[name].add(rows)
            if name == names[0]:
                on_part()
        return {name: file.finish() for name, file in files.items()}


def export_training_text(
    log: TrainingLog,
    place: Path,
    form: str,
    *,
    tables: Collection[str] | None = None,
    force: bool = False,
    on_part: Callable[[], object] = lambda: None,
) -> dict[str, int]:
    """Write a training as text, a part in memory at a time: a folder of CSV files ("csv") or JSON lines ("jsonl").

    Arguments, result and errors are those of `export_training`; `place` is the folder, or the file, to make.
    """
    names = tables_of(log) if tables is None else tuple(tables)
    facts = {key: text for key, text in _facts(log, "").items() if key != "fireworld.table"}
    with text_tables(form, place, tables=TABLES, facts=facts, docs=_docs(names), force=force) as text:
        for name, rows in rows_of(log, names):
            text.add(name, rows)
            if name == names[0]:
                on_part()
    return {name: text.n_rows.get(name, 0) for name in names}


def _docs(names: Collection[str]) -> list[ColumnDoc]:
    """Return what the columns mean that are fields of the log."""
    first = {of_kind[0]: kind for kind, of_kind in OF_KIND.items() if of_kind[0] in names}
    return [
        (table, item.name, item.metadata["unit"], PLACE_DOCS.get(item.name, item.metadata["doc"]))
        for table, kind in first.items()
        for item in fields(kind)
        if "per" not in item.metadata
    ]


def _facts(log: TrainingLog, table: str) -> dict[str, str]:
    """Return the metadata of the file of a table."""
    header = log.header
    facts = {"table": TABLES.get(table, ""), "digest": log.digest, "state": log.state, "damage": log.damage or ""}
    facts |= {"method": json.dumps({"name": log.method.name, **log.method.as_dict()}), "seed": str(header.seed)}
    facts |= {"curriculum": header.curriculum, "curriculum_digest": header.curriculum_digest}
    return {f"fireworld.{key}": text for key, text in facts.items()}
