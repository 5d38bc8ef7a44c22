"""`fireworld fork`: without a change the same to the bit, with one another run from there on, and no other before."""

from __future__ import annotations

import json
import signal
from dataclasses import replace

import numpy as np
import pytest
from fireworld_recorder.chain import Digest
from fireworld_recorder.diff import compare
from fireworld_recorder.reader import open_log
from fireworld_recorder.writer import StepFile

from fireworld.errors import PolicyError
from fireworld.policy.names import find_policy
from fireworld.policy.teams.table_team import TableTeam
from fireworld.recording.fork import prepare_fork
from fireworld.recording.replay import build_recorded
from fireworld.recording.resume import Beginning, recorded_policy, resume
from fireworld.records import ACTION_NAMES, ACTIONS, MemoryRecording
from tests.recording.conftest import STEPS, write_log


def decision(log, step, brigade):
    return int(log.step(step).decisions.action[brigade])


def one_deciding(log, *, after):
    """Return the first step after one, and a brigade, in which that brigade decided."""
    for record in log:
        if record.step > after and (record.decisions.action >= 0).any():
            return record.step, int(np.argmax(record.decisions.action >= 0))
    raise AssertionError


@pytest.mark.slow
def test_without_a_change_the_fork_is_the_run_wherever_it_is_forked(recordings):
    """At every snapshot and at 20 other steps: the same records, so the same digest."""
    log = open_log(recordings / "random.mcap")
    records, built = list(log), build_recorded(log.header)
    assert log.snapshots == [0, 50]
    assert records[-1].step == STEPS
    assert records[-1].truncated
    for step in [*log.snapshots, *np.random.default_rng(1).choice(STEPS, 20, replace=False).tolist()]:
        assert resume(built, Beginning(log, step), source="log").step_number == step  # compared on the way
        fork = prepare_fork(log, at=step)
        gone, digest = list(fork), Digest(log.city)
        for record in gone:
            digest.write(record)
        assert compare(log, MemoryRecording(fork.header, fork.city, gone)).same, f"snapshots included, forked at {step}"
        assert digest.digest == log.digest, step


@pytest.mark.parametrize("step", [0, 1, 49, 51, 59])
def test_a_policy_with_a_memory_goes_on_as_if_nothing_had_been(here, answer, recordings, step):
    digest = open_log(recordings / "counting.mcap").digest
    assert answer("fork", "counting.mcap", "--at", step)["digest"] == digest


def test_targets_of_its_own_are_gone_on_with(here, answer, recordings):
    digest = open_log(recordings / "own.mcap").digest
    assert answer("fork", "own.mcap", "--at", 20)["digest"] == digest
    swaps = [word for brigade in range(2) for word in ("--swap", f"own.mcap:{brigade}")]
    assert answer("fork", "easiest.mcap", "--at", 0, *swaps)["digest"] == digest
    assert answer("fork", "easiest.mcap", "--at", 9, *swaps)["digest"] != digest, "what does not burn is not sprayed"


def test_a_policy_that_is_named_begins_anew(here, answer, recordings):
    digest = open_log(recordings / "counting.mcap").digest
    words = ("fork", "counting.mcap", "--policy", "own_policies:Counting", "--at")
    assert answer(*words, 0)["digest"] == digest
    assert answer(*words, 20)["digest"] != digest, "it counts from the step of the fork"


def test_the_recording_of_a_fork(here, fireworld, answer):
    """It holds the whole run, says what it was forked from, and is read by the other commands."""
    log = open_log("easiest.mcap")
    step, brigade = one_deciding(log, after=10)
    at = step - 1
    outcome = answer(
        "fork", "easiest.mcap", "--at", at, "--decide", f"{brigade}=nearest-to-civilian", "--record", "f.mcap"
    )
    fork = open_log("f.mcap")
    assert (outcome["digest"], outcome["forked_from"]) == (fork.digest, f"{log.digest}:{at}")
    assert outcome["score_of_original"] == log.step(STEPS).score.score
    assert fork.header.forked_from == f"{log.digest}:{at}"
    assert (fork.header.policy, fork.header.seed) == ("easiest", 1)
    (told,) = json.loads(fork.header.attachments["fork.json"])
    assert told == {
        "from": log.digest,
        "step": at,
        "policy": "easiest",
        "decide": {str(brigade): "nearest-to-civilian"},
        "swap": {},
    }
    assert fork.steps.tolist() == list(range(int(fork.steps[-1]) + 1))
    assert decision(log, step, brigade) == ACTIONS.index("easiest")
    assert decision(fork, step, brigade) == ACTIONS.index("nearest-to-civilian")
    later = [made[brigade] for made in fork.ragged("/decisions", "action")[step + 1 :]]
    assert set(later) <= {ACTIONS.index("easiest"), -1}, "afterwards the policy decides again"
    assert fireworld("verify", "f.mcap").code == 0
    done = fireworld("diff", "easiest.mcap", "f.mcap")
    assert done.code == 1
    assert f"step {step}, choose: brigade {brigade} chose nearest-to-civilian, was easiest" in done.out
    assert f"forked from  {log.digest}:{at}" in fireworld("info", "f.mcap").out


