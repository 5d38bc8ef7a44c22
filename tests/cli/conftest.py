"""Calling the command line, within this process and as one of its own."""

from __future__ import annotations

import signal
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest

from tests import command_line
from tests.command_line import Done

POLICIES = '''
"""Policies of the tests: some of them go wrong in step 5."""
import os
import signal
import time
from fireworld.policy.protocol import Action, Decision

class Near:
    """Without a fault."""
    def decide(self, observation):
        if observation.step == 5 and observation.brigade == 1:
            self.at_step_5()
        return Decision(Action.NEAREST_TO_ME)
    def at_step_5(self):
        pass

class Values(Near):
    """Also says why."""
    def decide(self, observation):
        return Decision(observation.step % 4, q_values=(0.5, 1.5, 2.5, observation.step), explored=True, epsilon=0.25)

class Failing(Near):
    def at_step_5(self):
        raise RuntimeError("lost the\\nthread")

class Wrong(Near):
    def decide(self, observation):
        return Decision(7) if observation.step == 5 else Decision(0)

class NeverReady(Near):
    def begin(self, city, n_brigades, seed):
        raise RuntimeError("no model")

class Interrupted(Near):
    def at_step_5(self):
        signal.raise_signal(signal.SIGINT)

class InterruptedTwice(Near):
    def at_step_5(self):
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)

class Killed(Near):
    def at_step_5(self):
        os.kill(os.getpid(), signal.SIGKILL)
'''


@pytest.fixture
def here(tmp_path, monkeypatch):
    """The current folder, empty but for policies.py; what is imported from it is forgotten again."""
    (tmp_path / "policies.py").write_text(POLICIES)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", sys.path.copy())
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    monkeypatch.delitem(sys.modules, "policies", raising=False)
    yield tmp_path
    sys.modules.pop("policies", None)


@pytest.fixture
def fireworld(monkeypatch):
    """Call the command line in this process."""
    monkeypatch.setenv("COLUMNS", "120")

    return partial(command_line.call, monkeypatch)


@pytest.fixture
def fireworld_process():
    """Call the command line as a process of its own, to which Ctrl-C means what it means at a terminal."""

    def call(*words: object) -> Done:
        done = subprocess.run(
            [sys.executable, "-c", "from fireworld.cli import main; main()", *map(str, words)],
            capture_output=True,
            text=True,
            check=False,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        )
        return Done(done.returncode, done.stdout, done.stderr)

    return call


@pytest.fixture
def files(here):
    """The files in the current folder besides the policies, by name."""

    def names() -> list[str]:
        return sorted(path.name for path in Path(here).iterdir() if path.suffix != ".py" and path.is_file())

    return names
