"""Ways to look at recordings: save them for Rerun, open Rerun's window, or serve Rerun to a browser."""

from __future__ import annotations

import hashlib
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, Final

from fireworld.errors import OutputError, ViewError, expected
from fireworld.files import check_output, write_file, written_beside
from fireworld.records import Recording
from fireworld_viewer.rerun_view.pages import OutcomePage
from fireworld_viewer.story.steps import check_same_city

if TYPE_CHECKING:
    import rerun

RERUN_MINOR: Final = "0.41."
INSTALL_HINT: Final = "try pip install 'fireworld[view]'"
LOCALHOST: Final = "127.0.0.1"
WEB_PORT: Final = 9090
WIDGET_PIXELS: Final = (1200, 800)
"""Width and height of what a notebook shows."""
APPLICATION_ID: Final = "fireworld"
_END_BYTES: Final = 32  # of a Rerun file, after its table of contents
_WRITE_SECONDS: Final = 60.0  # for one block of a Rerun file, a few MB
ENDING_SECONDS: Final = 5.0
"""For a viewer that is asked to end."""


def save(
    recordings: Sequence[Recording],
    path: Path,
    *,
    focus: Sequence[int] = (),
    force: bool = False,
    outcome: OutcomePage | None = None,
) -> None:
    """Write one recording, or two side by side, as a Rerun file; an unfinished file never bears the final name.

    `focus`: ids of buildings whose temperatures are plotted; if there are none, those that burn first. `outcome`: how
    the runs came out, and where two first differ; left out of the view if not given. Errors: OutputError, or ViewError
    if Rerun is missing, the cities differ or a building of the focus is unknown.
    """
    check_output(path, force=force)
    with written_beside(path) as partial:
        _write_rrd(recordings, focus, outcome, partial)


def save_training(
    write: Callable[[rerun.RecordingStream], None], path: Path, *, identity: str, title: str, force: bool = False
) -> None:
    """Write the curves of trainings as a Rerun file: `write` sends them to a stream.

    `identity` names what is shown, for Rerun merges what has one name. Errors: OutputError, or ViewError if Rerun is
    missing.
    """
    check_output(path, force=force)
    rerun = _import_rerun()
    stream = new_stream(f"{APPLICATION_ID}-{title}", recording_id=identity[:32])
    memory = stream.memory_recording()
    with warnings.catch_warnings():
        warnings.simplefilter("error", rerun.error_utils.RerunWarning)
        write(stream)
    write_file(path, memory.drain_as_bytes())


def show(write: Callable[[Path], None]) -> None:
    """Open the Rerun file that `write` makes in Rerun's own window, and return when it is closed.

    ViewError if there is no display, or no viewer.
    """
    _import_rerun()
    check_display("view", "--save FILE.rrd, --web, or `fireworld render` for pictures")
    _run_viewer(write, ["--port", str(free_port()), "--hide-welcome-screen"])


def serve(write: Callable[[Path], None], *, port: int = WEB_PORT, announce: Callable[[str], None]) -> None:
    """Serve the Rerun file that `write` makes to browsers on this machine until interrupted; announce the address.

    ViewError if the port, that of the page, is taken, or if there is no viewer.
    """
    _import_rerun()
    try:
        free_port(port)
    except OSError:
        raise ViewError(expected("view", "--port", "a free port", port, "try another one")) from None
    data_port = free_port()
    address = f"http://{LOCALHOST}:{port}?url=rerun%2Bhttp%3A%2F%2F{LOCALHOST}%3A{data_port}%2Fproxy"
    ports = ["--web-viewer-port", str(port), "--port", str(data_port)]
    _run_viewer(write, ["--serve-web", *ports], announce=lambda: announce(address))


def widget(recordings: Sequence[Recording], *, outcome: OutcomePage | None = None) -> Any:
    """Return Rerun's widget, which notebooks show, with one recording, or two side by side.

    ViewError if Rerun or its widget is missing, or the cities differ.
    """
    _import_rerun()
    from rerun import notebook

    if not notebook.HAS_NOTEBOOK:
        raise ViewError(f"show: Rerun's widget is not installed; try pip install 'rerun-sdk[notebook]~={RERUN_MINOR}0'")
    check_same_city(*(one.city for one in recordings))
    stream = new_stream(recording_id=_identity(recordings))
    viewer = notebook.Viewer(width=WIDGET_PIXELS[0], height=WIDGET_PIXELS[1], recording=stream)
    _send(stream, recordings, (), outcome)
    stream.flush()
    return viewer