def test_a_target_of_its_own(here, fireworld, answer):
    """Told by the building's id, which here is not its place in the city."""
    answer("fork", "two-fires.mcap", "--at", 5, "--decide", "1=own-target:167", "--record", "f.mcap")
    log, fork = open_log("two-fires.mcap"), open_log("f.mcap")
    (told,) = json.loads(fork.header.attachments["fork.json"])
    assert told["decide"] == {"1": "own-target:167"}
    made, was = fork.step(6).decisions, log.step(6).decisions
    assert (made.action.tolist(), was.action.tolist()) == ([0, ACTION_NAMES.index("own-target")], [0, 0])
    assert log.city.building_id[made.target].tolist() == [112, 167]
    assert log.city.building_id[was.target].tolist() == [112, 176]
    assert {decision(fork, step, 1) for step in range(7, 13)} == {0}, "afterwards the policy decides again"
    assert fireworld("verify", "f.mcap").code == 0
    assert "brigade 1 chose own-target, was easiest" in fireworld("diff", "two-fires.mcap", "f.mcap").out
    assert answer("fork", "f.mcap", "--at", 8)["digest"] == fork.digest


def test_a_target_of_its_own_before_the_first_step(here, answer):
    answer("fork", "two-fires.mcap", "--at", 0, "--decide", "1=own-target:167", "--record", "f.mcap")
    log = open_log("f.mcap")
    assert log.city.building_id[log.step(1).decisions.target[1]] == 167


def test_another_policy_takes_over(here, answer):
    outcome = answer("fork", "easiest.mcap", "--at", 5, "--policy", "nearest-to-me", "--record", "f.mcap")
    actions = open_log("f.mcap").ragged("/decisions", "action")
    before = {action for made in actions[1:6] for action in made.tolist()}
    after = {action for made in actions[6:] for action in made.tolist()}
    assert (before - {-1}, after - {-1}) == ({0}, {3})
    assert outcome["policy"] == "nearest-to-me"


def test_the_planner_takes_over(here, answer):
    assert answer("fork", "easiest.mcap", "--at", 57, "--policy", "planner:horizon=2")["policy"] == "planner:horizon=2"


def test_all_brigades_swapped_from_the_start_are_the_other_run(here, answer, recordings):
    swaps = [word for brigade in range(2) for word in ("--swap", f"random.mcap:{brigade}")]
    outcome = answer("fork", "easiest.mcap", "--at", 0, *swaps, "--record", "f.mcap")
    assert outcome["digest"] == open_log(recordings / "random.mcap").digest
    (told,) = json.loads(open_log("f.mcap").header.attachments["fork.json"])
    assert told["swap"] == {"0": outcome["digest"], "1": outcome["digest"]}


def test_one_brigade_swapped(here, answer):
    answer("fork", "easiest.mcap", "--at", 3, "--swap", "nearest-to-me.mcap:1", "--record", "f.mcap")
    actions = open_log("f.mcap").ragged("/decisions", "action")
    chosen = [{made[brigade] for made in actions[4:]} - {-1} for brigade in range(2)]
    assert chosen == [{ACTIONS.index("easiest")}, {ACTIONS.index("nearest-to-me")}]


def test_recorded_decisions_go_on(here, answer, recordings):
    """Open loop: without a change the same; with one every other decision stays as it was where there was one."""
    log = open_log("random.mcap")
    step, brigade = one_deciding(log, after=4)
    other = ACTIONS[(decision(log, step, brigade) + 1) % 4]
    words = ("fork", "random.mcap", "--at", step - 1, "--policy", "recorded")
    assert answer(*words)["digest"] == log.digest
    answer(*words, "--decide", f"{brigade}={other}", "--record", "f.mcap")
    fork = open_log("f.mcap")
    both = [
        (place, made.tolist(), was.tolist())
        for place, (made, was) in enumerate(
            zip(fork.ragged("/decisions", "action"), log.ragged("/decisions", "action"), strict=False)
        )
    ]
    differing = {
        (place, b)
        for place, made, was in both
        for b in range(len(made))
        if made[b] != was[b] and min(made[b], was[b]) >= 0
    }
    assert differing == {(step, brigade)}
    assert answer("fork", "f.mcap", "--at", step + 3)["digest"] == fork.digest, "its decisions go on in its forks too"


