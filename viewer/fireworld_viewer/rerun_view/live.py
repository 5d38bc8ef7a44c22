"""Live view: a run or a training, streamed to Rerun's viewer while it happens; watching never changes it."""

from __future__ import annotations

import os
import socket
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from threading import Lock
from typing import Any, Final
from urllib.parse import urlsplit

from fireworld.errors import ViewError, expected
from fireworld.records import AIR, CityRecord, MemoryRecording, RunHeader, Snapshot, StepRecord
from fireworld_viewer.rerun_view import app
from fireworld_viewer.rerun_view.feed import Courier, ViewerPipe
from fireworld_viewer.rerun_view.training_curves import CurveDrawing, Point, Sheet

_WAITING_BYTES_MAX: Final = 64_000_000
_BYTES_PER_BUILDING: Final = 40
_WAITING_MAX: Final = 2_000
_POINTS_WAITING_MAX: Final = 100_000
_ENCODE_SECONDS: Final = 60.0


@dataclass(frozen=True)
class Screen:
    """Where a live view goes: a window of its own, or a viewer that runs already."""

    command: tuple[str, ...]
    stays: bool

    def open(self) -> ViewerPipe:
        """Start the process.

        Raises:
            ViewError: it cannot be started.
        """
        return ViewerPipe(self.command, app.viewer_environment(os.environ), stays=self.stays)


def own_window() -> Screen:
    """A window of Rerun's viewer, which stays when the run has ended.

    Raises:
        ViewError: there is no display, or no viewer.
    """
    program = str(app.viewer_executable())
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise ViewError(
            "--view: no display here; try --view-url of a viewer that runs, or --record and `fireworld view`"
        )
    port = str(app.free_port())
    options = ("--bind", app.LOCALHOST, "--port", port, "--hide-welcome-screen", "--expect-data-soon")
    return Screen((program, "-", *options), stays=True)


def running_viewer(url: str) -> Screen:
    """A viewer, or a server of one, that runs on this machine.

    Args:
        url: as the viewer shows it, rerun+http://127.0.0.1:9876/proxy.

    Raises:
        ViewError: another kind of address, or nothing listens there, or Rerun is missing.
    """
    example = f"rerun+http://{app.LOCALHOST}:9876/proxy"
    try:
        parts = urlsplit(url)
        port = parts.port
    except ValueError:
        parts, port = urlsplit(""), None
    if parts.scheme != "rerun+http" or parts.hostname not in {app.LOCALHOST, "localhost"} or port is None:
        wanted = f"an address of this machine like {example}"
        raise ViewError(expected("--view-url", "", wanted, url, "tunnel to another machine with ssh -L"))
    program = str(app.viewer_executable())
    try:
        socket.create_connection((app.LOCALHOST, port), timeout=2.0).close()
    except OSError:
        raise ViewError(expected("--view-url", "", "a viewer that listens", url, f"try rerun --port {port}")) from None
    return Screen((program, "-", "--bind", app.LOCALHOST, "--port", str(port)), stays=False)


class RunView:
    """A run that is watched: hand it every record, and close it at the end; neither waits for a viewer at work.

    Args:
        screen: where to show it.
        header: of the run.
        city: it takes place in.
        tell: told in one line if the view has to end before the run.

    Raises:
        ViewError: the viewer cannot be started.
    """

    def __init__(self, screen: Screen, header: RunHeader, city: CityRecord, *, tell: Callable[[str], None]) -> None:
        drawing = RunDrawing(header, city)
        n_most = _WAITING_BYTES_MAX // (_BYTES_PER_BUILDING * max(1, len(city.building_id)))
        n_most = min(_WAITING_MAX, max(16, n_most))
        self._courier: Courier[StepRecord] = Courier(drawing.encode, screen.open(), n_waiting_max=n_most, tell=tell)

    def add(self, record: StepRecord) -> None:
        """Hand over a step."""
        air = record.snapshot and Snapshot({AIR: record.snapshot.arrays[AIR]})  # the rest would only take memory
        self._courier.put(replace(record, snapshot=air))

    def close(self) -> None:
        """Bring what is left."""
        self._courier.close()


