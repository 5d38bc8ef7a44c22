"""A live view shows what happens and changes nothing: not the run, not its length, not its end."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from functools import partial
from pathlib import Path
from threading import Event

import numpy as np
import pytest
from fireworld_viewer.rerun_view import app, live
from fireworld_viewer.rerun_view.live import BackgroundSender

from fireworld.errors import ViewError
from fireworld.policy.teams.ranking_words import OF_BRIGADE, OF_BUILDING, OF_TEAM, WEIGHTS
from fireworld.policy.teams.team import load_team
from tests.training.conftest import SHORT_WORDS, TINY
from tests.viewer import rrd

SHORT = ("run", "quick", "--steps", 9, "--json")
TRAIN = ("train", "tiny.yaml", *SHORT_WORDS, "--stages", "alone", "-o")
DYING = (sys.executable, "-S", "-c", "import os; os.read(0, 1)")
NOTE = "view: the viewer is closed; the run continues without it\n"


@pytest.fixture
def window(monkeypatch, tmp_path):
    """Instead of a window: Rerun's own program, which writes what it is fed to a file."""
    path = tmp_path / "seen.rrd"
    monkeypatch.setattr(live, "own_window", lambda: to_file(path))
    return path


def to_file(path: Path) -> live.Screen:
    return partial(live.ViewerProcess, (str(app.viewer_executable()), "-", "--save", str(path)), stays=False)


class Pipe:
    """A pipe of the tests: it takes everything, or nothing before it is let go, or is broken."""

    def __init__(self, *, blocked: bool = False, broken: bool = False) -> None:
        self.content = b""
        self.go = Event()
        self.broken = broken
        self.finished: bool | None = None
        if not blocked:
            self.go.set()

    def write(self, content: bytes) -> int:
        self.go.wait()
        if self.broken:
            raise BrokenPipeError
        piece = content[:3]
        self.content += piece
        return len(piece)

    def close(self, *, finished: bool) -> bool:
        self.finished = finished
        return finished


def send(pipe: Pipe, items, **changes) -> tuple[BackgroundSender[int], list[str]]:
    told: list[str] = []
    words = {"n_waiting_max": 100, "warn": told.append} | changes
    sender: BackgroundSender[int] = BackgroundSender(
        lambda batch: "".join(f"{one} " for one in batch).encode(), pipe, **words
    )
    for item in items:
        sender.put(item)
    return sender, told


def test_everything_is_sent_in_order():
    pipe = Pipe()
    sender, told = send(pipe, range(50))
    sender.close()
    assert pipe.content.decode().split() == [str(number) for number in range(50)]
    assert (pipe.finished, told) == (True, [])


def test_who_hands_over_never_waits_and_a_slow_viewer_misses_some_evenly():
    pipe = Pipe(blocked=True)
    sender, told = send(pipe, range(10_000))  # would never end if it waited
    pipe.go.set()
    sender.close()
    seen = [int(number) for number in pipe.content.decode().split()]
    assert seen == sorted(seen)
    assert seen[-1] == 9999
    assert len(seen) == 10_000 - sender.n_left_out < 300
    assert told == [f"view: the viewer is slower than the run; {sender.n_left_out} steps are left out in it"]


def test_a_closed_viewer_is_told_of_once():
    pipe = Pipe(broken=True)
    sender, told = send(pipe, range(5))
    sender._thread.join()
    for item in range(5):
        sender.put(item)
    sender.close()
    assert told == [NOTE.strip()]
    assert sender._waiting == []


def test_a_viewer_that_hangs_does_not_keep_the_end(monkeypatch):
    monkeypatch.setattr(live, "PATIENCE_SECONDS", 0.02)
    pipe = Pipe(blocked=True)
    sender, told = send(pipe, range(5))
    sender.close()
    assert pipe.finished is False
    assert told == ["view: the viewer did not take the last of it"]
    pipe.go.set()
    sender._thread.join()
    assert len(told) == 1


def failing_encoder(batch) -> bytes:
    raise ZeroDivisionError("division by zero")


