"""`fireworld run`: its table, its JSON, its recordings, and every mistake in one line."""

from __future__ import annotations

import json
import os
import pty
import subprocess
import sys

import pytest

from fireworld.records import ACTION_NAMES

pytestmark = pytest.mark.usefixtures("policies_file")

SHORT = ("run", "quick", "--steps", 6)


def outcome_of(done):
    assert done.code == 0, done.err
    return json.loads(done.out)


def test_the_closing_table(here, fireworld):
    done = fireworld(*SHORT, "--seed", 3, "--policy", "easiest")
    assert (done.code, done.err) == (0, "")
    outcome = outcome_of(fireworld(*SHORT, "--seed", 3, "--policy", "easiest", "--json"))
    for words in (
        "quick, easiest, seed 3",
        f"{outcome['score']:.3f} of 5",
        "not within 6 steps",
        "of 80 buildings",
        f"{outcome['n_civilians_alive']} of 4",
        f"{outcome['return']:,.0f}",
        f"{outcome['water_used_litres']:,.0f} litres",
        outcome["digest"],
    ):
        assert words in done.out
    assert "recorded" not in done.out


def test_the_digest_stands_on_one_line(here, fireworld, monkeypatch):
    digest = outcome_of(fireworld(*SHORT, "--json"))["digest"]
    monkeypatch.setenv("COLUMNS", "60")
    assert f"digest {digest}" in fireworld(*SHORT).out.splitlines()


def test_a_recording_is_no_scenario(here, fireworld):
    assert fireworld(*SHORT, "--record", "a.mcap").code == 0
    done = fireworld("run", "a.mcap")
    assert (done.code, done.out) == (2, "")
    assert done.err.startswith("fireworld: a.mcap: expected a scenario, got a recording; `fireworld view a.mcap` ")


def test_a_city_that_burnt_down_is_said_to_have(here, fireworld):
    assert "; the city burnt down" in fireworld("run", "test-1", "--policy", "easiest").out


def test_the_outcome_as_json(here, fireworld):
    outcome = outcome_of(fireworld("run", "quick", "--json"))
    kinds = {key: type(value) for key, value in outcome.items()}
    assert kinds == {
        "scenario": str,
        "policy": str,
        "seed": int,
        "ended": str,
        "steps": int,
        "time_to_complete": int,
        "score": float,
        "score_max": float,
        "score_now": float,
        "n_buildings": int,
        "n_burning": int,
        "n_burnt_out": int,
        "n_water_damaged": int,
        "n_civilians": int,
        "n_civilians_alive": int,
        "return": float,
        "water_used_litres": float,
        "digest": str,
        "recording": type(None),
    }
    assert (outcome["ended"], outcome["n_burning"]) == ("terminated", 0)
    assert outcome["time_to_complete"] == outcome["steps"] < 100
    assert 0 < outcome["score"] <= outcome["score_max"] == 5.0
    cut = outcome_of(fireworld(*SHORT, "--json", "--record", "a.mcap"))
    assert (cut["ended"], cut["steps"], cut["time_to_complete"]) == ("truncated", 6, None)
    assert cut["recording"] == "a.mcap"


def test_seed_policy_and_settings_make_the_run(here, fireworld):
    words = [(), ("--seed", 2), ("--policy", "random"), ("--set", "brigades.n=3"), ("--set", "fires.0.n_buildings=5")]
    digests = [outcome_of(fireworld(*SHORT, "--json", *more))["digest"] for more in words]
    assert len(set(digests)) == len(words)
    assert outcome_of(fireworld(*SHORT, "--json"))["digest"] == digests[0]


def test_a_recording_has_the_digest_of_the_run(here, fireworld, files):
    plain = outcome_of(fireworld(*SHORT, "--json"))
    recorded = outcome_of(fireworld(*SHORT, "--json", "--record", "a.mcap"))
    assert recorded == plain | {"recording": "a.mcap"}
    assert json.loads(fireworld("info", "a.mcap", "--json").out)["digest"] == plain["digest"]
    assert files() == ["a.mcap"]
    assert "recorded to b.mcap; look at it with `fireworld view b.mcap`" in fireworld(*SHORT, "--record", "b.mcap").out


