"""Ways to look: files are whole or absent, servers are local, and every failure is one sentence."""

from __future__ import annotations

import math
import os
import socket
import subprocess
import sys
import urllib.request
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import rerun
from fireworld_viewer.rerun_view import app
from fireworld_viewer.rerun_view.blueprint import Camera, frame_all, frame_from_above, title
from fireworld_viewer.rerun_view.brigades import positions_m
from fireworld_viewer.rerun_view.pages import OutcomePage

from fireworld.errors import OutputError, ViewError
from fireworld.records import MemoryRecording
from tests.viewer import rrd
from tests.viewer.conftest import make_recording

pytestmark = pytest.mark.slow


def test_rerun_verifies_what_is_saved(small, slower, tmp_path: Path):
    app.save([small], tmp_path / "one.rrd", focus=[100])
    outcome = OutcomePage(heads=["a", "b"], rows=[("steps", "41", "31")], first_step=1, first_sentence="step 1")
    app.save([small, slower], tmp_path / "two.rrd", outcome=outcome)
    done = rrd.rerun_program("rrd", "verify", str(tmp_path / "one.rrd"), str(tmp_path / "two.rrd"))
    assert done.returncode == 0, done.stderr
    assert "2 files verified without error" in done.stdout + done.stderr


def test_the_same_recording_gives_the_same_data(small, tmp_path: Path):
    app.save([small], tmp_path / "one.rrd")
    app.save([small], tmp_path / "two.rrd")
    done = rrd.rerun_program("rrd", "compare", "--unordered", str(tmp_path / "one.rrd"), str(tmp_path / "two.rrd"))
    assert done.returncode == 0, done.stderr
    different = make_recording(6, 6, 40, speed_m=7.0)
    app.save([different], tmp_path / "three.rrd")
    done = rrd.rerun_program("rrd", "compare", "--unordered", str(tmp_path / "one.rrd"), str(tmp_path / "three.rrd"))
    assert done.returncode != 0


def test_an_existing_file_is_replaced_only_when_asked(small, tmp_path: Path):
    path = tmp_path / "run.rrd"
    path.write_text("mine")
    with pytest.raises(
        OutputError, match=r"run\.rrd: expected a name that is free, got an existing file; use --force to replace it"
    ):
        app.save([small], path)
    assert path.read_text() == "mine"
    app.save([small], path, force=True)
    assert path.stat().st_size > 10_000
    assert list(tmp_path.iterdir()) == [path]


def test_a_missing_folder_is_named(small, tmp_path: Path):
    with pytest.raises(OutputError, match=r"expected an existing folder .*nowhere"):
        app.save([small], tmp_path / "nowhere" / "run.rrd")


@pytest.mark.skipif(os.name == "nt", reason="needs a limit on the size of files")
def test_a_full_disk_leaves_nothing_behind(tmp_path: Path):
    program = """
import faulthandler, resource, signal, sys
from pathlib import Path
from fireworld.errors import OutputError
from tests.viewer.conftest import make_recording
from fireworld_viewer.rerun_view import app
faulthandler.dump_traceback_later(100, exit=True)
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, 50_000))
try:
    app.save([make_recording(6, 6, 40)], Path(sys.argv[1]))
except OutputError as error:
    print(error)
"""
    command = [sys.executable, "-c", program, str(tmp_path / "run.rrd")]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    assert done.stderr == ""
    assert ": expected room for a Rerun file, got " in done.stdout
    assert done.stdout.endswith(" bytes of it; try TMPDIR=another folder\n")
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_is_not_whole_is_noticed(small, tmp_path: Path):
    """Rerun writes in a thread of its own, and says nothing of bytes that found no room."""
    app.save([small], tmp_path / "run.rrd")
    path = tmp_path / "run.rrd"
    content = path.read_bytes()
    assert app.is_whole(path)
    for damaged in (b"", content[:10], content[:-1], content[:-5000], content[:1000] + content[2000:], content + b"0"):
        path.write_bytes(damaged)
        assert not app.is_whole(path)


