"""Repetitions of the paper's training, with the control that shares its first stage: all that is trained here."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from itertools import takewhile
from pathlib import Path
from threading import Event

import numpy as np

from fireworld.draws import TABLE, below
from fireworld.interrupt import Interrupted
from fireworld.kernels.arrays import Array
from fireworld.policy.teams.table_team import TableTeam
from fireworld.policy.words import N_FLAG_VALUES, N_STATES
from fireworld.records import ACTIONS
from fireworld.reproduction.study import ALONE, TOGETHER, TOGETHER_WITHOUT_FLAGS, LearningCurve
from fireworld.simulation.built import CityCache
from fireworld.training.curriculum import Curriculum
from fireworld.training.log.reader import TrainingLog, open_training
from fireworld.training.log.records import Episode
from fireworld.training.log.writer import TrainingWriter
from fireworld.training.methods.sarsa import EpisodeReport, Progress, Sarsa, SarsaTrainer


@dataclass(frozen=True)
class Repetition:
    """The teams of one repetition, by name, and how they learned."""

    teams: Mapping[str, TableTeam]
    graduates: Mapping[str, TableTeam]
    """The cooperative team as it was at the end of each of the scenarios together, by scenario; may be left out."""
    curves: tuple[LearningCurve, ...]

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
    record: Path | None = None,
) -> Repetition:
    """Train a repetition; its number is its seed, so that it can be repeated by itself. Interrupted if `stop` is set.

    The paper's cooperative team and its control (270 states, trained in the team) begin with the same stage alone; it
    is done once. What it leaves is the paper's non-cooperative team. `on_scenario` is called after every scenario.
    `record` is a folder for the training logs of both, from which the curves are read then.
    """
    with ExitStack() as stack:
        return _train(
            curriculum,
            method,
            number,
            cities=cities,
            stop=stop,
            on_scenario=on_scenario,
            with_graduates=with_graduates,
            recorder=Recorder(record, number, stack),
        )


class Recorder:
    """Records the trainings of a repetition, if there is a folder for their logs."""

    def __init__(self, folder: Path | None, number: int, stack: ExitStack) -> None:
        self._folder, self._number, self._stack = folder, number, stack
        self._writers: dict[str, TrainingWriter] = {}

    def path(self, team: str) -> Path:
        """Return the log of a team."""
        return training_log(self._folder or Path(), team, self._number)

    def begin(self, team: str, trainer: SarsaTrainer, *, after: str | None = None) -> None:
        """Begin a log, where `after` is given with what the log of that team has by now."""
        if self._folder is None:
            return
        before = None
        if after is not None:
            before = list(TrainingLog(self._writers[after].partial).raw_parts())
        writer = TrainingWriter(self.path(team), trainer, force=True, before=before)
        self._writers[team] = self._stack.enter_context(writer)

    def write(self, team: str) -> None:
        """Write the last episode of a team."""
        if team in self._writers:
            self._writers[team].write()

    def curves(self, curves: list[LearningCurve]) -> tuple[LearningCurve, ...]:
        """Close the logs; return the curves as they are read from them, or these where nothing is recorded."""
        if not self._writers:
            return tuple(curves)
        lines: dict[str, dict[int, list[Episode]]] = {}
        for team, writer in self._writers.items():
            writer.close()
            lines[team] = {}
            for line in open_training(self.path(team)).lines:
                lines[team].setdefault(line.scenario, []).append(line)
        sources = {ALONE: TOGETHER_WITHOUT_FLAGS}
        return tuple(
            _learning_curve(
                lines[sources.get(curve.team, curve.team)][curve.scenario_number],
                scenario=curve.scenario,
                repetition=self._number,
                team=curve.team,
            )
            for curve in curves
        )


def training_log(folder: Path, team: str, number: int) -> Path:
    """Return where the log of a team's training is; that of the stage alone is part of both."""
    return folder / f"{team}-{number}.mcap"


