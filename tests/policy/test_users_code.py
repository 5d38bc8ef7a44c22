"""What users' code can do to a world, to other runs and to the output: nothing."""

import json
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

from fireworld.errors import PolicyError
from fireworld.evaluation.runs import evaluate, run_step_by_step
from fireworld.policy.asking import PRINTS_ASIDE, read_only
from fireworld.policy.names import find_policy
from fireworld.policy.protocol import Decision
from fireworld.scenario import load_scenario
from fireworld.simulation.built import build_scenario

SHORT = {"steps": 12}


@pytest.fixture(scope="module")
def built():
    return build_scenario(load_scenario("quick").with_values(SHORT))


class Writes:
    def decide(self, observation):
        observation.world.fire.energy[:] = 0.0
        return Decision(0)


class Scales:
    def begin(self, city, n_brigades, seed):
        city.buildings.capacity[:] -= city.buildings.capacity.mean()

    def decide(self, observation):
        return Decision(0)


class Cheats:
    """Goes behind the views that it is given."""

    def decide(self, observation):
        energy = observation.world.fire.energy
        energy.base[:] = 0.0
        return Decision(0)


class CheatsWithTheCity:
    def decide(self, observation):
        observation.city.buildings.capacity.base[0] *= 1.5
        return Decision(0)


@pytest.mark.parametrize("policy", [Writes(), Scales()])
def test_what_it_sees_cannot_be_written(built, policy):
    with pytest.raises(PolicyError, match=r"read-only .*; the world it sees cannot be changed, only copies of it$"):
        run_step_by_step(built, policy, seed=1)


def test_what_is_changed_all_the_same_is_found_by_its_decisions_alone(built):
    with pytest.raises(PolicyError, match="expected decisions that lead to its outcome by themselves"):
        run_step_by_step(built, Cheats(), seed=1)


def test_a_changed_city_is_found():
    own = build_scenario(load_scenario("quick").with_values(SHORT))
    with pytest.raises(PolicyError, match="got a world that it has changed"):
        run_step_by_step(own, CheatsWithTheCity(), seed=1)


def test_a_policy_of_a_user_may_ask_ours(built):
    chief = find_policy("chief").policy

    class Follows:
        def begin(self, city, n_brigades, seed):
            chief.begin(city, n_brigades, seed)

        def decide(self, observation):
            return chief.decide(observation)

    found = run_step_by_step(built, Follows(), seed=3)
    assert found.score == evaluate(built, find_policy("chief").policy, [3]).score[0]


def test_views_are_of_the_same_memory_and_cannot_be_written(built):
    city = read_only(built.city_arrays)
    assert type(city) is type(built.city_arrays)
    assert np.shares_memory(city.buildings.capacity, built.city_arrays.buildings.capacity)
    assert not city.buildings.capacity.flags.writeable
    assert built.city_arrays.buildings.capacity.flags.writeable


def test_prints_go_to_the_error_stream(capsys):
    with PRINTS_ASIDE, PRINTS_ASIDE:
        sys.stdout.write("aside\n")
    sys.stdout.write("out\n")
    assert capsys.readouterr() == ("out\n", "aside\n")
    before = sys.stdout
    with pytest.raises(ValueError, match="x"), PRINTS_ASIDE:
        raise ValueError("x")
    assert sys.stdout is before


def test_the_digest_covers_what_was_brought_in(here, fireworld):
    (here / "helpers_of_mine.py").write_text("CHOICE = 0\n")
    (here / "brought.py").write_text(
        "from helpers_of_mine import CHOICE\nimport helpers_of_mine\nimport numpy\n\n\n"
        "class P:\n    def decide(self, observation):\n        return CHOICE\n"
    )
    words = ("run", "quick", "--policy", "brought:P", "--steps", 2, "--record")
    assert fireworld(*words, "a.mcap").code == 0
    first = find_policy("brought:P").digest
    for name in ("brought", "helpers_of_mine"):
        del sys.modules[name]
    (here / "helpers_of_mine.py").write_text("CHOICE = 3\n")
    assert find_policy("brought:P").digest != first
    header = json.loads(fireworld("info", "a.mcap", "--json").out)["header"]
    assert header["policy_digest"] == first


ODD = """
import os
import sys
import threading
from pathlib import Path
import threading


class Good:
    def decide(self, observation):
        return 0


class DigestExits(Good):
    @property
    def digest(self):
        sys.exit(0)


class Async:
    async def decide(self, observation):
        return 0


class Moves(Good):
    def begin(self, city, n_brigades, seed):
        os.chdir("/")


class Ignored(Good):
    def decide(self, observation):
        if observation.step == 1 and observation.brigade == 0:
            thread = threading.Thread(target=lambda: 1 // 0)
            thread.start()
            thread.join()
        return 0
"""


@pytest.fixture
def odd(here):
    (here / "odd.py").write_text(ODD)
    return here


def test_a_digest_that_exits_turns_no_gate_green(odd, fireworld):
    done = fireworld("compare", "chief", "odd.py:DigestExits", "--scenarios", "quick", "--seeds", 1, "--gate")
    assert (done.code, done.out) == (2, "")
    assert done.err == "fireworld: policy odd:DigestExits: its attributes: SystemExit: 0 (odd.py, line 17)\n"


def test_whatever_comes_to_the_top_is_an_error(fireworld, monkeypatch):
    class OwnError(BaseException):
        pass

    for error in (SystemExit(0), OwnError("own"), GeneratorExit()):
        monkeypatch.setattr("fireworld.scenario.load_scenario", lambda _, error=error: (_ for _ in ()).throw(error))
        done = fireworld("run", "quick")
        assert (done.code, len(done.err.splitlines())) == (2, 1)
        assert done.err.startswith("fireworld: internal error: ")


def test_an_answer_to_wait_for_is_refused(odd, fireworld):
    done = fireworld("run", "quick", "--policy", "odd.py:Async", "--steps", 2)
    assert done.code == 2
    assert "got a coroutine; decide without async" in done.err


def test_outputs_are_written_where_they_were_asked_for(odd, fireworld):
    words = ("compare", "odd.py:Moves", "chief", "--scenarios", "quick", "--seeds", 1, "--jobs", 1, "--junit", "a.xml")
    assert fireworld(*words).code == 0
    assert (odd / "a.xml").exists()
    assert Path.cwd() == odd


def test_what_threads_raise_is_a_line(odd, fireworld, monkeypatch):
    monkeypatch.setattr(threading, "excepthook", threading.__excepthook__)
    done = fireworld("run", "quick", "--policy", "odd.py:Ignored", "--steps", 2)
    assert done.code == 0
    assert "warning: what a thread raised is ignored: ZeroDivisionError" in done.err