def test_a_fork_of_a_fork_tells_of_both(here, answer):
    answer("fork", "easiest.mcap", "--at", 5, "--policy", "nearest-to-me", "--record", "f.mcap")
    first = open_log("f.mcap")
    outcome = answer("fork", "f.mcap", "--at", 30, "--policy", "chief", "--record", "g.mcap")
    assert outcome["forked_from"] == f"{first.digest}:30"
    told = json.loads(open_log("g.mcap").header.attachments["fork.json"])
    assert [(fork["step"], fork["policy"]) for fork in told] == [(5, "nearest-to-me"), (30, "chief")]
    assert answer("fork", "f.mcap", "--at", 30)["digest"] == first.digest


@pytest.mark.parametrize("commit", [1, 7])
def test_a_team_comes_from_the_recording(here, answer, commit):
    tables = np.random.default_rng(3).normal(size=(2, 4320, 4))
    team = TableTeam(
        tables=tables, visits=np.zeros(tables.shape, dtype=np.int64), provenance={"method": {"commit": commit}}
    )
    team.save(here / "team.npz")
    answer("run", "quick", "--steps", 30, "--policy", "team.npz", "--record", "t.mcap")
    (here / "team.npz").unlink()
    assert answer("fork", "t.mcap", "--at", 17, "--record", "f.mcap")["digest"] == open_log("t.mcap").digest
    fork = open_log("f.mcap")
    assert fork.header.attachments["policy.npz"] == open_log("t.mcap").header.attachments["policy.npz"]
    answer("fork", "t.mcap", "--at", 17, "--policy", "easiest", "--record", "g.mcap")
    assert "policy.npz" not in open_log("g.mcap").header.attachments


def test_a_brigade_that_is_told_drops_what_it_was_committed_to(here, answer):
    tables = np.zeros((1, 4320, 4))
    tables[..., 0] = 1.0
    team = TableTeam(
        tables=tables, visits=np.zeros(tables.shape, dtype=np.int64), provenance={"method": {"commit": 50}}
    )
    team.save(here / "team.npz")
    answer("run", "quick", "--steps", 12, "--policy", "team.npz", "--record", "t.mcap")
    answer("fork", "t.mcap", "--at", 4, "--decide", "0=nearest-to-me", "--record", "f.mcap")
    made = [actions[0] for actions in open_log("f.mcap").ragged("/decisions", "action")[1:8]]
    assert made[:4] == [0, 0, 0, 0]
    assert made[4:] == [3, 3, 3], "and keeps to the new one until it may choose again"


def test_a_stopped_run_is_gone_on_with(here, answer, recordings):
    assert answer("fork", "stopped.mcap", "--at", 20)["digest"] == open_log(recordings / "easiest.mcap").digest


def test_the_table(here, fireworld):
    same = fireworld("fork", "easiest.mcap", "--at", 20)
    assert (same.code, same.err) == (0, "")
    assert "forked after step 20 from easiest.mcap; the same run\n" in same.out
    score = open_log("easiest.mcap").step(STEPS).score.score
    other = fireworld("fork", "easiest.mcap", "--at", 20, "--policy", "chief")
    assert f"forked after step 20 from easiest.mcap, which ended with the score {score:.3f}\n" in other.out


WRONG = {
    "--at 99": "at: expected a step of easiest.mcap, 0 to 60, got 99",
    "--at 60": "at: expected a step of easiest.mcap after which the run continues, got 60, it is the last of the run",
    "--at 5 --policy chef": "--policy: expected one of ",
    "--at 5 --decide 7=easiest": "decide: brigade: expected a whole number from 0 to 1, got 7",
    "--at 5 --decide easiest": "--decide: expected BRIGADE=ACTION as in 2=nearest-to-me, got 'easiest'",
    "--at 5 --decide 0=nearest": "got 'nearest'; try nearest-to-civilian or nearest-to-center or nearest-to-me",
    "--at 5 --decide 0=easiest --decide 0=nearest-to-me": "--decide: expected one for brigade 0, got two",
    "--at 5 --swap chief.mcap": "--swap: expected OTHER:BRIGADE as in other.mcap:2, got 'chief.mcap'",
    "--at 5 --swap chief.mcap:2": "swap: brigade: expected a whole number from 0 to 1, got 2",
    "--at 5 --swap none.mcap:1": "none.mcap",
    "--at 30 --swap stopped.mcap:1": "stopped.mcap: expected a run with decisions after step 30, got one that ends at",
    "--at 5 --swap other-seed.mcap:1": "other-seed.mcap: seed: expected 1, as in easiest.mcap: other seeds give",
    "--at 5 --swap other-scenario.mcap:1": "other-scenario.mcap: scenario: expected quick (",
    "--at 5 --swap chief.mcap:0 --decide 0=easiest": "decide, swap: expected one of them for brigade 0, got 'both'",
    "--at 5 --force": "--force goes with --record.",
}


