"""The course of a training: what is drawn of it, part by part, from a log or from a trainer that learns right now."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from fireworld.errors import one_line
from fireworld.policy.words import N_STATES, describe_state
from fireworld.records import Array
from fireworld.training.log.reader import TrainingLog
from fireworld.training.log.records import Episode, Tables
from fireworld.training.method import Report

STATES_SHOWN: Final = 40
"""States in the picture of the tables: those visited most."""


@dataclass(frozen=True)
class TablePicture:
    """The tables over a training, for the states that matter: s states, b tables, m moments.

    Attributes:
        parts: (m,) after which episodes the tables are known.
        states: (s,) 0..4319, the most visited first; of states that a table takes for one the first.
        with_others: the tables see what the other brigades do.
        words: what a brigade sees in each.
        visits: (s,) how often all brigades together learned in it in the last stage.
        action: (s, b, m) the greedy action, -1 where a table has never been in the state.
        value: (s, b, m) its value.
    """

    parts: Array
    states: Array
    with_others: bool
    words: tuple[str, ...]
    visits: Array
    action: Array
    value: Array


@dataclass(frozen=True)
class Mark:
    """Where something ended that a reader wants to see.

    Attributes:
        part: number of the episode or generation, counted through the training.
        text: what happened.
        settled: the policy had settled.
        command: that opens it, "" if there is none.
    """

    part: int
    text: str
    settled: bool
    command: str


@dataclass(frozen=True)
class Course:
    """How a training went; k parts.

    Attributes:
        name: of the log's file.
        unit: what a part is.
        titles: of the plots by their names.
        own: names of the plots with a color for each curve: those that a method draws of each team alone.
        plots: by plot, then by curve: (k,) values, nan where there is none.
        scenarios: names of those that have begun, in their order.
        stages: the stage of each.
        scenario: (k,) which of them each part is of; empty of a search.
        in_turn: the scenarios come one after another.
        marks: ends of scenarios, or nothing.
        tables: the tables over the training; None where there are none.
    """

    name: str
    unit: str
    titles: Mapping[str, str]
    own: frozenset[str]
    plots: Mapping[str, Mapping[str, Array]]
    scenarios: tuple[str, ...]
    stages: tuple[str, ...]
    scenario: Array
    in_turn: bool
    marks: tuple[Mark, ...]
    tables: TablePicture | None


def course_of(log: TrainingLog) -> Course:
    """Read the course of a training from its log, a part at a time, and then its tables, one moment at a time.

    Raises:
        LogError: the log changed since it was opened.
    """
    trainer = log.trainer()
    n = len(log)
    plots: dict[str, dict[str, Array]] = {}
    marks: list[Mark] = []
    names = [one.name for one in log.scenarios]
    for number, part in enumerate(log.parts()):
        report = log.follow(trainer, part, number)
        for plot, curves in trainer.points(report).items():
            for curve, value in curves.items():
                plots.setdefault(plot, {}).setdefault(curve, np.full(n, np.nan))[number] = value
        if report.milestone and Episode in part:
            marks.append(mark_of(log, number, part[Episode], report, names))
    scenario = np.array([getattr(line, "scenario", -1) for line in log.lines], dtype=np.int64)
    in_turn = bool((np.diff(scenario) >= 0).all())
    return Course(
        name=log.path.name,
        unit=log.header.unit,
        titles={**trainer.plots, **trainer.own_plots()},
        own=frozenset(trainer.own_plots()),
        plots=plots,
        scenarios=tuple(names[: scenario.max(initial=-1) + 1]),
        stages=tuple(log.curriculum.stages[k].name for k in log.plan.stage[: scenario.max(initial=-1) + 1]),
        scenario=scenario if (scenario >= 0).all() else scenario[:0],
        in_turn=in_turn,
        marks=tuple(marks),
        tables=table_picture(log),
    )


def mark_of(log: TrainingLog, number: int, episode: Episode, report: Report, names: list[str]) -> Mark:
    """Return the mark of an episode that ends its scenario."""
    return Mark(number, report.text, episode.converged, opening(log, names[episode.scenario], episode.episode))


def opening(log: TrainingLog, scenario: str, episode: int) -> str:
    """Return the command that opens an episode, for a shell."""
    where = ["--scenario", scenario, "--episode", str(episode)]
    words = ["fireworld", "replay", log.path.name, *where, "-o", f"{scenario}-{episode:04d}.mcap"]
    return shlex.join(map(one_line, words))


def table_picture(log: TrainingLog) -> TablePicture | None:
    """Return the tables over a training; None where it has none yet."""
    if log.trainer().whole is not Tables or not log.wholes:
        return None
    last = _tables(log, log.wholes[-1])
    learned = last.arrays[1].sum(axis=(0, 2))
    order = sorted(np.flatnonzero(learned).tolist(), key=lambda row: (-learned[row], row))[:STATES_SHOWN]
    width = N_STATES // last.n_states
    states = np.array(order, dtype=np.int64) * width
    moments = [_moment(_tables(log, number), states) for number in log.wholes]
    n_tables = max(action.shape[1] for action, _ in moments)
    action, value = (
        np.stack([np.broadcast_to(one[k], (len(states), n_tables)) for one in moments], axis=2) for k in (0, 1)
    )  # one table serves all brigades
    return TablePicture(
        parts=np.array(log.wholes),
        states=states,
        with_others=width == 1,
        words=tuple(describe_state(int(state), with_others=width == 1) for state in states),
        visits=learned[order],
        action=action,
        value=value,
    )


def _moment(tables: Tables, states: Array) -> tuple[Array, Array]:
    """Return (s, tables) greedy actions and their values, -1 and nan where a table has never been in the state."""
    values, visits = (array[:, states // (N_STATES // tables.n_states)] for array in tables.arrays)
    seen = values.any(axis=2) | visits.any(axis=2)
    return np.where(seen, values.argmax(axis=2), -1).T, np.where(seen, values.max(axis=2), np.nan).T


def _tables(log: TrainingLog, number: int) -> Tables:
    """Return the tables that a part holds."""
    tables: Tables = next(log.parts(number))[Tables]
    return tables
