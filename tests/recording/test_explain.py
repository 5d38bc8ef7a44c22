"""`fireworld explain`: shares that can be worked out by hand, replays that are what forks are."""

from __future__ import annotations

import json
import os
import signal
import sys
from threading import Event

import numpy as np
import pytest
from fireworld_recorder.reader import open_log

from fireworld.policy.names import find_policy
from fireworld.policy.teams.ranking_team import RankingTeam
from fireworld.recording.decisions import RecordedDecisions
from fireworld.recording.explanation import counterfactual
from fireworld.recording.explanation.counterfactual import CounterfactualRun, prepare_counterfactuals
from fireworld.recording.explanation.search import search_effects
from fireworld.recording.explanation.spans import DecisionSpan, find_spans
from fireworld.recording.replay import build_recorded
from fireworld.records import ACTION_NAMES, ACTIONS
from tests import command_line

pytestmark = pytest.mark.slow

EARLY, LATE, BAD = (DecisionSpan(0, 1, 8, 3, (0,)), DecisionSpan(1, 5, 5, 1, (0,)), DecisionSpan(1, 9, 10, 2, (0,)))


def made_up_score(forced):
    """Score: 1; +4 if brigade 0 is forced in step 3, +1 for LATE, -2 for BAD; the two gains are one if both."""
    gains = [4.0 * any(stretch.covers(0, 3) for stretch in forced), 1.0 * (LATE in forced)]
    bad = any(stretch.brigade == 1 and stretch.action == 2 for stretch in forced)
    return 1.0 + max(gains) - 2.0 * bad


def made_up(*stretches, budget=100, n_done=10_000):
    """Explain a difference of 4 by replays of which only the first few are done."""
    calls = []

    def score_all(forced):
        scores = []
        for one in forced:
            calls.append(tuple(one))
            scores.append(made_up_score(one) if len(calls) <= n_done else None)
        return scores

    return search_effects(stretches, worse_score=1.0, better_score=5.0, budget=budget, score_all=score_all), calls


def test_shares_by_hand():
    explanation, calls = made_up(EARLY, LATE, BAD)
    assert [(one.span, one.score, one.share) for one in explanation.effects] == [
        (EARLY, 5.0, 1.0),
        (LATE, 2.0, 0.25),
        (BAD, -1.0, -0.5),
    ]
    assert explanation.together == (3.0, 0.5)
    assert [one.share_without for one in explanation.effects] == [-0.25, 0.5, 1.0]
    assert calls[0] == (EARLY, LATE, BAD), "all at once"
    assert explanation.n_replays == len(calls)
    assert explanation.n_spans == 3


def test_a_stretch_is_narrowed_down_to_the_step_that_matters():
    explanation, _ = made_up(EARLY, LATE)
    core = explanation.effects[0].core
    assert (core.span.first, core.span.last, core.share) == (3, 3, 1.0)
    assert explanation.effects[1].core is None, "a single step"


def test_a_stretch_whose_halves_do_not_do_it_is_left_whole():
    def score_all(forced):
        return [1.0 + 4.0 * (EARLY in one) for one in forced]

    explanation = search_effects([EARLY], worse_score=1.0, better_score=5.0, budget=100, score_all=score_all)
    assert explanation.effects[0].core is None
    assert explanation.n_replays == 4, "all at once, by itself, two halves"


@pytest.mark.parametrize("budget", range(2, 14))
def test_the_budget_is_kept(budget):
    explanation, calls = made_up(EARLY, LATE, BAD, budget=budget)
    assert len(calls) == explanation.n_replays <= budget
    tried = {one.span for one in explanation.effects}
    assert tried == set((EARLY, LATE, BAD)[: budget - 1]), "the earliest come first"


def test_what_is_known_when_it_is_interrupted():
    explanation, _ = made_up(EARLY, LATE, BAD, n_done=3)
    assert [one.span for one in explanation.effects] == [EARLY, LATE]
    assert explanation.together == (3.0, 0.5)
    assert explanation.n_replays == 3
    nothing, _ = made_up(EARLY, n_done=0)
    assert (nothing.effects, nothing.together) == ((), None)


