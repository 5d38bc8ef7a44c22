"""Logs from pipes: every command that reads a log takes what comes from one, once, wherever it stands."""

from __future__ import annotations

import os
import threading

import pytest

import fireworld as fw


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    """The log of a run and of a training, by what they are of."""
    folder = tmp_path_factory.mktemp("logs")
    run, training = folder / "run.mcap", folder / "training.mcap"
    fw.run("quick", policy="chief", steps=6, record=run)
    fw.train("paper", set={"n_episodes_max": 3}, output=folder / "team.npz", record=training)
    return {"run": run, "training": training}


@pytest.fixture
def piped(tmp_path):
    """Make a pipe from which a file comes once."""
    threads = []

    def pipe(source):
        path = tmp_path / f"pipe-{len(threads)}"
        os.mkfifo(path)
        threads.append(threading.Thread(target=lambda: path.write_bytes(source.read_bytes()), daemon=True))
        threads[-1].start()
        return path

    yield pipe
    for thread in threads:
        thread.join(timeout=10)
        assert not thread.is_alive(), "a pipe was not read"


@pytest.mark.parametrize("kind", ["run", "training"])
@pytest.mark.parametrize(
    "command",
    [
        ("info", "LOG", "--json"),
        ("info", "LOG", "--schema"),
        ("verify", "LOG"),
        ("diff", "LOG", "FILE"),
        ("diff", "FILE", "LOG"),
        ("diff", "LOG", "LOG"),
        ("export", "LOG", "--parquet", "tables"),
        ("recover", "LOG", "-o", "copy.mcap"),
        ("report", "LOG", "-o", "report.html"),
        ("report", "LOG", "LOG", "-o", "report.html"),
        ("render", "LOG", "-o", "still.png"),
        ("view", "LOG", "--save", "run.rrd"),
    ],
    ids=" ".join,
)
def test_commands_take_logs_from_pipes(fireworld, here, logs, piped, kind, command):
    log = logs[kind]
    done = fireworld(*(piped(log) if word == "LOG" else log if word == "FILE" else word for word in command))
    assert done.code == 0, done


def test_a_training_from_a_pipe_is_no_run_to_fork(fireworld, logs, piped):
    done = fireworld("fork", piped(logs["training"]), "--at", 1, "--policy", "planner")
    assert done.code == 2
    assert "training" in done.err


def test_library_takes_pipes(logs, piped):
    assert fw.diff(piped(logs["run"]), logs["run"]).same
    assert fw.verify(piped(logs["training"])).same
