"""Trainings of several teams at a time, each to its own file; every one can be stopped and goes on where it was."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from threading import Event
from typing import Final

from fireworld.errors import OutputError, TrainingError, expected
from fireworld.files import check_output, write_file
from fireworld.policy.team import Team, read_team, save_team
from fireworld.training.checkpoint import (
    check_identity,
    check_no_checkpoint,
    checkpoint_path,
    restore_checkpoint,
    save_checkpoint,
)
from fireworld.training.trainer import EpisodeReport, Trainer

LOOK_UP_SECONDS: Final = 0.2


@dataclass
class Training:
    """One team on its way to its file."""

    trainer: Trainer
    path: Path
    log_path: Path | None = None
    """Where the log of episodes goes, as CSV; None: nowhere."""
    force: bool = False
    log: str = ""
    team: Team | None = None
    """The trained team, once its file is written."""
    is_kept: bool = False
    """Whether there is a checkpoint of this training."""

    @property
    def checkpoint(self) -> Path:
        """The checkpoint's file."""
        return checkpoint_path(self.path)

    def begin(self) -> None:
        """See that nothing would be overwritten, before any work is done.

        Raises:
            OutputError: a file is in the way, or a folder is missing.
        """
        for path in (self.path, self.log_path):
            if path is not None:
                check_output(path, force=self.force)
        check_no_checkpoint(self.checkpoint, force=self.force)

    def resume(self) -> bool:
        """Go on where an earlier call stopped; tell whether there was something to go on from.

        Raises:
            TrainingError: a file of another training.
            OutputError: a file is in the way.
        """
        if self.path.exists():
            team, _ = read_team(self.path)
            check_identity(team, self.trainer, self.path)
            self.team = team
            return True
        if self.checkpoint.exists():
            if self.log_path is not None:
                check_output(self.log_path)
            try:
                self.log = restore_checkpoint(self.trainer, self.checkpoint).decode()
            except UnicodeDecodeError:
                raise TrainingError(expected(str(self.checkpoint), "log", "text", "other bytes")) from None
            self.is_kept = True
            return True
        self.begin()
        return False

    def run(self, stop: Event, report: Callable[[Training, EpisodeReport], None]) -> None:
        """Train until done, or until asked to stop; write a checkpoint after every scenario, at last the team.

        Args:
            stop: set it, and the training stops after the episode under way, with a checkpoint.
            report: called after every episode.

        Raises:
            OutputError: something cannot be written; the last checkpoint stays.
        """
        if self.team is not None or stop.is_set():
            return
        for episode in self.trainer:
            self.log += _csv_line(astuple(episode))
            report(self, episode)
            if stop.is_set() or not self.trainer.progress.episode:
                self._keep()
            if stop.is_set():
                break
        if self.trainer.done:
            self._finish()

    def _keep(self) -> None:
        try:
            save_checkpoint(self.trainer, self.checkpoint, log=self.log.encode())
        except OutputError as error:
            raise self._with_what_is_kept(error) from None
        self.is_kept = True

    def _finish(self) -> None:
        team = self.trainer.team()
        try:
            if self.log_path is not None:
                write_file(self.log_path, (log_heading() + self.log).encode())
            try:
                save_team(team, self.path, force=self.force)
            except OutputError:
                if self.log_path is not None:
                    self.log_path.unlink(missing_ok=True)  # in the way of the next attempt
                raise
        except OutputError as error:
            raise self._with_what_is_kept(error) from None
        self.checkpoint.unlink(missing_ok=True)
        self.team, self.is_kept = team, False

    def _with_what_is_kept(self, error: OutputError) -> OutputError:
        hint = f"; {self.checkpoint} of this training is kept: go on with --resume" if self.is_kept else ""
        return OutputError(f"{error}{hint}")


def train_all(
    trainings: Sequence[Training], *, n_jobs: int, stop: Event, report: Callable[[Training, EpisodeReport], None]
) -> None:
    """Train teams on threads, which the compiled episodes leave free to run side by side.

    Args:
        trainings: what to train.
        n_jobs: trainings at a time.
        stop: set it, and all stop after the episode under way; set when this returns.
        report: called after every episode, by any of the threads.

    Raises:
        FireworldError: one training failed; the others have stopped, with a checkpoint.
    """
    with ThreadPoolExecutor(n_jobs) as pool:
        futures = [pool.submit(training.run, stop, report) for training in trainings]
        try:
            waiting = True
            while waiting:  # in short waits: a signal may reach another thread than this one, which must then look up
                done, undone = wait(futures, timeout=LOOK_UP_SECONDS, return_when=FIRST_EXCEPTION)
                waiting = bool(undone) and not any(future.exception() for future in done)
        finally:
            stop.set()
    for future in futures:
        future.result()


def numbered(path: Path, number: int, *, n_all: int) -> Path:
    """Name the file of one of several trainings: TEAM-3.npz; TEAM.npz if it is the only one."""
    return path if n_all == 1 else path.with_name(f"{path.stem}-{number}{path.suffix}")


def log_heading() -> str:
    """Return the first line of a log of episodes."""
    return _csv_line([item.name for item in fields(EpisodeReport)])


def _csv_line(values: Sequence[object]) -> str:
    line = io.StringIO()
    csv.writer(line, lineterminator="\n").writerow(values)
    return line.getvalue()