def test_logging_switched_off_by_the_environment_is_not_mistaken_for_success(tmp_path: Path):
    program = """
import sys
from pathlib import Path
from fireworld.errors import ViewError
from tests.viewer.conftest import make_recording
from fireworld_viewer.rerun_view import app
try:
    app.save([make_recording(3, 3, 2)], Path(sys.argv[1]))
except ViewError as error:
    print(error)
"""
    command = [sys.executable, "-c", program, str(tmp_path / "run.rrd")]
    environment = {**os.environ, "RERUN": "off"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False, timeout=60)
    assert "Rerun is switched off by the environment variable RERUN" in done.stdout, done.stderr
    assert list(tmp_path.iterdir()) == []


def test_another_minor_version_is_refused(small, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(rerun, "__version__", "0.42.1")
    with pytest.raises(ViewError, match=r"expected 0\.41\.\*, got '0\.42\.1'; try pip install 'fireworld\[view\]'"):
        app.save([small], tmp_path / "run.rrd")


def test_a_missing_rerun_is_named(small, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(ViewError, match=r"Rerun is not installed; try pip install 'fireworld\[view\]'"):
        app.save([small], tmp_path / "run.rrd")


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="other systems always have a display")
def test_without_a_display_the_other_ways_are_named(small, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(ViewError, match=r"no display here; try --save FILE\.rrd, --web, or `fireworld render`"):
        app.show(partial(app.save, [small]))


@pytest.mark.skipif(os.name == "nt", reason="needs a shell")
def test_a_viewer_that_cannot_open_its_window_is_one_sentence(
    small, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
):
    broken = tmp_path / "rerun"
    broken.write_text("#!/bin/sh\necho 'Error: at mod.rs:7: no\nVulkan driver' >&2\nexit 3\n")
    broken.chmod(0o700)
    monkeypatch.setattr(app, "viewer_executable", lambda: broken)
    monkeypatch.setenv("DISPLAY", ":0")
    with pytest.raises(ViewError, match=r"ended with code 3: no Vulkan driver; try --save FILE\.rrd, --web, or `fire"):
        app.show(partial(app.save, [small]))
    assert capfd.readouterr() == ("", "")


def test_a_taken_port_is_named(small):
    with socket.socket() as taken:
        taken.bind((app.LOCALHOST, 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(ViewError, match=f"--port: expected a free port, got {port}"):
            app.serve(partial(app.save, [small]), port=port, announce=print)


@pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="reads the table of sockets")
def test_the_page_is_served_on_this_machine_only_and_ends_when_told(tmp_path: Path):
    port = app.free_port()
    program = f"""
from tests.viewer.conftest import make_recording
from fireworld_viewer.rerun_view import app
write = lambda path: app.save([make_recording(3, 3, 2)], path)
app.serve(write, port={port}, announce=lambda address: print(address, flush=True))
"""
    environment = {**os.environ, "HOME": str(tmp_path), "XDG_CONFIG_HOME": str(tmp_path), "TMPDIR": str(tmp_path)}
    with subprocess.Popen(
        [sys.executable, "-c", program], env=environment, stdout=subprocess.PIPE, text=True
    ) as server:
        try:
            assert server.stdout is not None
            assert server.stdout.readline().startswith(f"http://127.0.0.1:{port}?url=")
            page = wait_for_page(f"http://127.0.0.1:{port}/")
            assert b"re_viewer.js" in page
            assert listening_addresses(port) == {"0100007F"}  # 127.0.0.1
        finally:
            server.terminate()
            assert server.wait(timeout=20) == 0
    assert listening_addresses(port) == set()
    assert not list(tmp_path.rglob("analytics*"))
    assert not list(tmp_path.glob("fireworld-*"))


def wait_for_page(address: str) -> bytes:
    for _ in range(200):
        try:
            with urllib.request.urlopen(address, timeout=5) as answer:  # noqa: S310 - our own server
                content: bytes = answer.read()
                return content
        except OSError:
            subprocess.run(["sleep", "0.05"], check=True)  # noqa: S607 - nothing else to wait for
    raise AssertionError("the page was not served")


def listening_addresses(port: int) -> set[str]:
    rows = [line.split() for line in Path("/proc/net/tcp").read_text().splitlines()[1:]]
    return {row[1].split(":")[0] for row in rows if row[3] == "0A" and int(row[1].split(":")[1], 16) == port}


def test_the_viewer_reports_no_usage():
    environment = app.viewer_environment({"RERUN_ANALYTICS": "on", "HOME": "/home/me"})
    assert environment["CI"] == "1"
    assert "RERUN_ANALYTICS" not in environment
    assert environment["HOME"] == "/home/me"


def on_screen(camera: Camera, places: np.ndarray, *, aspect: float) -> np.ndarray:
    """Where places, (k, 3), are seen, (k, 2): -1 to 1 from edge to edge of the view."""
    forward = np.subtract(camera.target_m, camera.eye_m)
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, camera.up)
    right /= np.linalg.norm(right)
    x, y, depth = ((places - camera.eye_m) @ axis for axis in (right, np.cross(right, forward), forward))
    return np.column_stack([x / aspect, y]) / depth[:, np.newaxis] / math.tan(math.radians(27.5))


@pytest.mark.parametrize("aspect", [0.8, 1.5, 2.5])
def test_the_camera_sees_all_that_burns_and_the_whole_team(small, slower, aspect: float):
    away = replace(list(small)[3].brigades, x_m=np.array([-600.0, 20.0, 30.0]), y_m=np.array([900.0, 0.0, 10.0]))
    records = [*list(small)[:3], replace(list(small)[3], brigades=away)]
    for runs in ([small], [small, slower], [MemoryRecording(small.header, small.city, records)]):
        camera = frame_all(runs, aspect=aspect)
        assert camera.target_m[2] == 0
        assert camera.eye_m[1] < camera.target_m[1], "it looks from the south"
        burnt = [one.column("/buildings", "fieryness").any(axis=0) for one in runs]
        city = small.city
        places = np.column_stack([city.center_x_m, city.center_y_m, 0 * city.center_x_m])[np.any(burnt, axis=0)]
        team = np.concatenate([positions_m(one).reshape(-1, 3) for one in runs])
        seen = on_screen(camera, np.concatenate([places, team]), aspect=aspect)
        assert np.abs(seen).max() < 1.0
    assert np.abs(seen).max() > 0.8, "and little more than that"


def test_the_map_from_above_shows_the_whole_box_with_north_up():
    camera = frame_from_above((0.0, 0.0), (300.0, 100.0), aspect=1.5)
    assert camera.target_m == (150.0, 50.0, 0.0)
    assert camera.eye_m[:2] == (150.0, 50.0)
    assert camera.up == (0.0, 1.0, 0.0)
    half_width = camera.eye_m[2] * math.tan(math.radians(27.5)) * 1.5
    assert 150.0 < half_width < 170.0


def test_names_from_files_keep_letters_that_the_viewer_can_draw(small):
    header = type(small.header)(**{**small.header.__dict__, "scenario": "Zürich \U0001f525\n"})
    assert title(type(small)(header, small.city, [])) == "Zürich ??, easiest, seed 3"


def test_a_viewer_that_does_not_listen_is_killed(tmp_path, monkeypatch):
    """As Rerun's server does now and then on a busy machine: it is asked to end, and goes on."""
    deaf = tmp_path / "deaf"
    deaf.write_text("#!/bin/sh\ntrap '' TERM INT\nsleep 1\nkill -INT $PPID\nwhile :; do sleep 1; done\n")
    deaf.chmod(0o755)
    monkeypatch.setattr(app, "viewer_executable", lambda: deaf)
    monkeypatch.setattr(app, "ENDING_SECONDS", 0.5)
    app._run_viewer(lambda path: path.write_bytes(b""), [])