def test_no_stretches_no_replays():
    explanation, calls = made_up()
    assert (explanation.effects, explanation.together, calls) == ((), None, [])


@pytest.mark.parametrize("policy", ["easiest", "random"])
def test_compiled_replays_are_those_step_by_step(recordings, policy):
    log, other = open_log(recordings / f"{policy}.mcap"), open_log(recordings / "chief.mcap")
    better = RecordedDecisions(other)
    run = prepare_counterfactuals(build_recorded(log.header), log, better, lambda: find_policy(policy).policy)
    assert run.compiled
    assert not run.forced
    stretches = find_spans(run.recorded, better, n_brigades=run.built.n_brigades)
    scores = set()
    for forced in ([stretches[0]], [stretches[-1]], stretches, [*stretches[0].halves()][1:]):
        world = run._world_before(0)
        run._run_stepwise(world, find_policy(policy).policy, forced)
        scores.add(run.score(forced))
        assert run.score(forced) == world.state.outcome.score[0]
    assert len(scores) > 1
    assert run.score([DecisionSpan(0, 60, 60, 0, (1,))]) == pytest.approx(log.step(60).score.score, abs=0.1)


def test_a_stretch_of_one_step_is_what_a_fork_with_that_decision_is(here, answer):
    known = answer("explain", "random.mcap", "chief.mcap")
    single = [one for one in known["stretches"] if one["first"] == one["last"]]
    assert single
    for one in single[:4]:
        decide = f"{one['brigade']}={one['action']}"
        fork = answer("fork", "random.mcap", "--at", one["first"] - 1, "--decide", decide)
        assert fork["score"] == one["score"]


@pytest.fixture(scope="module")
def explained(recordings):
    """The answer for the chief and easiest, as JSON."""
    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.chdir(recordings)
        done = command_line.call(monkeypatch, "explain", "chief.mcap", "easiest.mcap", "--json")
    return json.loads(done.out)


def test_the_answer_as_json(here, explained):
    known = explained
    worse, better = open_log("easiest.mcap"), open_log("chief.mcap")
    assert known["worse"] == {"path": "easiest.mcap", "digest": worse.digest, "score": worse.step(60).score.score}
    assert known["better"]["digest"] == better.digest, "whichever comes first"
    difference = known["better"]["score"] - known["worse"]["score"]
    assert (known["difference"], known["goes_on"], known["interrupted"]) == (difference, "policy", False)
    assert known["n_tried"] == known["n_stretches"] == len(known["stretches"]) > 1
    assert known["n_replays"] <= 200
    shares = [one["share"] for one in known["stretches"]]
    assert shares == sorted(shares, reverse=True)
    for one in known["stretches"]:
        assert one["share"] == pytest.approx((one["score"] - known["worse"]["score"]) / difference)
        assert one["action"] in ACTIONS
        assert one["instead_of"] == ["easiest"]
        decided = worse.step(one["first"]).decisions.action, better.step(one["first"]).decisions.action
        assert [ACTIONS[made[one["brigade"]]] for made in decided] == ["easiest", one["action"]]
    assert known["together"]["share"] > 0.5


def test_the_answer_for_people(here, fireworld, explained):
    """The same whichever of the two comes first."""
    known = explained
    done = fireworld("explain", "easiest.mcap", "chief.mcap")
    assert (done.code, done.err) == (0, "")
    assert done.out.startswith(f"chief.mcap scores {known['better']['score']:.6g}, easiest.mcap ")
    assert "after them its own policy continues" in done.out
    first = known["stretches"][0]
    row = next(line for line in done.out.splitlines() if " instead of " in line)
    assert f"{first['first']}-{first['last']}" in row
    assert f"{first['action']} instead of easiest" in row
    assert f"{100 * first['share']:.0f} %" in row
    assert f"all that were tried at once: score {known['together']['score']:.6g}, " in done.out
    assert "they depend on each other" in done.out


def test_a_small_budget_is_told_of(here, fireworld):
    done = fireworld("explain", "random.mcap", "chief.mcap", "--budget", 4, "--limit", 1)
    assert done.code == 0
    assert "3 of " in done.out
    assert " spans tried, the earliest; --budget " in done.out


