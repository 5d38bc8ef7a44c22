"""Live view: a run or a training, sent to Rerun's viewer while it happens; a view never changes what it shows."""

from __future__ import annotations

import os
import socket
import subprocess
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from itertools import groupby
from threading import Condition, Thread
from typing import Any, Final, Generic, TypeVar
from urllib.parse import urlsplit

from fireworld.errors import ViewError, expected
from fireworld.records import AIR, CityRecord, MemoryRecording, RunHeader, Snapshot, StepRecord
from fireworld_viewer.rerun_view import app
from fireworld_viewer.rerun_view.training_curves import CurveWriter, TrainingLayout, TrainingPoint

Item = TypeVar("Item")

BATCH_SECONDS: Final = 0.2
"""Time between batches: a viewer redraws some times a second, and fewer, larger batches cost the run less."""
BATCH_MAX: Final = 200
PATIENCE_SECONDS: Final = 5.0  # how long the end waits for a viewer that takes nothing
_PIECE_BYTES: Final = 1 << 16
_WAITING_BYTES_MAX: Final = 64_000_000
_BYTES_PER_BUILDING: Final = 40
_WAITING_MAX: Final = 2_000
_POINTS_WAITING_MAX: Final = 100_000
_ENCODE_SECONDS: Final = 60.0


class ViewerProcess:
    """A process of Rerun's program that reads its standard input: the viewer itself, or a relay to one that runs.

    It may stay when the input ends, as a window does that somebody still looks at. ViewError if it cannot be started.
    """

    def __init__(self, command: Sequence[str], *, stays: bool) -> None:
        self._stays = stays
        try:
            self._process = subprocess.Popen(  # noqa: S603 - our own command
                command,
                env=app.viewer_environment(os.environ),
                bufsize=0,
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                start_new_session=True,  # Ctrl-C is for the run
            )
        except OSError as error:
            raise ViewError(f"--view: Rerun's viewer cannot be started: {error.strerror or error}") from None
        assert self._process.stdin is not None  # noqa: S101 - asked for above
        self._input = self._process.stdin

    def write(self, content: bytes) -> int:
        """Write some or all, waiting while the viewer is busy; return how many bytes. OSError if it is closed."""
        return self._input.write(content[:_PIECE_BYTES]) or 0

    def close(self, *, finished: bool) -> bool:
        """End the input, and abandon the rest unless all was written (`finished`); return whether all has been sent.

        A relay is given the time to send it.
        """
        if finished:
            self._input.close()
        if self._stays:
            self._process.returncode = 0  # it is the user's from now on: no warning that it still runs
            return finished
        app.wait_or_kill(self._process, PATIENCE_SECONDS if finished else 0)
        self._input.close()  # again where all was written; else the process is dead, and the writing thread fails
        return finished and self._process.returncode == 0