@pytest.mark.parametrize("words", WRONG)
def test_mistakes(here, fireworld, words):
    record = () if "--force" in words else ("--record", "f.mcap")
    done = fireworld("fork", "easiest.mcap", *words.split(), *record)
    assert (done.code, done.out) == (2, "")
    assert WRONG[words] in done.err
    assert not list(here.glob("f.mcap*")), "nothing half-written"


WRONG_TARGETS = {
    "0=own-target": "decide: 0: expected a building behind own-target, as in own-target:301, got 'own-target'",
    "0=own-target:": "decide: 0: expected a building behind own-target, as in own-target:301, got 'own-target:'",
    "0=own-target:-1": "expected a building behind own-target, as in own-target:301, got 'own-target:-1'",
    "0=own-target:7": "decide: 0: expected the id of a building of two-fires.mcap, 100 to 179, got 'own-target:7'",
    "0=easiest:112": "decide: 0: expected easiest without a building, got 'easiest:112'; a brigade goes for a ",
    "0=own": "nearest-to-me, own-target, got 'own'; try own-target",
    "0=own-target:101": "that burns in the brigade's fire site in step 6, got 101, which does not burn; try 112",
    "1=own-target:112": "in step 6, got 112, which burns in another one; try 167, 176",
}


@pytest.mark.parametrize("words", WRONG_TARGETS)
def test_targets_that_cannot_be(here, fireworld, words):
    done = fireworld("fork", "two-fires.mcap", "--at", 5, "--decide", words, "--record", "f.mcap")
    assert (done.code, done.out, done.err.count("\n")) == (2, "", 1)
    assert WRONG_TARGETS[words] in done.err
    assert not list(here.glob("f.mcap*"))


def test_targets_of_other_sites_where_allocation_is_free(here, fireworld, answer):
    """It is refused where it is fixed, above."""
    answer("run", "town.yaml", "--policy", "easiest", "--set", "brigades.allocation=free", "--record", "free.mcap")
    answer("fork", "free.mcap", "--at", 5, "--decide", "1=own-target:112", "--record", "f.mcap")
    log = open_log("f.mcap")
    assert log.city.building_id[log.step(6).decisions.target[1]] == 112
    assert [log.step(step).observations.site[1] for step in (6, 7)] == [2, 1]
    done = fireworld("fork", "free.mcap", "--at", 5, "--decide", "0=own-target:101")
    assert "expected a building that burns in step 6, got 101, which does not burn; try 112, 167, 176" in done.err


def test_a_decision_of_one_who_has_none(here, fireworld):
    """A brigade that refills is not asked; the error names the step to fork at instead, and that one works."""
    log = open_log("easiest.mcap")
    step = next(record.step for record in log if record.step and record.decisions.action[0] < 0)
    done = fireworld("fork", "easiest.mcap", "--at", step - 1, "--decide", "0=nearest-to-me")
    assert done.code == 2
    assert f"decide: 0: expected a brigade that decides in step {step}, got one that refills; it decides" in done.err
    at = int(done.err.rpartition("fork at ")[2])
    assert fireworld("fork", "easiest.mcap", "--at", at, "--decide", "0=nearest-to-me").code == 0
    assert fireworld("fork", "easiest.mcap", "--at", at - 1, "--decide", "0=nearest-to-me").code == 2


def test_an_existing_recording_is_kept(here, fireworld):
    (here / "f.mcap").write_text("mine")
    words = ("fork", "easiest.mcap", "--at", 5, "--record", "f.mcap")
    done = fireworld(*words)
    assert done.code == 2
    assert "use --force to replace it" in done.err
    assert (here / "f.mcap").read_text() == "mine"
    assert fireworld(*words, "--force").code == 0
    assert fireworld("verify", "f.mcap").code == 0