def test_a_policy_that_is_gone(here, fireworld, answer):
    """Then the recorded decisions continue, and the answer says so."""
    words = ("explain", "counting.mcap", "chief.mcap", "--budget", 6)
    assert answer(*words)["goes_on"] == "policy"
    (here / "own_policies.py").unlink()
    sys.modules.pop("own_policies")
    known = answer(*words)
    assert known["goes_on"] == "recorded"
    assert "own_policies:Counting cannot be loaded" in known["why_recorded"]
    done = fireworld(*words)
    assert "the recorded decisions continue, whatever happens (counting.mcap: its policy" in done.out


@pytest.mark.parametrize("other", ["easiest.mcap", "random.mcap"])
def test_targets_of_its_own(here, answer, other):
    """They are decisions of a run that can be put into another one, as far as they burn there."""
    known = answer("explain", "own.mcap", other, "--budget", 8)
    better, worse = (open_log(known[which]["path"]) for which in ("better", "worse"))
    assert known["stretches"]
    for one in known["stretches"]:
        made = [log.step(one["first"]).decisions.action[one["brigade"]] for log in (better, worse)]
        assert [ACTION_NAMES[action] for action in made] == [one["action"], one["instead_of"][0]]
    assert (known["stretches"][0]["action"] == "own-target") == (known["better"]["path"] == "own.mcap")
    assert known["together"]["share"] == pytest.approx(1.0, abs=0.1)


RANKING = [-0.63, 2.12, 1.59, -0.04, 2.19, 0.94, -0.2, 1.19, 0.83, 0.58, -0.01, 0.01, -0.49, 0.0, 0.0, 0.0, 0.0]
"""Weights that some search found."""


def test_a_stretch_of_one_target_is_what_a_fork_with_that_target_is(here, fireworld, answer):
    """Between two runs of a team that ranks targets: the words of the answer are those that a fork takes."""
    RankingTeam(np.array([RANKING]), own_targets=True, provenance={}).save(here / "ranking.npz")
    answer("run", "quick", "--policy", "ranking.npz", "--record", "ranked.mcap")
    answer("fork", "ranked.mcap", "--at", 5, "--decide", "1=own-target:44", "--record", "f.mcap")
    known = answer("explain", "ranked.mcap", "f.mcap")
    assert known["goes_on"] == "policy"
    assert {one["action"] for one in known["stretches"]} == {"own-target"}
    assert known["worse"]["path"] == "ranked.mcap"
    refused = []
    for one in known["stretches"]:
        assert (one["first"], one["action"]) == (one["last"], "own-target")
        (building,) = one["targets"]
        decide = f"{one['brigade']}=own-target:{building}"
        fork = fireworld("fork", "ranked.mcap", "--at", one["first"] - 1, "--decide", decide, "--json")
        refused.append("which does not burn" in fork.err)
        score = known["worse"]["score"] if refused[-1] else json.loads(fork.out)["score"]
        assert one["score"] == score, "what cannot be done is decided by the policy"
    assert len(set(refused)) == 2
    (forced,) = (one for one in known["stretches"] if one["first"] == 6)
    assert (forced["brigade"], forced["targets"], forced["share"]) == (1, [44], 1.0)
    assert "own-target:44 instead of" in fireworld("explain", "ranked.mcap", "f.mcap").out


def test_the_decision_of_a_fork_explains_it_all(here, answer):
    """The fork's policy alone would not have made it; its recorded decisions stand until one is replaced."""
    known = answer("explain", "random.mcap", "chief.mcap", "--budget", 12)
    one = max((one for one in known["stretches"] if one["first"] == one["last"]), key=lambda one: abs(one["share"]))
    decide = f"{one['brigade']}={one['action']}"
    answer("fork", "random.mcap", "--at", one["first"] - 1, "--decide", decide, "--record", "f.mcap")
    back = answer("explain", "random.mcap", "f.mcap", "--budget", 12)
    shares = {(each["brigade"], each["first"], each["last"]): each["share"] for each in back["stretches"]}
    assert shares[one["brigade"], one["first"], one["last"]] == 1.0


