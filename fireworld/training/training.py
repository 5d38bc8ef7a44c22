"""Training: a team on its way to its file. It can be stopped after any report, and continues bit for bit."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from fireworld_recorder.writer import PARTIAL_SUFFIX

from fireworld.errors import OutputError, TrainingError, expected
from fireworld.executors import AnyExecutor, Workers, in_this_process, threads, workers_for
from fireworld.files import check_output, check_outputs, write_file
from fireworld.interrupt import gentle_interrupt
from fireworld.policy.teams.npz import SUFFIX
from fireworld.policy.teams.team import Team, read_team, write_team
from fireworld.training.hooks.hook import DONE, FAILED, STOPPED, Hook, StopTraining
from fireworld.training.method import Report, Trainer

if TYPE_CHECKING:
    from fireworld.training.log.episode_run import FullEpisodes
    from fireworld.training.log.reader import TrainingLog
    from fireworld.training.log.writer import TrainingWriter

CHECKPOINT_SUFFIX: Final = ".checkpoint"
HINT: Final = "name what it was begun with, or begin again with --force"


@dataclass
class Training:
    """One team on its way to its file.

    Attributes:
        trainer: trains it.
        path: the team file; None: nowhere, and then there is no checkpoint either.
        log_path: the table of reports, a CSV line for each; None: nowhere.
        record: the training log, which is the checkpoint too; None: nowhere.
        full: writes some episodes as run logs of their own; None: none.
        force: existing files are replaced.
        team: the trained team, once it is done and its file written.
        n_reports: how often it has reported, interrupted trainings before this one included.
        has_checkpoint: whether there is a checkpoint of this training.
        stopped: whether a callback raised StopTraining.
        hooks: callbacks of this training that have a beginning and an end; see `attach`.
    """

    trainer: Trainer[Any, Any]
    path: Path | None = None
    log_path: Path | None = None
    record: Path | None = None
    full: FullEpisodes | None = None
    force: bool = False
    team: Team | None = None
    n_reports: int = 0
    has_checkpoint: bool = False
    stopped: bool = False
    hooks: Sequence[Hook] = ()
    log: str = field(default="", repr=False)
    error: Exception | None = field(default=None, repr=False)
    _resumes: bool = field(default=False, repr=False)
    _before: TrainingLog | None = field(default=None, repr=False)

    @property
    def seed(self) -> int:
        """Of all random draws of the training."""
        return self.trainer.seed

    @property
    def checkpoint(self) -> Path | None:
        """The checkpoint's file: the training log while it is partial, if there is one."""
        if self.record is not None:
            return self.record.with_name(self.record.name + PARTIAL_SUFFIX)
        return self.path and self.path.with_name(self.path.name + CHECKPOINT_SUFFIX)

    @property
    def outputs(self) -> list[Path]:
        """The files that it writes, but the checkpoint."""
        return [path for path in (self.path, self.log_path, self.record) if path is not None]

    @property
    def continues(self) -> bool:
        """Whether it continues an interrupted training."""
        return self.n_reports > 0 or self._resumes

    @property
    def ending(self) -> str:
        """How it has ended, if it is not under way: done, stopped or failed."""
        return DONE if self.team is not None else STOPPED if self.error is None else FAILED

    @property
    def parameters(self) -> dict[str, Any]:
        """What decides what comes of it, as flat plain values: curriculum, method, hyperparameters, seed, version."""
        known = self.trainer.identity
        curriculum, method = known["curriculum"], known["method"]
        return {
            "curriculum": curriculum["name"],
            "curriculum_digest": curriculum["digest"],
            "method": method["name"],
            **self.trainer.method.as_dict(),
            "seed": known["seed"],
            "fireworld": known["fireworld"],
        }

    @property
    def table(self) -> str:
        """All reports so far as CSV, a line for each, below the names of the columns."""
        return _csv_line(self.trainer.report_type.columns()) + self.log

    def numbers(self, report: Report) -> dict[str, float]:
        """Return the numbers of the last report by name; see `Trainer.numbers`."""
        return self.trainer.numbers(report)

    def attach(self, hooks: Sequence[Hook]) -> None:
        """Let hooks follow this training, which has begun or been resumed, but not run.

        Raises:
            FireworldError: one of them could not begin.
        """
        paths = [hook.path for hook in hooks if hook.path is not None]
        check_outputs(paths, force=True, inputs=self.outputs)
        for hook in hooks:
            hook.check(self)
        self.hooks = hooks

    @property
    def interruption(self) -> str:
        """How far an interrupted training has come, and how to continue."""
        done = f"interrupted after {self.n_reports} {self.trainer.unit}s"
        return f"{done}; continue from {self.checkpoint} with --resume" if self.has_checkpoint else done

    def begin(self) -> None:
        """Check that nothing would be overwritten, before any work is done.

        Raises:
            OutputError: a file is in the way, or a folder is missing.
        """
        check_outputs(self.outputs, force=self.force)
        if self.path is not None:
            check_output(self.path, force=self.force, endings=(SUFFIX,))
        if self.checkpoint is not None and self.checkpoint.exists() and not self.force:
            hint = "continue from it with --resume, or begin again with --force"
            got = "one of an earlier training"
            raise OutputError(expected(str(self.checkpoint), "", "no checkpoint", got, hint))

    def resume(self) -> bool:
        """Continue where an earlier call stopped; return whether there was something to continue from.

        Raises:
            TrainingError: a file of another training.
            OutputError: a file is in the way.
        """
        if self.path is not None and self.path.exists():
            self.team = read_team(self.path)[0]
            check_same(self.team.short_provenance, self.trainer.identity, self.path)
            return True
        if self.record is not None and self.record.exists():  # the team file alone is missing
            return self._resume_from(self.record)
        if self.checkpoint is None or not self.checkpoint.exists():
            self.begin()
            return False
        if self.log_path is not None:
            check_output(self.log_path)
        if self.record is not None:
            return self._resume_from(self.checkpoint)
        source = str(self.checkpoint)
        team, state = read_team(self.checkpoint)
        check_same(team.short_provenance, self.trainer.identity, self.checkpoint)
        log = state.pop("log", np.zeros(0, dtype=np.uint8))
        self.trainer.restore(team, state, source=source)
        try:
            self.log = log.tobytes().decode()
        except UnicodeDecodeError:
            raise TrainingError(expected(source, "log", "text", "other bytes")) from None
        self.n_reports = len([*csv.reader(io.StringIO(self.log))])
        self.has_checkpoint = True
        return True

    def _resume_from(self, path: Path) -> bool:
        """Continue where a training log ends; what was cut off before its first part begins anew."""
        from fireworld_recorder.scan import holds_nothing

        from fireworld.training.log.reader import open_training
        from fireworld.training.log.records import TRAINING
        from fireworld.training.log.verify import check_last_part

        self._resumes = True
        if path == self.checkpoint and holds_nothing(path, TRAINING):
            return True
        before = open_training(path, partial=True)
        check_same(before.identity, self.trainer.identity, path)
        check_last_part(before)
        for number, part in enumerate(before.parts()):
            self._report(before.follow(self.trainer, part, number))
        self.has_checkpoint = True
        self._before = before
        return True

    def run(self, workers: Workers, callbacks: Sequence[Callback] = ()) -> None:
        """Train to the end, or until stopped; write a checkpoint at every milestone, the team at last.

        Args:
            workers: when their `stop` is set, the training stops after what is under way, with a checkpoint.
            callbacks: called with this training and the report, after every report, as the training's hooks are.

        Raises:
            OutputError: something cannot be written; the last checkpoint stays.
        """
        if self.team is not None or workers.stop.is_set():
            return
        try:
            for hook in self.hooks:
                hook.start(self)
                self.trainer.watched = True
            self._run(workers, [*self.hooks, *callbacks])
        except Exception as error:
            self.error = error
            raise
        finally:
            for hook in self.hooks:
                hook.finish(self)

    def _run(self, workers: Workers, callbacks: Sequence[Callback]) -> None:
        if self.full is not None:
            self.full.begin(self.trainer)
        with self._recorder() as recorder:
            for report in self.trainer.run(workers):
                if recorder is not None:
                    recorder.write()
                    self.has_checkpoint = True
                self._take(report, callbacks)
                if self.stopped or workers.stop.is_set():
                    break
            if self.trainer.done:
                if recorder is not None:
                    recorder.close()
                self._finish()
                return
        self._write_checkpoint()
        if self.path is None:
            self._write_log()

    def take(
        self, reports: Sequence[Report], team: Team, state: Mapping[str, Any], callbacks: Sequence[Callback]
    ) -> None:
        """Take in a part that was trained elsewhere: its reports, and where the training stands then.

        Raises:
            OutputError: something cannot be written; the last checkpoint stays.
        """
        self.trainer.restore(team, state, source=f"seed {self.seed}")
        for report in reports:
            self._take(report, callbacks)
        if self.trainer.done:
            self._finish()

    def leave(self) -> None:
        """Write a checkpoint of a training that is not done."""
        if self.team is None:
            self._write_checkpoint()

    def _recorder(self) -> AbstractContextManager[TrainingWriter | None]:
        """Return what records the training, if anything does and it is not recorded whole already."""
        if self.record is None or (self._before is not None and self._before.path == self.record):
            return nullcontext()
        from fireworld.training.log.writer import TrainingWriter

        before = () if self._before is None else self._before.raw_parts()
        return TrainingWriter(self.record, self.trainer, force=self.force, before=before if self._resumes else None)

    def _take(self, report: Report, callbacks: Sequence[Callback]) -> None:
        """Do all there is to do after a report, but the training log."""
        self._report(report)
        if self.full is not None:
            self.full.write(self.trainer)
        try:
            for callback in callbacks:
                callback(self, report)
        except StopTraining:
            self.stopped = True
        if report.milestone:
            self._write_checkpoint()

    def _report(self, report: Report) -> None:
        self.n_reports += 1
        self.log += _csv_line(report.as_dict().values())

    def _write_checkpoint(self) -> None:
        if self.checkpoint is None or self.record is not None:
            return
        log = np.frombuffer(self.log.encode(), dtype=np.uint8)
        try:
            write_team(self.trainer.team(), self.checkpoint, force=True, extra={**self.trainer.state(), "log": log})
        except OutputError as error:
            raise self._with_checkpoint(error) from None
        self.has_checkpoint = True

    def _finish(self) -> None:
        team = self.trainer.team()
        try:
            self._write_log()
            try:
                if self.path is not None:
                    write_team(team, self.path, force=self.force)
            except OutputError:
                if self.log_path is not None:
                    self.log_path.unlink(missing_ok=True)  # in the way of the next attempt
                raise
        except OutputError as error:
            raise self._with_checkpoint(error) from None
        if self.checkpoint is not None and self.record is None:
            self.checkpoint.unlink(missing_ok=True)
        self.team, self.has_checkpoint = team, False

    def _write_log(self) -> None:
        if self.log_path is not None:
            write_file(self.log_path, self.table)

    def _with_checkpoint(self, error: OutputError) -> OutputError:
        return OutputError(
            f"{error}; continue from {self.checkpoint} with --resume" if self.has_checkpoint else str(error)
        )


