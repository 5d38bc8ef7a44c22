"""A recording process is killed at random moments: what it was told is safe is there, and nothing that is not."""

import json
import subprocess
import sys

import pytest
from fireworld_recorder.diff import compare
from fireworld_recorder.reader import open_log
from fireworld_recorder.recover import recover

from fireworld.errors import LogError
from fireworld.recording.replay import Replay
from tests.docs.pages import ROOT
from tests.faults.nursery import N_STEPS

pytestmark = pytest.mark.slow


def kill(kind, n, folder):
    """Kill n children; return what became of each."""
    command = [sys.executable, "-m", "tests.faults.nursery", kind, str(n), str(folder)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


def steps_of(log):
    return [[(topic, bytes(payload)) for topic, payload in raw] for raw in log.raw_steps()]


def check(path, n_safe, whole):
    """Compare what a killed process left with the whole run; return how many steps were rescued, -1 for no log."""
    partial = path.with_name(path.name + ".partial")
    if path.exists():
        assert not partial.exists() or partial.samefile(path), "killed while the file had both of its names"
        assert path.read_bytes() == (path.parent / "whole.mcap").read_bytes()
        return len(whole)
    if not partial.exists():
        assert n_safe == 0
        return -1
    try:
        log = open_log(partial, partial=True)
    except LogError:  # killed before the header and the city were there
        assert n_safe == 0
        return -1
    assert n_safe <= len(log) <= n_safe + 1
    assert log.state == "partial" or len(log) == len(whole)
    assert steps_of(log) == whole[: len(log)]
    if len(log):
        assert recover(partial, path).digest == log.digest
        assert open_log(path).digest == log.digest
    return len(log)


@pytest.mark.parametrize(("kind", "n", "n_verified"), [("writer", 60, 0), ("run", 12, 2)])
def test_a_kill_at_a_random_moment_loses_nothing_that_was_safe(tmp_path, kind, n, n_verified):
    children = kill(kind, n, tmp_path)
    whole = steps_of(open_log(tmp_path / "whole.mcap"))
    assert len(whole) == N_STEPS[kind] + 1
    rescued = [check(tmp_path / child["name"], child["n_safe"], whole) for child in children]
    assert sum(child["killed"] for child in children) > n * 0.8
    assert len(set(rescued)) > n // 4, "the kills fell into many different steps"
    for child in [child for child, n in zip(children, rescued, strict=True) if 0 < n < len(whole)][:n_verified]:
        log = open_log(tmp_path / child["name"])
        assert compare(log, Replay(log)).same