def test_the_orders_of_a_fork_are_found(here, answer):
    answer("fork", "random.mcap", "--at", 40, "--policy", "easiest", "--record", "f.mcap")
    log = open_log("f.mcap")
    run = prepare_counterfactuals(
        build_recorded(log.header), log, RecordedDecisions(log), lambda: find_policy("easiest").policy
    )
    assert run.forced
    assert max(step for step, _ in run.forced) <= 40, "afterwards the policy decided by itself"
    assert not run.compiled


def test_equal_scores(here, fireworld, answer):
    done = fireworld("explain", "easiest.mcap", "easiest.mcap")
    assert done.code == 0
    assert "there is no difference to explain" in done.out
    assert answer("explain", "easiest.mcap", "easiest.mcap")["difference"] == 0.0


WRONG = {
    "other-seed.mcap": "other-seed.mcap: seed: expected 1, as in easiest.mcap: other seeds give different ",
    "other-scenario.mcap": "other-scenario.mcap: scenario: expected quick (",
    "stopped.mcap": "stopped.mcap: expected a run that has reached its end, got one that stopped at step 20; ",
    "none.mcap": "none.mcap",
}


@pytest.mark.parametrize("name", WRONG)
def test_runs_that_cannot_be_compared(here, fireworld, name):
    done = fireworld("explain", "easiest.mcap", name)
    assert (done.code, done.out) == (2, "")
    assert WRONG[name] in done.err
    assert len(done.err.splitlines()) == 1


def test_another_last_step(here, fireworld):
    assert fireworld("run", "quick", "--policy", "chief", "--steps", 9, "--record", "short.mcap").code == 0
    done = fireworld("explain", "easiest.mcap", "short.mcap")
    assert done.code == 2
    assert "short.mcap: steps: expected at most 60, as in easiest.mcap, got at most 9" in done.err


def test_ctrl_c_shows_what_is_known(here, fireworld, interruptible, monkeypatch):
    score, n_calls, seen = CounterfactualRun.score, 0, Event()

    def interrupting(self, forced):
        nonlocal n_calls
        n_calls += 1
        if n_calls == 5:
            os.kill(os.getpid(), signal.SIGINT)
        if n_calls >= 5:
            seen.wait(0.3)
        return score(self, forced)

    monkeypatch.setattr(CounterfactualRun, "score", interrupting)
    done = fireworld("explain", "random.mcap", "chief.mcap", "--json")
    assert done.code == 130
    known = json.loads(done.out)
    assert known["interrupted"]
    assert known["n_replays"] < known["n_stretches"]
    assert f"interrupted after {known['n_replays']} replays" in done.err


def test_states_that_would_fill_the_memory_are_not_saved(recordings, monkeypatch):
    log, other = open_log(recordings / "easiest.mcap"), open_log(recordings / "chief.mcap")
    better = RecordedDecisions(other)
    built, make = build_recorded(log.header), lambda: find_policy("easiest").policy
    whole = prepare_counterfactuals(built, log, better, make)
    monkeypatch.setattr(counterfactual, "STATE_BYTES_MAX", 1)
    bare = prepare_counterfactuals(built, log, better, make)
    assert [*whole.states] == [*range(10, 61, 10)]
    assert not bare.states
    spans = find_spans(whole.recorded, better, n_brigades=built.n_brigades)
    assert bare.score(spans[-1:]) == whole.score(spans[-1:])


def test_a_difference_too_small_to_share_out_is_shown_in_points(here, fireworld):
    for name, policy in (("rule.mcap", "chief"), ("other.mcap", "each-another")):
        assert fireworld("run", "quick", "--policy", policy, "--record", name).code == 0
    told = fireworld("explain", "rule.mcap", "other.mcap").out
    assert "that is less than 1 % of the highest score: changes of it, no shares\n" in told
    assert " %" not in told.replace("1 %", "")
    assert "all that were tried at once: score 4.94551, +0.0271 of the difference" in told