class BackgroundSender(Generic[Item]):
    """Sends items in batches. `put` never waits; if too many items wait, every second of them is left out.

    `encode` makes the bytes of a batch, in the sender's thread. `n_waiting_max` bounds the memory. `warn` is called at
    most once, with a line on what the viewer does not show and why.
    """

    def __init__(
        self,
        encode: Callable[[Sequence[Item]], bytes],
        process: ViewerProcess,
        *,
        n_waiting_max: int,
        warn: Callable[[str], None],
    ) -> None:
        self.n_left_out = 0
        self._encode, self._process, self._warn = encode, process, warn
        self._n_waiting_max = n_waiting_max
        self._waiting: list[Item] = []
        self._changed = Condition()
        self._closing = self._failed = False
        self._n_pieces = 0
        self._thread = Thread(target=self._work, name="live view", daemon=True)  # may hang in a viewer that does
        self._thread.start()

    def put(self, item: Item) -> None:
        """Hand over an item."""
        with self._changed:
            if self._failed:
                return
            if len(self._waiting) >= self._n_waiting_max:
                n_before = len(self._waiting)
                del self._waiting[1::2]
                self.n_left_out += n_before - len(self._waiting)
            self._waiting.append(item)
            self._changed.notify()

    def close(self) -> None:
        """Send the rest, as long as the viewer takes it."""
        with self._changed:
            self._closing = True
            self._changed.notify()
        n_before = -1
        while self._thread.is_alive() and n_before != self._n_pieces:
            n_before = self._n_pieces
            self._thread.join(PATIENCE_SECONDS)
        with self._changed:
            failed, finished = self._failed, not self._thread.is_alive()
            self._failed = True
        finished = self._process.close(finished=finished)
        if failed:
            return
        if not finished:
            self._warn("view: the viewer did not take the last of it")
        elif self.n_left_out:
            self._warn(f"view: the viewer is slower than the run; {self.n_left_out} steps are left out in it")

    def _work(self) -> None:
        try:
            while batch := self._next_batch():
                content = self._encode(batch)
                while content:
                    content = content[self._process.write(content) :]
                    self._n_pieces += 1
        except OSError:
            self._give_up("the viewer is closed")
        except Exception as error:  # noqa: BLE001 - whatever is wrong with the view, the run continues
            self._give_up(f"{type(error).__name__}: {error}")

    def _next_batch(self) -> list[Item]:
        """Wait for items, and a little longer for more; return an empty batch at the end."""
        with self._changed:
            self._changed.wait_for(lambda: self._waiting or self._closing)
            if not self._closing:
                self._changed.wait_for(lambda: self._closing, BATCH_SECONDS)
            batch = self._waiting[:BATCH_MAX]
            del self._waiting[:BATCH_MAX]
            return batch

    def _give_up(self, reason: str) -> None:
        with self._changed:
            if self._failed:
                return
            self._failed = True
            self._waiting.clear()
        self._warn(f"view: {reason}; the run continues without it")


Screen = Callable[[], ViewerProcess]
"""Where a live view goes, a window of its own or a viewer that runs already: starts the process that shows it."""


def own_window(
    option: str = "--view", others: str = "--view-url of a viewer that runs, or --record and `fireworld view`"
) -> Screen:
    """Return a window of Rerun's viewer, which stays when the run has ended.

    Args:
        option: what asked for it, for errors.
        others: what to try where there is no display.

    Raises:
        ViewError: there is no display, or no viewer.
    """
    program = str(app.viewer_executable())
    app.check_display(option, others)
    options = ("--bind", app.LOCALHOST, "--port", str(app.free_port()), "--hide-welcome-screen", "--expect-data-soon")
    return partial(ViewerProcess, (program, "-", *options), stays=True)


def running_viewer(url: str, option: str = "--view-url") -> Screen:
    """Return a viewer, or a server of one, that runs on this machine, by its rerun+http://127.0.0.1:9876/proxy.

    ViewError, which names the option, for another kind of address, or if nothing listens there, or Rerun is missing.
    """
    try:
        parts = urlsplit(url)
        port = parts.port
    except ValueError:
        parts, port = urlsplit(""), None
    if parts.scheme != "rerun+http" or parts.hostname not in {app.LOCALHOST, "localhost"} or port is None:
        wanted = f"an address of this machine like rerun+http://{app.LOCALHOST}:9876/proxy"
        raise ViewError(expected(option, "", wanted, url, "tunnel to another machine with ssh -L"))
    program = str(app.viewer_executable())
    try:
        socket.create_connection((app.LOCALHOST, port), timeout=2.0).close()
    except OSError:
        raise ViewError(expected(option, "", "a viewer that listens", url, f"try rerun --port {port}")) from None
    return partial(ViewerProcess, (program, "-", "--bind", app.LOCALHOST, "--port", str(port)), stays=False)


class RunEncoder:
    """Encodes the steps of one run, as they come, as bytes that Rerun reads; without a title it is named by itself."""

    def __init__(self, header: RunHeader, city: CityRecord, *, title: str = "") -> None:
        self._header, self._city, self._title = header, city, title
        self._stream = app.new_stream()
        self._bytes = self._stream.binary_stream()
        self._layers: Any = None

    def encode(self, records: Sequence[StepRecord]) -> bytes:
        """Return the bytes of the next steps."""
        from fireworld_viewer.rerun_view import blueprint
        from fireworld_viewer.rerun_view.pages import log_legend
        from fireworld_viewer.rerun_view.run_layers import RunLayers

        recording = MemoryRecording(self._header, self._city, records)
        if self._layers is None:
            layout = blueprint.following(blueprint.single(recording, focus=False), listed=bool(self._title))
            self._stream.send_blueprint(layout)
            self._stream.send_recording_name(self._title or blueprint.title(recording))
            log_legend(self._stream, comparing=False, map_by=self._city.attribution)
            self._layers = RunLayers(self._stream, self._city)
        self._layers.add(recording)
        content: bytes = self._bytes.read(flush_timeout_sec=_ENCODE_SECONDS) or b""
        return content


