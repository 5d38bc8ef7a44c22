"""Live view: a run or a training, sent to Rerun's viewer while it happens; a view never changes what it shows."""

from __future__ import annotations

import socket
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Final
from urllib.parse import urlsplit

from fireworld.errors import ViewError, expected
from fireworld.records import AIR, CityRecord, MemoryRecording, RunHeader, Snapshot, StepRecord
from fireworld_viewer.rerun_view import app
from fireworld_viewer.rerun_view.live_sender import BackgroundSender, ViewerProcess
from fireworld_viewer.rerun_view.training_curves import CurveWriter, TrainingLayout, TrainingPoint

_WAITING_BYTES_MAX: Final = 64_000_000
_BYTES_PER_BUILDING: Final = 40
_WAITING_MAX: Final = 2_000
_POINTS_WAITING_MAX: Final = 100_000
_ENCODE_SECONDS: Final = 60.0

Screen = Callable[[], ViewerProcess]
"""Where a live view goes, a window of its own or a viewer that runs already: starts the process that shows it."""


def own_window() -> Screen:
    """Return a window of Rerun's viewer, which stays when the run has ended; ViewError without display or viewer."""
    program = str(app.viewer_executable())
    app.check_display("--view", "--view-url of a viewer that runs, or --record and `fireworld view`")
    options = ("--bind", app.LOCALHOST, "--port", str(app.free_port()), "--hide-welcome-screen", "--expect-data-soon")
    return partial(ViewerProcess, (program, "-", *options), stays=True)


def running_viewer(url: str) -> Screen:
    """Return a viewer, or a server of one, that runs on this machine, by its rerun+http://127.0.0.1:9876/proxy.

    ViewError for another kind of address, or if nothing listens there, or Rerun is missing.
    """
    try:
        parts = urlsplit(url)
        port = parts.port
    except ValueError:
        parts, port = urlsplit(""), None
    if parts.scheme != "rerun+http" or parts.hostname not in {app.LOCALHOST, "localhost"} or port is None:
        wanted = f"an address of this machine like rerun+http://{app.LOCALHOST}:9876/proxy"
        raise ViewError(expected("--view-url", "", wanted, url, "tunnel to another machine with ssh -L"))
    program = str(app.viewer_executable())
    try:
        socket.create_connection((app.LOCALHOST, port), timeout=2.0).close()
    except OSError:
        raise ViewError(expected("--view-url", "", "a viewer that listens", url, f"try rerun --port {port}")) from None
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
            log_legend(self._stream, comparing=False)
            self._layers = RunLayers(self._stream, self._city)
        self._layers.add(recording)
        content: bytes = self._bytes.read(flush_timeout_sec=_ENCODE_SECONDS) or b""
        return content


class RunView(BackgroundSender[StepRecord]):
    """A live view of a run: add every record, and close it at the end; neither waits for a viewer at work.

    `warn` is called with one line if the view has to end before the run. Errors as in `ViewerProcess`.
    """

    def __init__(self, screen: Screen, header: RunHeader, city: CityRecord, *, warn: Callable[[str], None]) -> None:
        n_fit = _WAITING_BYTES_MAX // (_BYTES_PER_BUILDING * max(1, len(city.building_id)))
        n_most = min(_WAITING_MAX, max(16, n_fit))
        super().__init__(RunEncoder(header, city).encode, screen(), n_waiting_max=n_most, warn=warn)

    def add(self, record: StepRecord) -> None:
        """Hand over a step."""
        air = record.snapshot and Snapshot({AIR: record.snapshot.arrays[AIR]})  # the rest would only take memory
        self.put(replace(record, snapshot=air))


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