Callback = Callable[[Training, Report], object]
"""Called with a training and its last report."""


def train_all(
    trainings: Sequence[Training],
    *,
    jobs: int | None = None,
    executor: AnyExecutor = None,
    callbacks: Sequence[Callback] = (),
) -> None:
    """Train teams until all are done, or until Ctrl-C, which leaves checkpoints.

    Args:
        trainings: of one method.
        jobs: trainings at a time, or parts of one training at a time where its method uses all workers; None: as many
            as there are cores.
        executor: who trains instead, as for `fw.compare`: elsewhere every training is done by one worker at a time.
        callbacks: called after every report: in this thread, where trainings come one after another; else in the
            threads that train.

    Raises:
        FireworldError: one training failed; the others have stopped, with a checkpoint.
    """
    with gentle_interrupt() as stop:
        if not in_this_process(executor):
            from fireworld.training.elsewhere import train_elsewhere

            train_elsewhere(trainings, workers_for(executor, stop=stop), callbacks)
            return
        workers = threads(jobs, stop=stop)
        if len(trainings) == 1 or trainings[0].trainer.uses_workers:
            for training in trainings:
                training.run(workers, callbacks)
            return
        workers.run([partial(training.run, workers, callbacks) for training in trainings])
        for training in trainings:
            if training.error is not None:  # while all were stopping
                raise training.error


