"""A user's modules beside policy and tests, whatever they are called, break nothing."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

pytestmark = pytest.mark.heavy

NAMES = (
    *("recorder", "viewer", "scenarios", "recordings", "cli", "run", "world", "testing", "errors", "files", "outcome"),
    *("records", "policy", "policies", "planning", "training", "evaluation", "simulation", "recording", "reproduction"),
    *("city", "kernels", "draws", "executors"),
)
"""Modules that a project with a simulator, a recorder and a viewer of its own may well have."""
MINE = '''
from fireworld.policy.protocol import Action, Decision

class Mine:
    """Nobody else's."""

    def decide(self, observation):
        return Decision(Action.NEAREST_TO_ME)
'''
TEST = """
def test_mine(recording):
    run = recording(scenario="quick", policy="mine:Mine", steps=5)
    assert len(run.column("score", "n_burnt_out")) == 6
"""


@pytest.fixture
def project(tmp_path):
    """A folder in which nothing but mine.py may be imported."""
    for name in NAMES:
        (tmp_path / f"{name}.py").write_text(f"raise AssertionError('{name}.py is of no concern to fireworld')\n")
    (tmp_path / "mine.py").write_text(MINE)
    (tmp_path / "test_mine.py").write_text(TEST)
    return tmp_path


@pytest.fixture
def call(project):
    """Call a module of Python as a process; its current folder comes first on the path of what is imported."""

    def run(*words: str) -> str:
        found = {**os.environ, "PYTHONPATH": str(project)}
        command = [sys.executable, "-m", *words]
        done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=project, env=found)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return run


def test_run_record_verify_and_view(call, project):
    outcome = json.loads(
        call(
            *("fireworld", "run", "quick", "--policy", "mine:Mine", "--steps", "5", "--json"),
            *("--record", "a.mcap", "--scene", "foxglove"),
        )
    )
    assert (outcome["policy"], outcome["steps"]) == ("mine:Mine", 5)
    assert outcome["digest"] in call("fireworld", "verify", "a.mcap")
    call("fireworld", "view", "a.mcap", "--save", "a.rrd")
    assert (project / "a.rrd").stat().st_size > 10_000
    call("fireworld", "report", "a.mcap", "-o", "a.html")
    call("fireworld", "play", "a.mcap", "-o", "p.html")
    call("fireworld", "fork", "a.mcap", "--at", "3", "--decide", "0=easiest", "--record", "b.mcap")


def test_the_pytest_plugin(call, project):
    call("pytest", "-q", "--fireworld-update")
    assert (project / "recordings" / "test_mine-test_mine.mcap").is_file()
    assert "1 passed" in call("pytest", "-q")