class RunView(BackgroundSender[StepRecord]):
    """A live view of a run: add every record, and close it at the end; neither waits for a viewer at work.

    `warn` is called with one line if the view has to end before the run. Errors as in `ViewerProcess`.
    """

    def __init__(self, screen: Screen, header: RunHeader, city: CityRecord, *, warn: Callable[[str], None]) -> None:
        encode = RunEncoder(header, city).encode
        super().__init__(encode, screen(), n_waiting_max=_n_waiting_max(len(city.building_id)), warn=warn)

    def add(self, record: StepRecord) -> None:
        """Hand over a step."""
        self.put(_light(record))


EpisodeStep = tuple[RunHeader, CityRecord, StepRecord]


class EpisodesView(BackgroundSender[EpisodeStep]):
    """A live view of runs one after another, listed in one viewer: add every record; as `RunView` in all else.

    `n_buildings`: of the largest city.
    """

    def __init__(self, screen: Screen, n_buildings: int, *, warn: Callable[[str], None]) -> None:
        self._header: RunHeader | None = None
        super().__init__(self._encode_steps, screen(), n_waiting_max=_n_waiting_max(n_buildings), warn=warn)

    def add(self, header: RunHeader, city: CityRecord, record: StepRecord) -> None:
        """Hand over a step of a run; another header object is another run."""
        self.put((header, city, _light(record)))

    def _encode_steps(self, steps: Sequence[EpisodeStep]) -> bytes:
        content = b""
        for _, run in groupby(steps, key=lambda step: id(step[0])):
            of_run = list(run)
            header, city, _ = of_run[0]
            if header is not self._header:
                self._header, self._encoder = header, RunEncoder(header, city, title=header.title)
            content += self._encoder.encode([record for _, _, record in of_run])
        return content


def _n_waiting_max(n_buildings: int) -> int:
    """Return how many steps may wait."""
    return min(_WAITING_MAX, max(16, _WAITING_BYTES_MAX // (_BYTES_PER_BUILDING * max(1, n_buildings))))


def _light(record: StepRecord) -> StepRecord:
    """Return a step without what the view does not show: it would only take memory."""
    return replace(record, snapshot=record.snapshot and Snapshot({AIR: record.snapshot.arrays[AIR]}))


PlayRun = Callable[[], tuple[str, RunHeader, CityRecord, Sequence[StepRecord]]]
"""Plays a run and returns its title and the run."""


class TrainingView(BackgroundSender[TrainingPoint]):
    """A live view of a training: curves of all that it reports, and now and then a run played for the viewer.

    `warn` is called with one line if the view has to end before the training. Errors as in `ViewerProcess`.
    """

    def __init__(self, screen: Screen, layout: TrainingLayout, *, warn: Callable[[str], None]) -> None:
        stream = app.new_stream(f"{app.APPLICATION_ID}-{layout.title}")
        self._bytes = stream.binary_stream()
        self._curves = CurveWriter(stream, layout)
        self._due: deque[PlayRun] = deque(maxlen=1)
        super().__init__(self._encode_points, screen(), n_waiting_max=_POINTS_WAITING_MAX, warn=warn)

    def add(self, point: TrainingPoint, *, play: PlayRun | None = None) -> None:
        """Hand over a point, and a run to play after it, which replaces one that has not begun."""
        if play is not None:
            self._due.append(play)
        self.put(point)

    def _encode_points(self, points: Sequence[TrainingPoint]) -> bytes:
        self._curves.write(points)
        content: bytes = self._bytes.read(flush_timeout_sec=_ENCODE_SECONDS) or b""
        if self._due:
            title, header, city, records = self._due.pop()()
            content += RunEncoder(header, city, title=title).encode(records)
        return content
