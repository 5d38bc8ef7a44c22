"""`fireworld view`: its options, its errors, and damaged recordings."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner, Result
from fireworld_recorder import source
from fireworld_recorder.diff import compare
from fireworld_viewer.rerun_view import app

from fireworld.cli import root
from fireworld.errors import FireworldError, OutputError, ViewError
from fireworld.records import MemoryRecording
from tests.viewer import rrd
from tests.viewer.conftest import make_recording

reader = pytest.importorskip("fireworld_recorder.reader")


class OpenedLog:
    """A recording as the recorder opens it."""

    def __init__(self, recording: MemoryRecording, damage: str | None) -> None:
        self.header, self.city, self.steps = recording.header, recording.city, recording.steps
        self.damage = damage
        self.path = Path()
        self._recording = recording

    def __iter__(self):
        return iter(self._recording)


@pytest.fixture
def logs(small: MemoryRecording, slower: MemoryRecording, monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """Let the names a.mcap, b.mcap and cut.mcap stand for recordings."""
    known = {
        "a.mcap": OpenedLog(small, None),
        "b.mcap": OpenedLog(slower, None),
        "cut.mcap": OpenedLog(small, "cut off after step 40"),
    }

    def open_log(path: Path, *, partial: bool) -> OpenedLog:
        assert partial  # a damaged recording is shown as far as it is good
        known[path.name].path = path
        return known[path.name]

    monkeypatch.setattr(reader, "open_log", open_log)
    monkeypatch.setattr(source, "noun_of", lambda _: "run")
    return SimpleNamespace(small=small, slower=slower)


def view(*arguments: str) -> Result:
    return CliRunner().invoke(root, ["view", *arguments])


def test_save_one(logs, tmp_path: Path):
    path = tmp_path / "a.rrd"
    result = view("a.mcap", "--save", str(path), "--focus", "121,100,121")
    assert result.exit_code == 0, result.output
    assert result.output == f"wrote {path}; open it with `rerun {path}`\n"
    (_, names) = rrd.read(path)["/plots/focus"]["SeriesLines:names"][0]
    assert names.as_py() == ["building 121", "building 100"]


def test_save_two_side_by_side(logs, tmp_path: Path):
    result = view("a.mcap", "b.mcap", "--save", str(tmp_path / "ab.rrd"))
    assert result.exit_code == 0, result.output
    found = rrd.read(tmp_path / "ab.rrd")
    assert {"/a/city/buildings", "/b/city/buildings", "/diff/city/buildings"} <= set(found)


def test_the_outcome_and_the_first_difference_are_those_that_diff_tells(logs, tmp_path: Path):
    assert view("a.mcap", "b.mcap", "--save", str(tmp_path / "ab.rrd")).exit_code == 0
    found = rrd.read(tmp_path / "ab.rrd")
    first = compare(logs.small, logs.slower).first
    assert first is not None
    (line,) = found["/diff/log/first_difference"]["TextLog:text"]
    assert (line[0], line[1].as_py()) == (first.step, [f"{first.step}  first difference: {first.sentence}"])
    page = found["/outcome"]["TextDocument:text"][0][1].as_py()[0]
    assert "| A: a.mcap | B: b.mcap |" in page
    assert "| steps | 41 | 31 |" in page
    assert view("a.mcap", "--save", str(tmp_path / "a.rrd")).exit_code == 0
    page = rrd.read(tmp_path / "a.rrd")["/outcome"]["TextDocument:text"][0][1].as_py()[0]
    assert page.startswith("|  | a.mcap |")
    assert "| score | 5 |" in page


def test_two_cities_are_not_compared(logs, monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    other = make_recording(5, 5, 3)
    known = {"a.mcap": logs.small, "b.mcap": other}
    monkeypatch.setattr(reader, "open_log", lambda path, **_: OpenedLog(known[path.name], None))
    result = view("a.mcap", "b.mcap", "--save", str(tmp_path / "ab.rrd"))
    assert isinstance(result.exception, ViewError)
    assert str(result.exception).endswith("try to view them one by one")
    assert list(tmp_path.iterdir()) == []


def test_a_damaged_recording_is_shown_as_far_as_it_is_good(logs, tmp_path: Path):
    result = view("cut.mcap", "--save", str(tmp_path / "a.rrd"))
    assert result.exit_code == 0
    assert "cut.mcap: cut off after step 40; showing 41 committed steps\n" in result.stderr


def test_steps_can_be_chosen(logs, tmp_path: Path):
    result = view("a.mcap", "--save", str(tmp_path / "a.rrd"), "--from", "5", "--to", "20", "--every", "4")
    assert result.exit_code == 0, result.output
    rows = rrd.read(tmp_path / "a.rrd")["/plots/score"]["Scalars:scalars"]
    assert [step for step, _ in rows] == [5, 9, 13, 17]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["a.mcap", "b.mcap", "a.mcap"], "Expected one or two recordings, got 3."),
        (["a.mcap", "--web", "--save", "x.rrd"], "--save and --web exclude each other."),
        (["a.mcap", "--port", "80"], "--port goes with --web."),
        (["a.mcap", "--force"], "--force goes with --save."),
        (["a.mcap", "--focus", "9,x"], "expected building ids like 369,42, got '9,x'"),
        (["a.mcap", "--every", "0"], "0 is not in the range x>=1"),
        ([], "Missing argument 'LOG...'"),
    ],
)
def test_misuse_is_explained(logs, arguments: list[str], said: str):
    result = view(*arguments)
    assert result.exit_code == 2
    assert said in result.stderr


@pytest.mark.parametrize(
    ("arguments", "error", "said"),
    [
        (["a.mcap", "--save", "x.rrd", "--from", "50"], ViewError, "expected steps from 0 to 40, got steps 50 to 40"),
        (["a.mcap", "--save", "x.rrd", "--from", "9", "--to", "3"], ViewError, "got steps 9 to 3"),
        (["a.mcap", "--save", "x.rrd", "--focus", "1"], ViewError, "ids of buildings of city 'grid', got 1"),
        (["a.mcap", "--save", "nowhere/x.rrd"], OutputError, "expected an existing folder nowhere"),
    ],
)
def test_mistakes_are_one_sentence(
    logs, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], error: type[FireworldError], said: str
):
    monkeypatch.chdir(tmp_path)
    result = view(*arguments)
    assert isinstance(result.exception, error)
    assert said in str(result.exception)
    assert "\n" not in str(result.exception)
    assert list(tmp_path.iterdir()) == []


def test_web_and_window_get_what_they_are_told(logs, monkeypatch: pytest.MonkeyPatch):
    saved, served = [], []

    def serve(write, *, port, announce):
        write(Path("served"))
        served.append(port)

    monkeypatch.setattr(app, "save", lambda recordings, _, *, focus, **__: saved.append((len(recordings), focus)))
    monkeypatch.setattr(app, "show", lambda write: write(Path("shown")))
    monkeypatch.setattr(app, "serve", serve)
    assert view("a.mcap", "b.mcap").exit_code == 0
    assert view("a.mcap", "--web", "--port", "9191", "--focus", "100").exit_code == 0
    assert saved == [(2, ()), (1, (100,))]
    assert served == [9191]


def test_help_imports_nothing_heavy():
    program = """
import sys
from fireworld.cli import root
root.main(["view", "--help"], standalone_mode=False)
heavy = {"numpy", "numba", "rerun", "mcap", "matplotlib", "pyarrow", "viewer", "recorder"} & set(sys.modules)
assert not heavy, heavy
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0, done.stderr
    assert "Open one recording in Rerun" in done.stdout


@pytest.mark.slow
def test_saving_never_imports_the_simulator():
    program = """
import sys, tempfile
from pathlib import Path
from tests.viewer.conftest import make_recording
from fireworld_viewer.rerun_view import app
app.save([make_recording(3, 3, 2)], Path(tempfile.mkdtemp()) / "x.rrd")
assert "numba" not in sys.modules and "matplotlib" not in sys.modules
parts = {name.split(".")[1] for name in sys.modules if name.startswith("fireworld.")}
assert parts <= {"errors", "files", "outcome", "records", "version"}, parts
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0, done.stderr
