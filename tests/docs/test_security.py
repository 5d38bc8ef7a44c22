"""What SECURITY.md promises: nothing is opened to the network, and no file of data runs code."""

from __future__ import annotations

import ast
import io
import os
import signal
import subprocess
import sys
import time
import zipfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from fireworld_viewer.rerun_view import app, live

import fireworld as fw
from fireworld.errors import FireworldError, LogError
from tests.docs.pages import ROOT
from tests.viewer.headless import CALL

PACKAGES = ("fireworld", "recorder/fireworld_recorder", "viewer/fireworld_viewer")
SERVERS = {"http.server", "socketserver", "xmlrpc.server", "asyncio", "wsgiref"}
UNSAFE = {"loads", "load", "Unpickler"}
LISTENING = "0A"
LOOPBACK = "0100007F"


def modules() -> Iterator[tuple[str, ast.Module]]:
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            yield path.relative_to(ROOT).as_posix(), ast.parse(path.read_text(encoding="utf-8"))


def calls(tree: ast.Module) -> Iterator[tuple[str, ast.Call]]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            yield ast.unparse(node.func), node


def imported(tree: ast.Module) -> set[str]:
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names.add(node.module or "")
    return names


def test_nothing_of_ours_serves_and_sockets_are_bound_to_this_machine():
    bound = []
    for name, tree in modules():
        assert not imported(tree) & SERVERS, name
        for function, call in calls(tree):
            if function.endswith(".bind") and "socket" in imported(tree):
                bound.append((name, ast.unparse(call.args[0])))
            assert not function.endswith((".listen", "serve_grpc", "serve_web", "serve_web_viewer")), name
    assert bound == [("viewer/fireworld_viewer/rerun_view/app.py", "(LOCALHOST, wanted)")]
    assert app.LOCALHOST == "127.0.0.1"


def test_every_viewer_is_started_on_this_machine_only(monkeypatch, tmp_path):
    """Those of --view, --view-url, `view` and `view --web`: Rerun itself would take all addresses."""
    started = []
    monkeypatch.setattr(live.app, "check_display", lambda *_: None)
    monkeypatch.setattr(live.socket, "create_connection", lambda *_, **__: io.BytesIO())
    started += [live.own_window().args[0], live.running_viewer("rerun+http://127.0.0.1:9876/proxy").args[0]]

    class Ended:
        def __init__(self, command, **_):
            started.append(command)

        def wait(self, timeout=None):
            return 0

        def terminate(self):
            return None

    monkeypatch.setattr(app.subprocess, "Popen", Ended)
    app.show(lambda path: path.write_bytes(b""))
    app.serve(lambda path: path.write_bytes(b""), port=app.free_port(), announce=lambda _: None)
    assert len(started) == 4
    for command in started:
        words = [str(word) for word in command]
        assert words[words.index("--bind") + 1] == "127.0.0.1", words


def sockets_of(process: int) -> set[str]:
    """Return the inodes of the sockets of a process and of its children."""
    found = set()
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            parent = int(folder.joinpath("stat").read_text().rpartition(")")[2].split()[1])
            if process in {int(folder.name), parent}:
                links = [os.readlink(path) for path in folder.joinpath("fd").iterdir()]  # noqa: PTH115 - no path
                found |= {link[8:-1] for link in links if link.startswith("socket:[")}
        except OSError:
            continue
    return found


@pytest.mark.heavy
@pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="this system does not list its sockets in /proc")
def test_view_web_listens_on_this_machine_only(tmp_path):
    log = tmp_path / "a.mcap"
    fw.run("quick", policy="chief", steps=3, record=log)
    command = [sys.executable, "-c", CALL, "view", str(log), "--web", "--port", str(app.free_port())]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        try:
            assert process.stdout is not None
            assert "http://127.0.0.1:" in process.stdout.readline()
            listening: list[str] = []
            tables_of = [path for path in (Path("/proc/net/tcp"), Path("/proc/net/tcp6")) if path.exists()]
            for _ in range(200):
                own = sockets_of(process.pid)
                tables = [line.split() for path in tables_of for line in path.read_text().splitlines()]
                listening = [row[1].partition(":")[0] for row in tables if row[3] == LISTENING and row[9] in own]
                if len(listening) >= 2:
                    break
                time.sleep(0.1)
            assert len(listening) >= 2, "the page and the data"
            assert set(listening) == {LOOPBACK}
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(timeout=30)


CACHE = "fireworld/kernels/cache.py"
"""What it reads is machine code anyway, which fireworld itself has written."""
RECEIVING = "fireworld/executors/receiving.py"
"""What a worker reads comes from the client that it works for, which sends it code to run anyway."""


def test_no_pickle_is_read_anywhere():
    seen = set()
    for name, tree in modules():
        if name in {CACHE, RECEIVING}:
            continue
        for function, call in calls(tree):
            last = function.rpartition(".")[2]
            keywords = {word.arg: ast.unparse(word.value) for word in call.keywords}
            assert keywords.get("allow_pickle", "False") == "False", name
            if last in {"read_array", "write_array"} or function == "np.savez":
                seen.add(name)
                assert function == "np.savez" or "allow_pickle" in keywords, f"{name}: {function}"
            assert not (function.split(".")[0] in {"pickle", "marshal", "shelve", "dill"} and last in UNSAFE), name
            assert function not in {"yaml.unsafe_load", "yaml.full_load"}, f"{name}: {function}"
            if function in {"eval", "exec"}:  # nothing that comes from a file
                assert all(isinstance(argument, ast.Constant) for argument in call.args), f"{name}: {function}"
    assert "fireworld/policy/teams/npz.py" in seen


class Program:
    """Runs when it is unpickled."""

    def __reduce__(self):
        return os.mkdir, ("ran",)


def hostile_npz() -> bytes:
    """Return an archive that holds what a team file, a trace and a snapshot hold, with a pickled program in each."""
    array, data = io.BytesIO(), io.BytesIO()
    np.lib.format.write_array(array, np.array([Program()], dtype=object), allow_pickle=True)
    with zipfile.ZipFile(data, "w") as archive:
        for name in ("header", "head", "params", "q", "values", "visits"):
            archive.writestr(f"{name}.npy", array.getvalue())
    return data.getvalue()


def test_a_team_file_with_a_program_in_it_runs_nothing(here, fireworld):
    (here / "team.npz").write_bytes(hostile_npz())
    for words in (
        ("run", "quick", "--policy", "team.npz"),
        ("policy", "show", "team.npz"),
        ("conformance", "team.npz"),
    ):
        done = fireworld(*words)
        assert done.code == 2, words
    with pytest.raises(FireworldError):
        fw.load_team("team.npz")
    with pytest.raises(LogError):
        fw.world("quick").restore(hostile_npz())
    assert not (here / "ran").exists()


def test_a_scenario_with_a_program_in_it_runs_nothing(here, fireworld):
    (here / "s.yaml").write_text("preset: !!python/object/apply:os.mkdir [ran]\n")
    done = fireworld("run", "s.yaml")
    assert (done.code, done.out) == (2, "")
    with pytest.raises(FireworldError):
        fw.run("s.yaml")
    assert not (here / "ran").exists()