def test_an_existing_recording_is_replaced_only_when_asked(here, fireworld, files):
    fireworld(*SHORT, "--record", "a.mcap")
    before = (here / "a.mcap").read_bytes()
    done = fireworld(*SHORT, "--seed", 2, "--record", "a.mcap")
    assert done.code == 2
    assert done.err == (
        "fireworld: a.mcap: expected a name that is free, got an existing file; use --force to replace it\n"
    )
    assert (here / "a.mcap").read_bytes() == before
    assert fireworld(*SHORT, "--seed", 2, "--record", "a.mcap", "--force").code == 0
    assert (here / "a.mcap").read_bytes() != before
    assert files() == ["a.mcap"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("run", "quik"), "got 'quik'; try quick"),
        (("run", "nowhere/a.yaml"), "nowhere/a.yaml: expected a scenario file, got No such file or directory"),
        (("run", "quick", "--set", "brigades.n"), "--set: expected KEY=VALUE, got 'brigades.n'; try brigades.n=7"),
        (("run", "quick", "--set", "brigades.n=0"), "brigades.n: expected a whole number from 1 to 1000, got 0"),
        (("run", "quick", "--set", "brigade.n=3"), "brigade"),
        (("run", "quick", "--set", "fires.0.n_buildings=9999"), "at most 7"),
        (("run", "quick", "--policy", "chef"), "--policy: expected one of easiest"),
        (("run", "quick", "--policy", "absent:Mine"), "ModuleNotFoundError"),
        (("run", "quick", "--policy", "policies:Absent"), "expected a class of that name, got 'Absent'"),
        (("run", "quick", "--policy", "policies:Decision"), "policies:Decision: expected a value for action"),
        (("run", "quick", "--policy", "policies:os"), "expected a policy with a method decide"),
        (
            ("run", "quick", "--policy", "policies:NeverReady"),
            "policy policies:NeverReady: begin: RuntimeError: no model (policies.py, line ",
        ),
    ],
)
def test_mistakes_end_in_one_line_and_leave_nothing(here, fireworld, files, words, message):
    done = fireworld(*words, "--record", "a.mcap")
    assert (done.code, done.out) == (2, "")
    assert done.err.startswith("fireworld: ")
    assert done.err.count("\n") == 1
    assert message in done.err
    assert files() == []


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--force",), "--force goes with --record."),
        (("--steps", "0"), "0 is not in the range x>=1"),
        (("--seed", "-1"), "-1 is not in the range"),
        (("--seed", "x"), "'x' is not a valid integer"),
        (("--fast",), "No such option"),
    ],
)
def test_wrong_flags(here, fireworld, words, message):
    done = fireworld("run", "quick", *words)
    assert (done.code, done.out) == (2, "")
    assert message in done.err
    assert done.err.startswith("Usage: ")


def test_a_recording_that_cannot_be_written(here, fireworld, files):
    done = fireworld(*SHORT, "--record", "no/such/folder/a.mcap")
    assert (done.code, done.err.count("\n")) == (2, 1)
    assert "expected an existing folder no/such/folder" in done.err
    assert files() == []


@pytest.mark.parametrize(
    ("policy", "message"),
    [
        ("Failing", "step 5, brigade 1: RuntimeError: lost the thread (policies.py, line "),
        (
            "Wrong",
            f"step 5, brigade 0: expected a Decision or an action ({', '.join(ACTION_NAMES)}, or 0 to 4), got action 7",
        ),
    ],
)
def test_a_policy_that_fails_leaves_the_steps_before(here, fireworld, files, policy, message):
    done = fireworld("run", "quick", "--policy", f"policies:{policy}", "--record", "a.mcap")
    assert (done.code, done.out, done.err.count("\n")) == (2, "", 1)
    assert done.err.startswith(f"fireworld: policy policies:{policy}: {message}")
    assert done.err.endswith("; steps 0 to 4 are kept in a.mcap.partial\n")
    assert files() == ["a.mcap.partial"]
    assert fireworld("recover", "a.mcap.partial", "-o", "b.mcap").code == 0
    assert fireworld("verify", "b.mcap").code == 0
    alone = fireworld("run", "quick", "--policy", f"policies:{policy}")
    assert alone.code == 2
    assert "kept" not in alone.err


@pytest.mark.slow
def test_progress_is_shown_to_people(here):
    """On a terminal: a bar while it runs, gone when it ends; the outcome is there."""
    leader, follower = pty.openpty()
    done = subprocess.run(
        [sys.executable, "-c", "from fireworld.cli import main; main()", *map(str, SHORT)],
        stdout=subprocess.PIPE,
        stderr=follower,
        text=True,
        check=False,
        env=os.environ | {"TERM": "xterm", "COLUMNS": "100"},
    )
    os.close(follower)
    shown = os.read(leader, 1_000_000).decode()
    os.close(leader)
    assert done.returncode == 0
    assert "of at most 6" in shown
    assert "score" in done.stdout
