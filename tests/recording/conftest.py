"""Recorded runs to fork and to explain, and the command line in the folder where they are."""

from __future__ import annotations

import json
import signal
import sys

import pytest
from fireworld_recorder.reader import open_log
from fireworld_recorder.writer import LogWriter

from fireworld.scenario import load_scenario
from fireworld.simulation.placement import scenario_plan
from tests import command_line
from tests.city.plans import dump_plan

STEPS = 60
POLICIES = '''
"""A policy with a memory: it counts how often it was asked. And one that names targets of its own."""
from fireworld.policy.protocol import Action, Decision

class Counting:
    def begin(self, city, n_brigades, seed):
        self.asked = 0
    def decide(self, observation):
        self.asked += 1
        return Decision(self.asked // 3 % 4)

class Own:
    def decide(self, observation):
        here = observation.burning
        return Decision(Action.OWN_TARGET, target=int(here[-1 if observation.step % 5 else 0]))
'''


def take_folder(folder, monkeypatch):
    """Work in a folder that holds own_policies.py."""
    (folder / "own_policies.py").write_text(POLICIES)
    monkeypatch.chdir(folder)
    monkeypatch.setattr(sys, "path", sys.path.copy())
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    monkeypatch.delitem(sys.modules, "own_policies", raising=False)


@pytest.fixture(scope="session")
def recordings(tmp_path_factory):
    """Runs of `quick`, 60 steps, seed 1, by policy; "other-seed" and "other-scenario" besides."""
    folder = tmp_path_factory.mktemp("recordings")
    made = {name: ("--policy", name) for name in ("easiest", "nearest-to-me", "chief", "random")}
    made["counting"] = ("--policy", "own_policies:Counting")
    made["own"] = ("--policy", "own_policies:Own")
    made["other-seed"] = ("--policy", "easiest", "--seed", "2")
    made["other-scenario"] = ("--policy", "easiest", "--set", "fires.0.n_buildings=1")
    made["stopped"] = ("--policy", "easiest", "--steps", str(STEPS))
    with pytest.MonkeyPatch.context() as monkeypatch:
        take_folder(folder, monkeypatch)
        for name, words in made.items():
            steps = () if "--steps" in words else ("--steps", STEPS)
            done = command_line.call(monkeypatch, "run", "quick", *steps, "--record", f"{name}.mcap", *words)
            assert done.code == 0, done.err
    sys.modules.pop("own_policies", None)
    log = open_log(folder / "stopped.mcap")
    write_log(folder / "stopped.mcap", log, list(log)[:21], force=True)
    return folder


def write_log(path, log, records, *, force=False):
    """Write records to a log with another's header."""
    header, city = log.header, log.city
    with LogWriter(path, header, city, force=force) as writer:
        for record in records:
            writer.write(record)


@pytest.fixture(scope="session")
def two_fires(recordings):
    """A run in a town whose buildings have ids 100 above their places, with a fire in two of its corners."""
    plan = dump_plan(scenario_plan(load_scenario("quick")))
    buildings = [building | {"id": building["id"] + 100} for building in plan["buildings"]]
    (recordings / "town.json").write_text(json.dumps({"buildings": buildings}))
    (recordings / "town.yaml").write_text(
        "preset: paper\ncity: {file: town.json}\nbrigades: {n: 2}\nsteps: 12\n"
        "fires: [{buildings: [101, 102, 103, 112]}, {buildings: [167, 176, 177, 178]}]\n"
    )
    with pytest.MonkeyPatch.context() as monkeypatch:
        take_folder(recordings, monkeypatch)
        words = ("run", "town.yaml", "--policy", "easiest", "--record", "two-fires.mcap")
        done = command_line.call(monkeypatch, *words)
    assert done.code == 0, done.err
    return recordings / "two-fires.mcap"


@pytest.fixture
def here(here, recordings, two_fires):
    """The current folder, with own_policies.py and the recordings in it."""
    (here / "own_policies.py").write_text(POLICIES)
    for path in (*recordings.glob("*.mcap"), *recordings.glob("town.*")):
        (here / path.name).symlink_to(path)
    return here


@pytest.fixture
def answer(fireworld):
    """Call the command line and return the JSON it writes."""

    def call(*words):
        done = fireworld(*words, "--json")
        assert done.code == 0, done.err
        return json.loads(done.out)

    return call


@pytest.fixture
def interruptible(monkeypatch):
    """Let Ctrl-C mean in this process what it means at a terminal."""
    monkeypatch.setattr(signal, "getsignal", lambda _: signal.default_int_handler)
