"""Repetitions of the paper's training, with the control that shares its first stage: all that is trained here."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import takewhile
from threading import Event

import numpy as np

from fireworld.draws import TABLE, below
from fireworld.interrupt import Interrupted
from fireworld.kernels.arrays import Array
from fireworld.policy.teams.table_team import TableTeam
from fireworld.policy.words import N_FLAG_VALUES, N_STATES
from fireworld.records import ACTIONS
from fireworld.reproduction.study import ALONE, TOGETHER, TOGETHER_WITHOUT_FLAGS, LearningCurve, learning_curve
from fireworld.reproduction.trainings import RepetitionLogs, recording
from fireworld.simulation.built import CityCache
from fireworld.training.curriculum import Curriculum
from fireworld.training.log.writer import TrainingWriter
from fireworld.training.methods.sarsa import EpisodeReport, Progress, Sarsa, SarsaTrainer


@dataclass(frozen=True)
class Repetition:
    """The teams of one repetition, by name, and how they learned."""

    teams: Mapping[str, TableTeam]
    graduates: Mapping[str, TableTeam]
    """The cooperative team as it was at the end of each of the scenarios together, by scenario; may be left out."""
    curves: tuple[LearningCurve, ...]
    logs: Mapping[str, str] = field(default_factory=dict)
    """Digests of the training logs by team; empty if they were not recorded."""

    @property
    def agreement(self) -> float:
        """Share of the states met in which all brigades of the cooperative team prefer the same action."""
        team = self.teams[TOGETHER]
        met = team.visits.sum(axis=(0, 2)) > 0
        choice = team.tables.argmax(axis=2)[:, met]
        return int((choice == choice[0]).all(axis=0).sum()) / max(1, int(met.sum()))


def train_repetition(
    curriculum: Curriculum,
    method: Sarsa,
    number: int,
    *,
    cities: CityCache,
    stop: Event,
    on_scenario: Callable[[], object],
    with_graduates: bool = False,
    logs: RepetitionLogs | None = None,
) -> Repetition:
    """Train a repetition; its number is its seed, so that it can be repeated by itself. Interrupted if `stop` is set.

    The paper's cooperative team and its control (270 states, trained in the team) begin with the same stage alone; it
    is done once. What it leaves is the paper's non-cooperative team. `on_scenario` is called after every scenario. Both
    trainings are recorded in `logs`.
    """
    curves: list[LearningCurve] = []
    graduates: dict[str, TableTeam] = {}

    def trainer_in(scenarios: Curriculum, progress: Progress | None = None) -> SarsaTrainer:
        return SarsaTrainer(scenarios, method, seed=number, progress=progress, cities=cities)

    def follow(
        trainer: SarsaTrainer, team: str, writer: TrainingWriter | None, *, until: int = curriculum.n_scenarios
    ) -> None:
        for reports in _reports_by_scenario(trainer, until, stop, writer):
            name, place = reports[-1].scenario, reports[-1].scenario_number
            curves.append(learning_curve(reports, repetition=number, team=team, scenario=name, number=place))
            if with_graduates and team == TOGETHER and trainer.graduate is not None:
                graduates[name] = trainer.graduate
            on_scenario()

    control = trainer_in(without_flags(curriculum))
    alone = takewhile(lambda stage: not stage.cooperation, curriculum.stages)
    n_alone = sum(len(stage.scenarios) for stage in alone)
    with recording(logs, TOGETHER_WITHOUT_FLAGS, control) as of_control:
        follow(control, ALONE, of_control, until=n_alone)
        # By now all brigades hold the table of stage alone; the same for every value of the flags starts the others.
        begun = control.progress.tables
        flagged = np.repeat(begun, N_FLAG_VALUES, axis=1)
        team_alone = replace(control.team(), tables=begun[:1].copy(), visits=control.progress.visits[:1].copy())
        n_before = control.progress.n_before
        progress = Progress(n_alone, tables=flagged, visits=np.zeros(flagged.shape, dtype=np.int64), n_before=n_before)
        together = trainer_in(curriculum, progress)
        with recording(logs, TOGETHER, together, after=of_control) as of_together:
            follow(together, TOGETHER, of_together)
        follow(control, TOGETHER_WITHOUT_FLAGS, of_control)
    teams = {ALONE: team_alone, TOGETHER: together.team(), TOGETHER_WITHOUT_FLAGS: control.team()}
    if logs is None:
        return Repetition(teams, graduates, tuple(curves))
    digests, recorded_curves = logs.read()
    return Repetition(teams, graduates, recorded_curves, digests)


def n_scenarios(curriculum: Curriculum) -> int:
    """Return the number of scenarios of one repetition: those with cooperation come twice."""
    return sum(len(stage.scenarios) * (2 if stage.cooperation else 1) for stage in curriculum.stages)


def without_flags(curriculum: Curriculum) -> Curriculum:
    """Return the curriculum of the control: the same scenarios, but nobody sees what the others do."""
    stages = tuple(replace(stage, cooperation=False) for stage in curriculum.stages)
    return replace(curriculum, name=f"{curriculum.name}-without-flags", stages=stages)


def random_tables(number: int, *, n_brigades: int, n_states: int = N_STATES) -> Array:
    """Draw for a repetition a table a brigade that prefers some action in each state: (n_brigades, n_states, 4)."""
    seed = -1 - number  # no training has it
    choice = [
        [below(seed, TABLE, brigade, state, bound=len(ACTIONS)) for state in range(n_states)]
        for brigade in range(n_brigades)
    ]
    tables: Array = np.eye(len(ACTIONS))[np.array(choice)]
    return tables


def _reports_by_scenario(
    trainer: SarsaTrainer, until: int, stop: Event, writer: TrainingWriter | None
) -> Iterator[list[EpisodeReport]]:
    """Train up to a scenario, record every episode, and yield the reports of each scenario when it is done."""
    while trainer.progress.scenario_number < until:
        number, reports = trainer.progress.scenario_number, []
        for report in trainer:
            reports.append(report)
            if writer is not None:
                writer.write()
            if stop.is_set():
                raise Interrupted("interrupted")
            if trainer.progress.scenario_number != number:
                break
        yield reports
