"""Repetitions of the paper's training, with the control that shares its first stage: all that is trained here."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import takewhile
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


@dataclass(frozen=True, kw_only=True)
class RepetitionTraining:
    """One repetition to be trained; its number is its seed, so that it can be repeated by itself.

    The paper's cooperative team and its control (270 states, trained in the team) begin with the same stage alone; it
    is done once. What it leaves is the paper's non-cooperative team.
    """

    curriculum: Curriculum
    method: Sarsa
    number: int
    cities: CityCache
    stop: Event
    on_scenario: Callable[[], object]
    """Called after every scenario."""
    with_graduates: bool = False
    """Return the team as it was after every scenario, too."""

    def __call__(self) -> Repetition:
        """Train.

        Raises:
            Interrupted: `stop` was set.
        """
        control = self._trainer(without_flags(self.curriculum))
        alone = [*takewhile(lambda stage: not stage.cooperation, self.curriculum.stages)]
        n_alone = sum(len(stage.scenarios) for stage in alone)
        curves = self._follow(control, ALONE, until=n_alone)
        # By now all brigades hold the table of stage alone; the same for every value of the flags starts the others.
        begun = control.progress.tables
        flagged = np.repeat(begun, N_FLAG_VALUES, axis=1)
        progress = Progress(n_alone, tables=flagged, visits=np.zeros(flagged.shape, dtype=np.int64))
        team_alone = replace(control.team(), tables=begun[:1].copy(), visits=control.progress.visits[:1].copy())
        together = self._trainer(self.curriculum, progress)
        graduates: dict[str, TableTeam] = {}
        curves += self._follow(together, TOGETHER, until=self.curriculum.n_scenarios, graduates=graduates)
        curves += self._follow(control, TOGETHER_WITHOUT_FLAGS, until=self.curriculum.n_scenarios)
        teams = {ALONE: team_alone, TOGETHER: together.team(), TOGETHER_WITHOUT_FLAGS: control.team()}
        return Repetition(teams=teams, graduates=graduates if self.with_graduates else {}, curves=tuple(curves))

    def _trainer(self, curriculum: Curriculum, progress: Progress | None = None) -> SarsaTrainer:
        return SarsaTrainer(curriculum, self.method, seed=self.number, progress=progress, cities=self.cities)

    def _follow(
        self, trainer: SarsaTrainer, team: str, *, until: int, graduates: dict[str, TableTeam] | None = None
    ) -> list[LearningCurve]:
        """Train up to a scenario; add the team at the end of each to `graduates`."""
        curves = []
        while trainer.progress.scenario_number < until:
            number, reports = trainer.progress.scenario_number, []
            for report in trainer:
                reports.append(report)
                if self.stop.is_set():
                    raise Interrupted("interrupted")
                if trainer.progress.scenario_number != number:
                    break
            curves.append(_learning_curve(reports, repetition=self.number, team=team))
            if graduates is not None and trainer.graduate is not None:
                graduates[reports[-1].scenario] = trainer.graduate
            self.on_scenario()
        return curves


def n_scenarios(curriculum: Curriculum) -> int:
    """Return the number of scenarios of one repetition: those with cooperation come twice."""
    return sum(len(stage.scenarios) * (2 if stage.cooperation else 1) for stage in curriculum.stages)


def without_flags(curriculum: Curriculum) -> Curriculum:
    """Return the curriculum of the control: the same scenarios, but nobody sees what the others do."""
    stages = tuple(replace(stage, cooperation=False) for stage in curriculum.stages)
    return replace(curriculum, name=f"{curriculum.name}-without-flags", stages=stages)


def random_tables(number: int, *, n_brigades: int) -> Array:
    """Draw a table for every brigade that prefers some action in each state: (n_brigades, 4320, 4).

    Args:
        number: of the repetition.
        n_brigades: tables to draw.
    """
    seed = -1 - number  # no training has it
    choice = np.array(
        [
            [below(seed, TABLE, brigade, state, bound=len(ACTIONS)) for state in range(N_STATES)]
            for brigade in range(n_brigades)
        ]
    )
    tables: Array = np.eye(len(ACTIONS))[choice]
    return tables


def _learning_curve(reports: list[EpisodeReport], *, repetition: int, team: str) -> LearningCurve:
    last = reports[-1]
    return LearningCurve(
        repetition=repetition,
        team=team,
        scenario=last.scenario,
        scenario_number=last.scenario_number,
        converged=last.converged,
        score=last.score,
        score_max=last.score_max,
        total_reward=np.array([report.total_reward for report in reports]),
        n_changed=np.array([report.n_changed for report in reports], dtype=np.int64),
    )
