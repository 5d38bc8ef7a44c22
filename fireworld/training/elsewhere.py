"""Trainings that workers elsewhere do, some seconds at a time: what is between two slices is as a checkpoint."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

from fireworld.errors import TrainingError, expected
from fireworld.executors import Unfinished, Workers
from fireworld.kernels.arrays import Array
from fireworld.policy.teams.team import Team
from fireworld.simulation.built import CityCache
from fireworld.training.curriculum import Curriculum
from fireworld.training.method import Method, Report
from fireworld.training.training import Callback, Training

SLICE_SECONDS: Final = 5.0
"""What is lost at most where a worker dies, or all stop, besides the report under way."""
CITIES: Final = CityCache()
"""Those of this worker."""


@dataclass(frozen=True)
class Slice:
    """What a worker trained: the reports, and where the training stands."""

    reports: Sequence[Report]
    team: Team
    state: Mapping[str, Array]


@dataclass(frozen=True)
class TrainingSlice:
    """A part of a training, to be done."""

    method: Method
    curriculum: Curriculum
    seed: int
    team: Team
    state: Mapping[str, Array]

    def __call__(self) -> Unfinished | Slice:
        """Train for a while."""
        trainer = self.method.trainer(self.curriculum, seed=self.seed, cities=CITIES)
        trainer.restore(self.team, self.state, source=f"seed {self.seed}")
        end, reports = time.monotonic() + SLICE_SECONDS, list[Report]()
        for report in trainer:
            reports.append(report)
            if time.monotonic() >= end:
                break
        done = Slice(reports, trainer.team(), trainer.state())
        return done if trainer.done else Unfinished(done, replace(self, team=done.team, state=done.state))


def train_elsewhere(trainings: Sequence[Training], workers: Workers, callbacks: Sequence[Callback]) -> None:
    """Train teams on workers elsewhere; arguments are those of `train_all`. Callbacks are called after every slice.

    Raises:
        TrainingError: a training is recorded, which only this process can do.
    """
    for training in trainings:
        if training.record is not None or training.full is not None:
            raise TrainingError(expected("--on", "", "threads, where trainings are recorded", workers.name))
    left = [training for training in trainings if training.team is None]

    def note(number: int, result: Any) -> None:
        done: Slice = result.part if isinstance(result, Unfinished) else result
        left[number].take(done.reports, done.team, done.state, callbacks)
        if left[number].stopped:
            workers.stop.set()

    try:
        workers.run([_rest_of(training) for training in left], note)
    finally:
        for training in left:
            training.leave()


def _rest_of(training: Training) -> TrainingSlice:
    trainer = training.trainer
    return TrainingSlice(trainer.method, trainer.curriculum, trainer.seed, trainer.team(), trainer.state())