def _train(
    curriculum: Curriculum,
    method: Sarsa,
    number: int,
    *,
    cities: CityCache,
    stop: Event,
    on_scenario: Callable[[], object],
    with_graduates: bool,
    recorder: Recorder,
) -> Repetition:
    """Train a repetition as `train_repetition` does."""
    curves: list[LearningCurve] = []
    graduates: dict[str, TableTeam] = {}

    def trainer_in(scenarios: Curriculum, progress: Progress | None = None) -> SarsaTrainer:
        return SarsaTrainer(scenarios, method, seed=number, progress=progress, cities=cities)

    def follow(trainer: SarsaTrainer, team: str, *, until: int = curriculum.n_scenarios, log: str = "") -> None:
        for reports in _reports_by_scenario(trainer, until, stop, lambda: recorder.write(log or team)):
            scenario = reports[-1].scenario
            curves.append(_learning_curve(reports, scenario=scenario, repetition=number, team=team))
            if with_graduates and team == TOGETHER and trainer.graduate is not None:
                graduates[reports[-1].scenario] = trainer.graduate
            on_scenario()

    control = trainer_in(without_flags(curriculum))
    alone = takewhile(lambda stage: not stage.cooperation, curriculum.stages)
    n_alone = sum(len(stage.scenarios) for stage in alone)
    recorder.begin(TOGETHER_WITHOUT_FLAGS, control)
    follow(control, ALONE, until=n_alone, log=TOGETHER_WITHOUT_FLAGS)
    # By now all brigades hold the table of stage alone; the same for every value of the flags starts the others.
    begun = control.progress.tables
    flagged = np.repeat(begun, N_FLAG_VALUES, axis=1)
    team_alone = replace(control.team(), tables=begun[:1].copy(), visits=control.progress.visits[:1].copy())
    together = trainer_in(curriculum, Progress(n_alone, tables=flagged, visits=np.zeros(flagged.shape, dtype=np.int64)))
    recorder.begin(TOGETHER, together, after=TOGETHER_WITHOUT_FLAGS)
    follow(together, TOGETHER)
    follow(control, TOGETHER_WITHOUT_FLAGS)
    teams = {ALONE: team_alone, TOGETHER: together.team(), TOGETHER_WITHOUT_FLAGS: control.team()}
    return Repetition(teams=teams, graduates=graduates, curves=recorder.curves(curves))


def n_scenarios(curriculum: Curriculum) -> int:
    """Return the number of scenarios of one repetition: those with cooperation come twice."""
    return sum(len(stage.scenarios) * (2 if stage.cooperation else 1) for stage in curriculum.stages)


def without_flags(curriculum: Curriculum) -> Curriculum:
    """Return the curriculum of the control: the same scenarios, but nobody sees what the others do."""
    stages = tuple(replace(stage, cooperation=False) for stage in curriculum.stages)
    return replace(curriculum, name=f"{curriculum.name}-without-flags", stages=stages)


def random_tables(number: int, *, n_brigades: int) -> Array:
    """Draw for a repetition a table a brigade that prefers some action in each state: (n_brigades, 4320, 4)."""
    seed = -1 - number  # no training has it
    choice = [
        [below(seed, TABLE, brigade, state, bound=len(ACTIONS)) for state in range(N_STATES)]
        for brigade in range(n_brigades)
    ]
    tables: Array = np.eye(len(ACTIONS))[np.array(choice)]
    return tables


def _reports_by_scenario(
    trainer: SarsaTrainer, until: int, stop: Event, on_episode: Callable[[], object]
) -> Iterator[list[EpisodeReport]]:
    """Train up to a scenario, and yield the reports of each when it is done; `on_episode` is called after each."""
    while trainer.progress.scenario_number < until:
        number, reports = trainer.progress.scenario_number, []
        for report in trainer:
            reports.append(report)
            on_episode()
            if stop.is_set():
                raise Interrupted("interrupted")
            if trainer.progress.scenario_number != number:
                break
        yield reports


def _learning_curve(
    reports: Sequence[EpisodeReport] | Sequence[Episode], *, scenario: str, repetition: int, team: str
) -> LearningCurve:
    """Return the curve of a scenario from the reports or the records of its episodes."""
    last = reports[-1]
    number = last.scenario if isinstance(last, Episode) else last.scenario_number
    return LearningCurve(
        repetition=repetition,
        team=team,
        scenario=scenario,
        scenario_number=number,
        converged=last.converged,
        score=last.score,
        score_max=last.score_max,
        total_reward=np.array([report.total_reward for report in reports]),
        n_changed=np.array([report.n_changed for report in reports], dtype=np.int64),
    )
