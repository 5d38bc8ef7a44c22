"""A folder with a policy in it, and the command line in this process."""

from __future__ import annotations

import os
import sys
from functools import partial
from pathlib import Path

import pytest

from fireworld.recording.golden.spec import GoldenSpec, prepare_golden
from fireworld.recording.record import run_prepared
from tests import command_line

CACHE = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
PLAIN = "-p no:cacheprovider -p no:hypothesispytest"
"""Without plugins that are not at issue and take their time."""
POLICY = """
from fireworld.policy.protocol import Action, Decision

class Policy:
    def decide(self, observation):
        return Decision(Action.NEAREST_TO_ME)
"""


@pytest.fixture
def here(empty_folder):
    """The current folder, with mine.py in it."""
    (empty_folder / "mine.py").write_text(POLICY)
    return empty_folder


@pytest.fixture
def write_policy(here):
    """Write another mine.py."""

    def write(text: str) -> None:
        (here / "mine.py").write_text(text)
        sys.modules.pop("mine", None)

    return write


@pytest.fixture
def change_policy(write_policy):
    """Let the policy of mine.py choose another action."""
    return lambda action: write_policy(POLICY.replace("NEAREST_TO_ME", action))


@pytest.fixture
def golden(monkeypatch):
    """Call `fireworld golden` in this process."""
    monkeypatch.setenv("COLUMNS", "140")
    return partial(command_line.call, monkeypatch, "golden")


@pytest.fixture(scope="session")
def _warm():
    """Let numba import all it needs: what is first imported within a test's own pytest is forgotten after it."""
    run_prepared(prepare_golden(GoldenSpec(scenario="quick", policy="random", steps=2), Path()))


@pytest.fixture
def project(_warm, pytester, monkeypatch):
    """A folder with a policy, in which a pytest of its own runs in this process."""
    monkeypatch.setenv("XDG_CACHE_HOME", CACHE)  # pytester moves the home folder, where compiled kernels are kept
    monkeypatch.setenv("PYTEST_ADDOPTS", PLAIN)
    for name in ("mine", "my_policy"):
        monkeypatch.delitem(sys.modules, name, raising=False)  # another test's policy of that name
    pytester.makepyfile(mine=POLICY)
    pytester.syspathinsert()
    return pytester