SINCE: Final[Mapping[str, Any]] = {
    "epsilon_first": 1.0,
    "epsilon_schedule": "scenario",
    "untried": "best",
    "draw_last": False,
    "cooperation": True,
    "n_likely": 0,
}
"""Hyperparameters that older files do not have, and what they were by then."""


def check_same(found: Mapping[str, Any], identity: Mapping[str, Any], path: Path) -> None:
    """Check that work was begun with what is asked for now; name the first key that differs.

    Args:
        found: what the work was begun with, as plain values; keys that are not of the identity are ignored.
        identity: what is asked for.
        path: where it was found.

    Raises:
        TrainingError: they differ.
    """
    for key, wanted in identity.items():
        got = found.get(key)
        if key == "method" and isinstance(got, dict):
            got = {name: value for name, value in SINCE.items() if name in wanted} | got
        if got == wanted:
            continue
        if isinstance(got, dict) and isinstance(wanted, dict):
            part = next(name for name in [*wanted, *got] if got.get(name) != wanted.get(name))
            key, wanted, got = f"{key}.{part}", wanted.get(part), got.get(part)  # noqa: PLW2901 - the part at fault
        raise TrainingError(expected(str(path), key, str(wanted), got, HINT))


def _csv_line(values: Iterable[object]) -> str:
    line = io.StringIO()
    csv.writer(line, lineterminator="\n").writerow(values)
    return line.getvalue()