def test_a_policy_that_is_gone_or_has_changed(here, fireworld):
    source = here / "own_policies.py"
    source.write_text(source.read_text() + "\n# another version\n")
    changed = fireworld("fork", "counting.mcap", "--at", 5)
    assert changed.code == 2
    assert "counting.mcap: policy: expected the policy own_policies:Counting as it was recorded" in changed.err
    assert "--policy own_policies:Counting takes it as it is now" in changed.err
    assert fireworld("fork", "counting.mcap", "--at", 5, "--policy", "own_policies:Counting").code == 0


def test_a_policy_that_cannot_be_imported(here, fireworld):
    (here / "own_policies.py").unlink()
    gone = fireworld("fork", "counting.mcap", "--at", 5)
    assert gone.code == 2
    assert "counting.mcap: its policy own_policies:Counting cannot be loaded" in gone.err
    assert "name another one with --policy" in gone.err
    assert fireworld("fork", "counting.mcap", "--at", 5, "--policy", "recorded").code == 0


def test_a_policy_with_a_memory_that_decides_otherwise_now(here, fireworld):
    """A fork by itself already is a run that its policy alone would not have made."""
    made = fireworld("fork", "easiest.mcap", "--at", 9, "--policy", "own_policies:Counting", "--record", "f.mcap")
    assert made.code == 0
    done = fireworld("fork", "f.mcap", "--at", 20)
    assert done.code == 2
    assert ": easiest is recorded, but own_policies:Counting now decides " in done.err
    assert "--policy own_policies:Counting starts it afresh" in done.err


def altered(records, step, **changes):
    """Return records one of which holds something else."""
    return [replace(record, **changes) if record.step == step else record for record in records]


def test_a_planner_over_a_team_that_has_another_name_now(here, fireworld):
    """`best` was another team once: old recordings of planners over it are known by their digest."""
    fireworld("run", "quick", "--policy", "random", "--steps", 1, "--record", "a.mcap")
    header = replace(open_log("a.mcap").header, policy="planner:horizon=5,over=best,interval=2")
    old, new = (find_policy(f"planner:horizon=5,over={name},interval=2").digest for name in ("best-2026", "best"))
    assert old != new
    for digest in (old, new):
        assert recorded_policy(replace(header, policy_digest=digest), source="a.mcap").digest == digest
    with pytest.raises(PolicyError, match="one that has changed since"):
        recorded_policy(replace(header, policy_digest="0" * 64), source="a.mcap")


def test_a_recording_that_does_not_replay(here, fireworld, recordings):
    log = open_log("easiest.mcap")
    records = list(log)
    tanks = records[22].brigades.tank_litres.copy()
    tanks[1] += 1
    write_log(here / "bad.mcap", log, altered(records, 22, brigades=replace(records[22].brigades, tank_litres=tanks)))
    done = fireworld("fork", "bad.mcap", "--at", 30, "--record", "f.mcap")
    assert (done.code, done.out) == (2, "")
    assert "bad.mcap: does not replay to what is recorded: step 22, act: brigade 1: tank litres is" in done.err
    assert len(done.err.splitlines()) == 1
    assert not (here / "f.mcap").exists()
    assert fireworld("fork", "bad.mcap", "--at", 21).code == 0, "up to there it does"


@pytest.mark.parametrize("at", [50, 55])
def test_a_snapshot_that_is_not_of_its_run(here, fireworld, at):
    log = open_log("easiest.mcap")
    records = list(log)
    arrays = {**records[50].snapshot.arrays}
    arrays["fire.energy"] = arrays["fire.energy"] + 1.0
    write_log(here / "bad.mcap", log, altered(records, 50, snapshot=replace(records[50].snapshot, arrays=arrays)))
    done = fireworld("fork", "bad.mcap", "--at", at)
    assert done.code == 2
    assert "does not replay to what is recorded: step 50, " in done.err


def test_a_snapshot_of_other_arrays_is_passed_over(here, fireworld, answer):
    log = open_log("easiest.mcap")
    records = list(log)
    arrays = {name: array for name, array in records[50].snapshot.arrays.items() if name != "fire.energy"}
    write_log(here / "old.mcap", log, altered(records, 50, snapshot=replace(records[50].snapshot, arrays=arrays)))
    assert answer("fork", "old.mcap", "--at", 55)["digest"] == log.digest


def test_ctrl_c_keeps_every_step_done(here, fireworld, interruptible, monkeypatch):
    commit = StepFile.commit

    def interrupted_commit(self, step, messages):
        commit(self, step, messages)
        if step == 40:
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(StepFile, "commit", interrupted_commit)
    done = fireworld("fork", "easiest.mcap", "--at", 30, "--policy", "chief", "--record", "f.mcap")
    assert done.code == 130
    assert open_log("f.mcap").steps.tolist() == list(range(41))
    monkeypatch.undo()
