"""Record, look, verify, compare: the whole path on a small scenario, by commands alone."""

from __future__ import annotations

import json
import shutil

import pytest
from fireworld_recorder.reader import open_log

from fireworld.city.generator import generate_plan
from tests.city.plans import dump_plan

pytestmark = pytest.mark.usefixtures("policies_file")


def record(fireworld, name, *words):
    done = fireworld("run", "quick", "--steps", 60, "--record", name, "--json", *words)
    assert done.code == 0, done.err
    return json.loads(done.out)


def test_record_info_verify_diff(here, fireworld):
    outcome = record(fireworld, "a.mcap", "--policy", "each-another", "--seed", 4)
    info = fireworld("info", "a.mcap")
    assert info.code == 0
    for words in ("complete", "seed 4", "each-another", outcome["digest"], "80 buildings, 2 brigades, 4 civilians"):
        assert words in info.out
    verified = fireworld("verify", "a.mcap")
    assert verified.code == 0
    assert verified.out == (
        f"a.mcap: the replay is the same, {outcome['steps'] + 1} steps, digest {outcome['digest']}\n"
    )
    assert json.loads(fireworld("verify", "a.mcap", "--json").out)["same"] is True
    record(fireworld, "b.mcap", "--policy", "each-another", "--seed", 4)
    assert (here / "a.mcap").read_bytes() == (here / "b.mcap").read_bytes()
    assert fireworld("diff", "a.mcap", "b.mcap").code == 0


def test_diff_names_the_first_decision_that_differs(here, fireworld):
    record(fireworld, "a.mcap", "--policy", "nearest-to-center")
    record(fireworld, "b.mcap", "--policy", "nearest-to-me")
    done = fireworld("diff", "a.mcap", "b.mcap")
    assert done.code == 1
    assert "step 1, choose: brigade 0 chose nearest-to-me, was nearest-to-center" in done.out
    assert json.loads(fireworld("diff", "a.mcap", "b.mcap", "--json").out)["same"] is False


def test_another_seed_differs_by_its_luck(here, fireworld):
    record(fireworld, "a.mcap", "--policy", "easiest")
    record(fireworld, "b.mcap", "--policy", "easiest", "--seed", 2)
    done = fireworld("diff", "a.mcap", "b.mcap")
    assert done.code == 1
    assert "seed: 2, was 1" in done.out
    assert ", draw: " in done.out


@pytest.mark.parametrize("policy", ["policies:Near", "policies:Values", "random"])
def test_a_replay_needs_the_recording_alone(here, fireworld, policy):
    """Decisions, values and luck of a policy come from the recording; the policy itself may be gone."""
    record(fireworld, "a.mcap", "--policy", policy)
    (here / "policies.py").unlink()
    assert fireworld("verify", "a.mcap").code == 0


def test_a_replay_of_a_changed_scenario(here, fireworld):
    record(
        fireworld,
        "a.mcap",
        "--set",
        "brigades.n=5",
        "--set",
        "reward=change",
        "--set",
        "parameters.fire.burn_rate_sd=0.1",
    )
    assert fireworld("verify", "a.mcap").code == 0
    assert "5 brigades" in fireworld("info", "a.mcap").out


def test_a_scenario_of_ones_own_in_a_city_of_ones_own(here, fireworld):
    """The city file travels with the recording."""
    plan = generate_plan(columns=5, rows=4, seed=9)
    (here / "city.json").write_text(json.dumps(dump_plan(plan)))
    (here / "mine.yaml").write_text("city: {file: city.json}\nfires: [{at: [0.5, 0.5], n_buildings: 2}]\nsteps: 20\n")
    done = fireworld("run", "mine.yaml", "--record", "a.mcap", "--json")
    assert done.code == 0, done.err
    (here / "city.json").unlink()
    (here / "mine.yaml").unlink()
    assert fireworld("verify", "a.mcap").code == 0
    assert set(open_log(here / "a.mcap").header.attachments) == {"scenario.yaml", "city.json", "policy.npz"}


def test_a_recording_knows_nothing_of_where_it_was_made(here, fireworld, monkeypatch):
    record(fireworld, "a.mcap", "--policy", "policies:Near")
    elsewhere = here / "elsewhere"
    elsewhere.mkdir()
    shutil.copy(here / "policies.py", elsewhere / "policies.py")
    monkeypatch.chdir(elsewhere)
    record(fireworld, "other.mcap", "--policy", "policies:Near")
    assert (here / "a.mcap").read_bytes() == (elsewhere / "other.mcap").read_bytes()
    assert str(here).encode() not in (here / "a.mcap").read_bytes()