def test_a_mistake_in_the_view_does_not_stop_the_run():
    told: list[str] = []
    sender: BackgroundSender[int] = BackgroundSender(failing_encoder, Pipe(), n_waiting_max=10, warn=told.append)
    sender.put(1)
    sender.close()
    assert told == ["view: ZeroDivisionError: division by zero; the run continues without it"]


def test_step_by_step_shows_what_a_recording_shows(small, tmp_path: Path):
    app.save([small], tmp_path / "whole.rrd")
    encoder = live.RunEncoder(small.header, small.city)
    records = list(small)
    content = b"".join(encoder.encode(batch) for batch in ([records[0]], [records[1]], records[2:7], records[7:]))
    pipe = to_file(tmp_path / "live.rrd")()
    while content:
        content = content[pipe.write(content) :]
    pipe.close(finished=True)
    whole, seen = rrd.read(tmp_path / "whole.rrd"), rrd.read(tmp_path / "live.rrd")
    steps = small.steps.tolist()
    for path, component in (
        ("/city/buildings", "Mesh3D:albedo_texture_buffer"),
        ("/city/handles", "Building:temperature"),
        ("/team/brigades", "Points3D:positions"),
        ("/civilians", "Points3D:colors"),
        ("/plots/score", "Scalars:scalars"),
    ):
        shown = rrd.at_every_step(seen[path][component], steps)
        assert np.array_equal(np.array(shown), np.array(rrd.at_every_step(whole[path][component], steps))), path
    texts = [[(step, row.as_py()) for step, row in one["/log/events"]["TextLog:text"]] for one in (seen, whole)]
    assert texts[0] == texts[1] != []


def test_a_watched_run_is_the_same_run(here, fireworld, window):
    alone = json.loads(fireworld(*SHORT, "--record", "alone.mcap").out)
    done = fireworld(*SHORT, "--record", "seen.mcap", "--view")
    assert (done.code, done.err) == (0, "")
    assert json.loads(done.out) == alone | {"recording": "seen.mcap"}
    assert (here / "seen.mcap").read_bytes() == (here / "alone.mcap").read_bytes()
    assert json.loads(fireworld(*SHORT, "--view").out)["digest"] == alone["digest"]
    seen = rrd.read(window)
    assert {step for step, _ in seen["/air/heat"]["GridMap:data"]} == {0}
    scores = seen["/plots/score"]["Scalars:scalars"]
    assert sorted(step for step, _ in scores) == sorted([*range(10)])


def test_a_viewer_closed_in_mid_run(here, fireworld, monkeypatch):
    alone = json.loads(fireworld(*SHORT).out)
    monkeypatch.setattr(live, "own_window", lambda: partial(live.ViewerProcess, DYING, stays=True))
    done = fireworld(*SHORT, "--view", "--record", "a.mcap")
    assert (done.code, done.err) == (0, NOTE)
    assert json.loads(done.out)["digest"] == alone["digest"]
    assert fireworld("verify", "a.mcap").code == 0


KILLER = """
import os, signal
from fireworld.policy.protocol import Action, Decision
class Killer:
    def decide(self, observation):
        if (observation.step, observation.brigade) == (5, 0):
            os.kill(int(os.environ["SERVER"]), signal.SIGKILL)
        return Decision(Action.NEAREST_TO_ME)
"""


def test_a_server_that_dies_in_mid_run(here, fireworld, monkeypatch):
    (here / "killing.py").write_text(KILLER)
    port = app.free_port()
    words = [str(app.viewer_executable()), "--serve-grpc", "--bind", app.LOCALHOST, "--port", str(port)]
    with subprocess.Popen(words, env=app.viewer_environment(os.environ), stderr=subprocess.DEVNULL) as server:
        try:
            url = f"rerun+http://{app.LOCALHOST}:{port}/proxy"
            until_it_listens(url)
            monkeypatch.setenv("SERVER", str(server.pid))
            monkeypatch.setattr(live, "PATIENCE_SECONDS", 0.5)
            done = fireworld(*SHORT, "--policy", "killing:Killer", "--view-url", url)
            assert server.wait() == -signal.SIGKILL
        finally:
            server.kill()
    assert done.code == 0
    assert done.err in {"", NOTE, "view: the viewer did not take the last of it\n"}  # by what was on its way just then
    assert json.loads(done.out)["steps"] == 9