def check_display(option: str, others: str) -> None:
    """Raise ViewError where no window can be opened; the message names the option and what others to try."""
    if sys.platform.startswith("linux") and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise ViewError(f"{option}: no display here; try {others}")


def viewer_executable() -> Path:
    """Return the path of Rerun's viewer, or raise ViewError; the `rerun` script would leave it running when stopped."""
    folder = Path(str(_import_rerun().__file__)).parents[1] / "rerun_cli"
    path = folder / ("rerun.exe" if os.name == "nt" else "rerun")
    if not path.is_file():
        raise ViewError(f"view: expected Rerun's viewer at {path}; {INSTALL_HINT}")
    return path


def viewer_environment(environment: Mapping[str, str]) -> dict[str, str]:
    """Return an environment for Rerun's viewer: it reports usage, except in continuous integration."""
    others = {name: value for name, value in environment.items() if name != "RERUN_ANALYTICS"}
    return {**others, "CI": "1", "RUST_LOG": environment.get("RUST_LOG", "error")}


def free_port(wanted: int = 0) -> int:
    """Return a port of this machine that nobody listens on: any for 0, else the one wanted; OSError if it is taken."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        probe.bind((LOCALHOST, wanted))
        port: int = probe.getsockname()[1]
        return port


def new_stream(application_id: str = APPLICATION_ID, *, recording_id: str | None = None) -> rerun.RecordingStream:
    """Return an empty stream without timelines of its own; ViewError if Rerun is missing or switched off."""
    rerun = _import_rerun()
    stream = rerun.RecordingStream(application_id, recording_id=recording_id, send_properties=False)
    if not rerun.is_enabled(stream):
        raise ViewError("view: Rerun is switched off by the environment variable RERUN; try unsetting it")
    stream.set_log_time_enabled(False)
    stream.set_log_tick_enabled(False)
    return stream


def _write_rrd(
    recordings: Sequence[Recording], focus: Sequence[int], outcome: OutcomePage | None, output: Path
) -> None:
    """Write the Rerun file of one recording, or of two of the same city.

    Rerun writes it to a temporary file, which has a name that it takes, as it is sent, block by block: a large city
    would fill gigabytes of memory before it is compressed. It does so in a thread of its own that reports no error, so
    the end is checked.
    """
    check_same_city(*(one.city for one in recordings))
    stream = new_stream(recording_id=_identity(recordings))
    with tempfile.TemporaryDirectory(prefix="fireworld-") as folder:
        path = Path(folder) / "view.rrd"
        stream.save(path)

        def write_out() -> None:
            try:
                stream.flush(timeout_sec=_WRITE_SECONDS)
            except RuntimeError:  # the thread that writes has given up, and may not even say so
                raise _no_room(path) from None

        _send(stream, recordings, focus, outcome, after_block=write_out)
        stream.disconnect()
        if not is_whole(path):
            raise _no_room(path)
        shutil.copyfile(path, output)


def _send(
    stream: rerun.RecordingStream,
    recordings: Sequence[Recording],
    focus: Sequence[int],
    outcome: OutcomePage | None,
    *,
    after_block: Callable[[], object] | None = None,
) -> None:
    """Send everything that is shown, `after_block` after each block of wide data."""
    rerun = _import_rerun()
    from fireworld_viewer.rerun_view import blueprint
    from fireworld_viewer.rerun_view.pages import OUTCOME_PATH, log_legend, log_page
    from fireworld_viewer.rerun_view.plots import first_burning
    from fireworld_viewer.rerun_view.run_layers import RunLayers, log_comparison

    comparing = len(recordings) > 1
    with warnings.catch_warnings():
        # Rerun warns of data it cannot take and continues; a view that lacks something is worse than none.
        warnings.simplefilter("error", rerun.error_utils.RerunWarning)
        plotted = focus or first_burning(recordings[0])
        lay_out = blueprint.pair if comparing else blueprint.single
        stream.send_blueprint(lay_out(*recordings, focus=bool(plotted), outcome=outcome))
        stream.send_recording_name(" | ".join(map(blueprint.title, recordings)))
        acting = any(not one.header.lacks("brigades.activity") for one in recordings)
        log_legend(stream, comparing=comparing, acting=acting, map_by=recordings[0].city.attribution)
        if outcome is not None:
            log_page(stream, OUTCOME_PATH, outcome.markdown)
        look: dict[str, Any] = {
            "focus": plotted, "names_apart_m": blueprint.names_apart_m(recordings), "after_block": after_block,
        }  # fmt: skip
        if comparing:
            log_comparison(stream, *recordings, outcome=outcome, **look)
        else:
            RunLayers(stream, recordings[0].city, **look).add(recordings[0], complete=True)


def _no_room(path: Path) -> OutputError:
    where, found = str(path.parents[1]), f"{path.stat().st_size} bytes of it"
    return OutputError(expected(where, "", "room for a Rerun file", found, "try TMPDIR=another folder"))


def is_whole(path: Path) -> bool:
    """Return whether a Rerun file is as long as its end says, by the place and the length of its table of contents."""
    n_bytes = path.stat().st_size
    with path.open("rb") as file:
        file.seek(max(0, n_bytes - _END_BYTES))
        end = file.read()
    begins, length = int.from_bytes(end[:8], "little"), int.from_bytes(end[8:16], "little")
    return end[-12:-4] == b"RRF2FOOT" and begins + length + _END_BYTES == n_bytes


def _identity(recordings: Sequence[Recording]) -> str:
    """Return a name for what is shown: Rerun merges what has one name, so different runs must have different ones."""
    digest = hashlib.sha256()
    for one in recordings:
        digest.update(f"{one.header.scenario_digest} {one.header.seed} {one.header.policy_digest}".encode())
        digest.update(one.steps.tobytes())
        heat = _heat(one)
        for record in one:
            digest.update(getattr(record.buildings, heat).tobytes())
            digest.update(record.brigades.x_m.tobytes())
    return digest.hexdigest()[:32]


def _heat(recording: Recording) -> str:
    """Return the field that runs differ in first: all digits of the heat, where they are recorded."""
    return "temperature" if recording.header.lacks("buildings.energy") else "energy"


def _run_viewer(
    write: Callable[[Path], None], options: list[str], *, announce: Callable[[], object] = lambda: None
) -> None:
    """Run Rerun's viewer on a file until it ends or this process is stopped; it never outlives this process."""
    with tempfile.TemporaryDirectory(prefix="fireworld-") as folder:
        path = Path(folder) / "view.rrd"
        write(path)
        announce()
        command = [str(viewer_executable()), "--bind", LOCALHOST, *options, str(path)]
        before = signal.signal(signal.SIGTERM, signal.default_int_handler)
        with (Path(folder) / "errors").open("w+", encoding="utf-8", errors="replace") as errors:
            viewer = subprocess.Popen(command, env=viewer_environment(os.environ), stderr=errors)  # noqa: S603 - our own
            try:
                status = viewer.wait()
            except KeyboardInterrupt:
                status = 0
            finally:
                signal.signal(signal.SIGTERM, before)
                viewer.terminate()
                wait_or_kill(viewer, ENDING_SECONDS)
            errors.seek(0)
            reason = " ".join(errors.read().split())
    if status:
        why = f": {reason.rpartition(': ')[2][-120:]}" if reason else ""
        hint = "try --save FILE.rrd, --web, or `fireworld render`"
        raise ViewError(f"view: Rerun's viewer ended with code {status}{why}; {hint}")


def wait_or_kill(viewer: subprocess.Popen[bytes], seconds: float) -> None:
    """Wait for a viewer to end; one that does not, busy or deaf, is killed after a while."""
    try:
        viewer.wait(seconds)
    except subprocess.TimeoutExpired:
        viewer.kill()
        viewer.wait()


def _import_rerun() -> ModuleType:
    """Import Rerun, quietly, or raise ViewError: its own log would stand between the user and our one line."""
    level = os.environ.get("RUST_LOG")
    os.environ["RUST_LOG"] = level or "off"  # read once, when Rerun is first imported
    try:
        import rerun
    except ImportError:
        raise ViewError(f"view: Rerun is not installed; {INSTALL_HINT}") from None
    finally:
        if level is None:
            del os.environ["RUST_LOG"]
    if not rerun.__version__.startswith(RERUN_MINOR):
        raise ViewError(expected("rerun-sdk", "version", f"{RERUN_MINOR}*", rerun.__version__, INSTALL_HINT))
    module: ModuleType = rerun
    return module