class RunDrawing:
    """The steps of one run as bytes that Rerun reads, in the order in which they come.

    Args:
        header: of the run.
        city: it takes place in.
        title: what the viewer calls it; scenario, policy and seed if left out.
    """

    def __init__(self, header: RunHeader, city: CityRecord, *, title: str = "") -> None:
        self._header, self._city, self._title = header, city, title
        self._stream, self._bytes = _new_stream(app.APPLICATION_ID)
        self._feed: Any = None

    def encode(self, records: Sequence[StepRecord]) -> bytes:
        """Draw the next steps."""
        from fireworld_viewer.rerun_view import blueprint, mapping
        from fireworld_viewer.rerun_view import legend_page as legend

        recording = MemoryRecording(self._header, self._city, records)
        if self._feed is None:
            self._stream.send_blueprint(_following(blueprint.single(recording, focus=False), listed=bool(self._title)))
            self._stream.send_recording_name(self._title or blueprint.title(recording))
            legend.log_legend(self._stream, comparing=False)
            self._feed = mapping.Feed(self._stream, self._city)
        self._feed.take(recording)
        return _drained(self._bytes)


Showing = Callable[[], tuple[str, RunHeader, CityRecord, Sequence[StepRecord]]]
"""Plays a run to be looked at: its title, and the run."""


class TrainingView:
    """A training that is watched: curves of all that it reports, and now and then a run played for the viewer.

    Args:
        screen: where to show it.
        sheet: what is drawn.
        tell: told in one line if the view has to end before the training.

    Raises:
        ViewError: the viewer cannot be started.
    """

    def __init__(self, screen: Screen, sheet: Sheet, *, tell: Callable[[str], None]) -> None:
        stream, self._bytes = _new_stream(f"{app.APPLICATION_ID}-{sheet.title}")
        self._curves = CurveDrawing(stream, sheet)
        self._due: Showing | None = None
        self._lock = Lock()
        self._courier: Courier[Point] = Courier(
            self._encode, screen.open(), n_waiting_max=_POINTS_WAITING_MAX, tell=tell
        )

    def add(self, point: Point, *, showing: Showing | None = None) -> None:
        """Hand over a point, and what to play after it; a playing that has not begun gives way to a later one."""
        if showing is not None:
            with self._lock:
                self._due = showing
        self._courier.put(point)

    def close(self) -> None:
        """Bring what is left."""
        self._courier.close()

    def _encode(self, points: Sequence[Point]) -> bytes:
        self._curves.draw(points)
        content = _drained(self._bytes)
        with self._lock:
            due, self._due = self._due, None
        if due is not None:
            title, header, city, records = due()
            content += RunDrawing(header, city, title=title).encode(records)
        return content


def _new_stream(application_id: str) -> tuple[Any, Any]:
    """A stream that Rerun encodes into memory, and its bytes."""
    import rerun

    stream = rerun.RecordingStream(application_id, send_properties=False)
    if not rerun.is_enabled(stream):
        raise ViewError("--view: Rerun is switched off by the environment variable RERUN; try unsetting it")
    stream.set_log_time_enabled(False)
    stream.set_log_tick_enabled(False)
    return stream, stream.binary_stream()


def _drained(source: Any) -> bytes:
    content: bytes | None = source.read(flush_timeout_sec=_ENCODE_SECONDS)
    return content or b""


def _following(layout: Any, *, listed: bool) -> Any:
    """Let the time cursor of a layout stay at the newest step, and open the list where there are other recordings."""
    import rerun.blueprint as rrb

    from fireworld_viewer.rerun_view.blueprint import STEPS_PER_SECOND
    from fireworld_viewer.rerun_view.layers import TIMELINE

    layout.time_panel = rrb.TimePanel(
        state="collapsed", timeline=TIMELINE, fps=STEPS_PER_SECOND, play_state="following"
    )
    if listed:
        layout.blueprint_panel = rrb.BlueprintPanel(state="expanded")
    return layout
