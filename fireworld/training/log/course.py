"""The course of a training: what is drawn of it, part by part, from a log or from a trainer that learns right now."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from fireworld.policy.words import N_STATES, describe_state
from fireworld.records import Array
from fireworld.training.log.reader import TrainingLog
from fireworld.training.log.records import Episode, Tables
from fireworld.training.method import Report

STATES_SHOWN: Final = 32
"""States in the picture of the tables: those visited most."""


@dataclass(frozen=True)
class TablePicture:
    """The tables over a training, for the states that matter: s states, b tables, m moments.

    Attributes:
        parts: (m,) after which episodes the tables are known.
        states: (s,) 0..4319, the most visited first; of states that a table takes for one the first.
        words: what a brigade sees in each.
        visits: (s,) how often all brigades together learned in it in the last stage.
        action: (s, b, m) the greedy action, -1 where a table has never been in the state.
        value: (s, b, m) its value.
    """

    parts: Array
    states: Array
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
        plots: by plot, then by curve: (k,) values, nan where there is none.
        scenarios: names of those that have begun, in their order.
        stages: the stage of each.
        scenario: (k,) which of them each part is of; empty of a search.
        marks: ends of scenarios, or nothing.
        tables: the tables over the training; None where there are none.
    """

    name: str
    unit: str
    titles: Mapping[str, str]
    plots: Mapping[str, Mapping[str, Array]]
    scenarios: tuple[str, ...]
    stages: tuple[str, ...]
    scenario: Array
    marks: tuple[Mark, ...]
    tables: TablePicture | None


def course_of(log: TrainingLog) -> Course:
    """Read the course of a training from its log, in one pass and a second one over the tables.

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
    return Course(
        name=log.path.name,
        unit=log.header.unit,
        titles={**trainer.plots, **trainer.own_plots()},
        plots=plots,
        scenarios=tuple(names[: scenario.max(initial=-1) + 1]),
        stages=tuple(log.curriculum.stages[k].name for k in log.plan.stage[: scenario.max(initial=-1) + 1]),
        scenario=scenario if (scenario >= 0).all() else scenario[:0],
        marks=tuple(marks),
        tables=table_picture(log),
    )


def mark_of(log: TrainingLog, number: int, episode: Episode, report: Report, names: list[str]) -> Mark:
    """Return the mark of an episode that ends its scenario."""
    name = names[episode.scenario]
    where = f"--scenario {name} --episode {episode.episode}"
    command = f"fireworld replay {log.path.name} {where} -o {name}-{episode.episode:04d}.mcap"
    return Mark(number, report.text, episode.converged, command)


def table_picture(log: TrainingLog) -> TablePicture | None:
    """Return the tables over a training, read in one pass; None where it has none yet."""
    found = list(_tables(log))
    if not found:
        return None
    last = found[-1][1]
    _, visits = last.arrays
    learned = visits.sum(axis=(0, 2))
    order = sorted(np.flatnonzero(learned).tolist(), key=lambda row: (-learned[row], row))[:STATES_SHOWN]
    width = N_STATES // last.n_states
    states = np.array(order, dtype=np.int64) * width
    n_tables = max(tables.n_tables for _, tables in found)
    action = np.full((len(states), n_tables, len(found)), -1, dtype=np.int64)
    value = np.full(action.shape, np.nan)
    for moment, (_, tables) in enumerate(found):
        values, visits = tables.arrays
        rows = states // (N_STATES // tables.n_states)
        seen = values[:, rows].any(axis=2) | visits[:, rows].any(axis=2)  # (tables, states)
        n = tables.n_tables if tables.n_tables > 1 else n_tables  # one table serves all brigades
        action[:, :n, moment] = np.where(seen, values[:, rows].argmax(axis=2), -1).T
        value[:, :n, moment] = np.where(seen, values[:, rows].max(axis=2), np.nan).T
    return TablePicture(
        parts=np.array([number for number, _ in found]),
        states=states,
        words=tuple(describe_state(int(state), with_others=width == 1) for state in states),
        visits=learned[order],
        action=action,
        value=value,
    )


def _tables(log: TrainingLog) -> Iterator[tuple[int, Tables]]:
    """Yield the tables where they are whole, one record at a time."""
    for number, part in enumerate(log.parts()):
        if Tables in part:
            yield number, part[Tables]
