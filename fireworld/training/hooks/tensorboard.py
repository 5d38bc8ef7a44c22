"""A training in TensorBoard: an event file, written while the team learns."""

from __future__ import annotations

import time
from collections.abc import Iterable
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fireworld.arguments import path_of
from fireworld.errors import LibraryError, OutputError, expected
from fireworld.files import make_folder
from fireworld.training.hooks.hook import DONE, Hook

if TYPE_CHECKING:
    from fireworld.training.method import Report
    from fireworld.training.training import Training

PREFIX: Final = "events.out.tfevents."
SUFFIX: Final = ".fireworld"
"""Of the event files written here: only these are replaced."""
FLUSH_SECONDS: Final = 2.0


class TensorBoardCallback(Hook):
    """Writes every number of every report as a scalar; parameters, scenarios and the team's digest as texts.

    TensorBoard keeps scalars as float32.

    Args:
        folder: of this run; made if it is not there. A training that is continued adds an event file to it, and what is
            after the checkpoint in the one before counts no more.
    """

    def __init__(self, folder: str | Path) -> None:
        self._folder = path_of("folder", folder)
        self._writer: Any = None
        self._flushed = 0.0
        self._place = ""

    @property
    def name(self) -> str:
        """TensorBoard and its folder."""
        return f"TensorBoard {self._folder}"

    def check(self, training: Training) -> None:
        """Raise LibraryError if tensorboardX is not installed, OutputError if the folder has another run in it."""
        if find_spec("tensorboardX") is None:
            raise LibraryError("TensorBoard: tensorboardX is not installed; try pip install 'fireworld[tensorboard]'")
        if self._folder.exists() and not self._folder.is_dir():
            raise OutputError(expected(str(self._folder), "", "a folder, or a name that is free", "a file"))
        if not training.force and not training.continues and self._events():
            hint = "name a folder for each run, or use --force to replace it"
            raise OutputError(expected(str(self._folder), "", "no event files", "those of another run", hint))

    def begin(self, training: Training) -> None:
        """Begin an event file."""
        from tensorboardX.proto.event_pb2 import Event, SessionLog
        from tensorboardX.record_writer import RecordWriter
        from tensorboardX.summary import hparams, text

        make_folder(self._folder)
        if not training.continues:
            for path in self._events():
                if path.name.endswith(SUFFIX):
                    path.unlink()
        self._place, self._flushed = "", 0.0
        path = self._folder / f"{PREFIX}{time.time_ns():020d}{SUFFIX}"
        self._writer = RecordWriter(str(path))
        self._add(Event(file_version="brain.Event:2"))
        if training.continues:
            self._add(Event(step=training.n_reports, session_log=SessionLog(status=SessionLog.START)))
        facts = training.parameters
        lines = "\n".join(f"    {key}: {value}" for key, value in facts.items())  # indented: as it stands
        self._add_summaries([text("parameters", lines), *hparams(facts, {})[:2]], training.n_reports)
        self._flush()

    def write(self, training: Training, report: Report) -> None:
        """Write the numbers of a report."""
        from tensorboardX.proto.summary_pb2 import Summary
        from tensorboardX.summary import text

        n = training.n_reports - 1
        numbers = [Summary.Value(tag=key, simple_value=value) for key, value in training.numbers(report).items()]
        self._add_summaries([Summary(value=numbers)], n)
        if report.place != self._place:
            self._place = report.place
            self._add_summaries([text("scenario", report.place)], n)
        if time.monotonic() - self._flushed > FLUSH_SECONDS:
            self._flush()

    def end(self, training: Training) -> None:
        """Write how it ended, and the team's digest."""
        from tensorboardX.summary import hparams, text

        words = training.ending
        if training.team is not None:
            words += f", team {training.path or 'not written'}, digest {training.team.digest}"
        last = [hparams({}, {})[2]] if training.ending == DONE else []
        self._add_summaries([text("ending", words), *last], training.n_reports)
        self._flush()

    def close(self) -> None:
        """Close the event file."""
        if self._writer is not None:
            self._writer.close()

    def _events(self) -> list[Path]:
        with suppress(OSError):
            return [path for path in self._folder.iterdir() if path.name.startswith(PREFIX)]
        return []

    def _add_summaries(self, summaries: Iterable[Any], step: int) -> None:
        from tensorboardX.proto.event_pb2 import Event

        for summary in summaries:
            self._add(Event(step=step, summary=summary))

    def _add(self, event: Any) -> None:
        event.wall_time = time.time()
        self._writer.write(event.SerializeToString())

    def _flush(self) -> None:
        self._writer.flush()
        self._flushed = time.monotonic()
