"""The training logs of a reproduction: written while its teams learn, and read for how they did."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Final

from fireworld.errors import LogError, TrainingError, expected
from fireworld.reproduction.study import ALONE, TOGETHER, TOGETHER_WITHOUT_FLAGS, LearningCurve, learning_curve
from fireworld.training.log.reader import TrainingLog, open_training
from fireworld.training.log.writer import TrainingWriter
from fireworld.training.methods.sarsa import SarsaTrainer

RECORDED: Final = (TOGETHER, TOGETHER_WITHOUT_FLAGS)
"""The teams whose trainings are recorded; both begin with stage alone, which makes the third."""


@dataclass(frozen=True)
class RepetitionLogs:
    """The training logs of a repetition: TEAM-NUMBER.mcap.

    Attributes:
        folder: where they are.
        number: of the repetition.
    """

    folder: Path
    number: int

    def path(self, team: str) -> Path:
        """Return the log of a team."""
        return self.folder / f"{team}-{self.number}.mcap"

    def read(
        self, written: Mapping[str, str] | None = None, *, source: Path | None = None
    ) -> tuple[dict[str, str], tuple[LearningCurve, ...]]:
        """Read the digests of the logs by team, and how the teams learned.

        Args:
            written: the digests that are expected; None: any.
            source: the file that holds these.

        Raises:
            TrainingError: a log is damaged, gone or another one.
        """
        together, control = logs = [self._open(team, (written or {}).get(team), source) for team in RECORDED]
        n_alone = int(together.plan.cooperation.argmax())
        curves = [
            *self._curves(control, ALONE, 0, n_alone),
            *self._curves(together, TOGETHER, n_alone),
            *self._curves(control, TOGETHER_WITHOUT_FLAGS, n_alone),
        ]
        return {team: log.digest for team, log in zip(RECORDED, logs, strict=True)}, tuple(curves)

    def _open(self, team: str, written: str | None, source: Path | None) -> TrainingLog:
        hint = "" if source is None else f"delete {source} and it is trained anew"
        try:
            log = open_training(self.path(team))
        except LogError as error:
            raise TrainingError(f"{error}; {hint}") from None
        if written is not None and log.digest != written:
            wanted = f"the training {written[:12]} that was written"
            raise TrainingError(expected(str(log.path), "", wanted, log.digest[:12], hint))
        return log

    def _curves(self, log: TrainingLog, team: str, first: int, until: int | None = None) -> Iterator[LearningCurve]:
        """Yield how a team learned in each of some scenarios."""
        for number, lines in groupby(log.lines, key=lambda line: int(line.scenario)):
            if number in range(len(log.scenarios))[first:until]:
                name = log.scenarios[number].name
                yield learning_curve([*lines], repetition=self.number, team=team, scenario=name, number=number)


@contextmanager
def recording(
    logs: RepetitionLogs | None, team: str, trainer: SarsaTrainer, *, after: TrainingWriter | None = None
) -> Iterator[TrainingWriter | None]:
    """Record a training until it is done.

    Args:
        logs: where; None: nowhere.
        team: whose it is.
        trainer: trains it.
        after: records the training that this one continues; its parts so far are copied.
    """
    if logs is None:
        yield None
        return
    before = None if after is None else open_training(after.partial, partial=True).raw_parts()
    with TrainingWriter(logs.path(team), trainer, force=True, before=before) as writer:
        yield writer
        writer.close()