def until_it_listens(url: str) -> None:
    for _ in range(200):
        try:
            live.running_viewer(url)
        except ViewError:
            Event().wait(0.05)
        else:
            return
    raise AssertionError(url)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--view",), "fireworld: --view: no display here; try --view-url of a viewer that runs, or "),
        (("--view-url", "http://127.0.0.1:1/x"), "fireworld: --view-url: expected an address of this machine like "),
        (("--view-url", "rerun+http://127.0.0.1:x/proxy"), "expected an address of this machine like "),
        (("--view-url", "rerun+http://example.org:9876/proxy"), "tunnel to another machine with ssh -L"),
        (
            ("--view-url", "rerun+http://127.0.0.1:1/proxy"),
            "expected a viewer that listens, got 'rerun+http://127.0.0.1:1/",
        ),
    ],
)
@pytest.mark.parametrize("command", [("run", "quick", "--record", "a.mcap"), ("train", "-o", "a.npz")])
def test_no_view_no_run(here, fireworld, monkeypatch, command, words, message):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    done = fireworld(*command, *words)
    assert (done.code, done.out, done.err.count("\n")) == (2, "", 1)
    assert message in done.err
    assert [path.name for path in here.iterdir() if path.suffix != ".py"] == []


def test_without_rerun(here, fireworld, monkeypatch):
    monkeypatch.setitem(sys.modules, "rerun", None)
    done = fireworld(*SHORT, "--view")
    assert done.code == 2
    assert done.err == "fireworld: view: Rerun is not installed; try pip install 'fireworld[view]'\n"


@pytest.mark.parametrize("words", [("run", "quick"), ("train", "-o", "a.npz")])
def test_both_at_once(here, fireworld, words):
    done = fireworld(*words, "--view", "--view-url", "rerun+http://127.0.0.1:9876/proxy")
    assert done.code == 2
    assert "--view and --view-url exclude each other." in done.err


def test_a_watched_training_is_the_same_training(here, fireworld, window):
    (here / "tiny.yaml").write_text(TINY)
    assert fireworld(*TRAIN, "alone.npz").code == 0
    done = fireworld(*TRAIN, "seen.npz", "--log", "seen.csv", "--view")
    assert (done.code, "view" in done.err) == (0, False)
    assert (here / "seen.npz").read_bytes() == (here / "alone.npz").read_bytes()
    lines = [line.split(",") for line in (here / "seen.csv").read_text().splitlines()]
    column = lines[0].index("total_reward")
    seen = rrd.read_all(window)
    returns = [row.as_py()[0] for _, row in seen["/return/seed\\ 1"]["Scalars:scalars"]]
    assert returns == [float(line[column]) for line in lines[1:]]
    notes = [row.as_py()[0] for _, row in seen["/log"]["TextLog:text"]]
    assert [note.split(": ")[1] for note in notes] == ["alone-1", "alone-2"]
    bands = seen["/bands/seed\\ 1"]["StateChange:state"]
    scenarios = [line[lines[0].index("scenario")] for line in lines[1:]]
    assert [(number, row.as_py()[0]) for number, row in bands] == [
        (0, "alone-1"),
        (scenarios.index("alone-2"), "alone-2"),
    ]
    marked = [number for path in seen if path.startswith("/return/") for number, _ in seen[path]["Scalars:scalars"]]
    assert sorted(marked) == sorted([*range(len(scenarios)), scenarios.index("alone-2") - 1, len(scenarios) - 1])
    assert len(seen["/city/buildings"]["Mesh3D:vertex_positions"]) == 1  # one stage, one fire
    assert seen["/plots/score"]["Scalars:scalars"]


SEARCH_FIGURES = ("n_generations=3", "n_candidates=4", "n_best=2", "n_fires=2", "n_steps_max=10")
SEARCH = ("train", "tiny.yaml", "--method", "search", *(word for one in SEARCH_FIGURES for word in ("--set", one)))


def test_a_watched_search_is_the_same_search(here, fireworld, window):
    (here / "tiny.yaml").write_text(TINY)
    alone = fireworld(*SEARCH, "-o", "alone.npz")
    assert alone.code == 0
    done = fireworld(*SEARCH, "-o", "seen.npz", "--view")
    assert (done.code, done.err) == (0, alone.err)
    assert (here / "seen.npz").read_bytes() == (here / "alone.npz").read_bytes()
    seen = rrd.read_all(window)
    told = [line.split(", ") for line in alone.err.splitlines()]
    assert len(told) == 3
    for path, words, digits in (
        ("/score/seed\\ 1\\,\\ all", [line[1].removeprefix("score ") for line in told], 3),
        ("/score/seed\\ 1\\,\\ the\\ best", [line[2].removeprefix("of the best ") for line in told], 3),
        ("/spread/seed\\ 1", [line[3].removeprefix("spread ") for line in told], 2),
    ):
        drawn = seen[path]["Scalars:scalars"]
        assert [f"{row.as_py()[0]:.{digits}f}" for _, row in drawn] == words, path
        assert [number for number, _ in drawn] == [0, 1, 2], path
    team = load_team(here / "seen.npz")
    names = [*OF_BUILDING, *OF_BRIGADE, *OF_TEAM]
    assert weights_drawn(seen) == dict(zip((one.name for one in names), team.weights[0], strict=False))
    pages = [row.as_py()[0] for _, row in seen["/page/0"]["TextDocument:text"]]
    assert [page.splitlines()[0] for page in pages] == [f"# Generation {k} of 3" for k in (1, 2, 3)]
    assert all(f"* {sentence}\n" in pages[-1] for sentence in team.sentences(row=0))
    assert all(f"* **{one.name}**: {one.meaning}\n" in pages[-1] for one in names)


def weights_drawn(seen: dict[str, rrd.Rows], *, team: int = 0) -> dict[str, float]:
    """The last point of every curve of weights of a search, by the name of the curve."""
    drawn = {path: rows for path, rows in seen.items() if path.startswith(f"/own/{team}/weights/")}
    lasts = {path: rows["Scalars:scalars"][-1] for path, rows in drawn.items()}
    assert {number for number, _ in lasts.values()} == {2}
    return {drawn[path]["SeriesLines:names"][0][1].as_py()[0]: row.as_py()[0] for path, (_, row) in lasts.items()}


def test_only_weights_that_are_searched_for_are_drawn(here, fireworld, window):
    (here / "tiny.yaml").write_text(TINY)
    words = ("--set", "cooperation=false", "--set", "own_targets=false", "--repetitions", 2)
    assert fireworld(*SEARCH, *words, "-o", "seen.npz", "--view").code == 0
    seen = rrd.read_all(window)
    for seed in (1, 2):
        weights = load_team(here / f"seen-{seed}.npz").weights[0]
        names = [weight.name for weight in WEIGHTS]
        free = dict(zip(names, weights, strict=True))
        for one in OF_TEAM:
            assert free.pop(one.name) == 0
        assert weights_drawn(seen, team=seed - 1) == free
        last = seen[f"/page/{seed - 1}"]["TextDocument:text"][-1][1].as_py()[0]
        assert ("**nearest-to-me**" in last, "**others_here**" in last) == (True, False)


def test_a_viewer_closed_in_mid_search(here, fireworld, monkeypatch):
    (here / "tiny.yaml").write_text(TINY)
    assert fireworld(*SEARCH, "-o", "alone.npz").code == 0
    monkeypatch.setattr(live, "own_window", lambda: partial(live.ViewerProcess, DYING, stays=True))
    done = fireworld(*SEARCH, "-o", "seen.npz", "--view")
    assert (done.code, NOTE in done.err) == (0, True)
    assert (here / "seen.npz").read_bytes() == (here / "alone.npz").read_bytes()
