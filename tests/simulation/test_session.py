"""`fireworld.world`: the caller owns the loop, and what happens is what happens in a run."""

import numpy as np
import pytest

import fireworld as fw
from fireworld.arguments import ArgumentError
from fireworld.errors import LogError, PolicyError, ScenarioError
from fireworld.simulation.session import world

QUICK = {"steps": 40}


def finish(session, actions):
    while not session.done:
        session.step(actions)
    return session.outcome


def decisions_of(run):
    """Yield the decisions of each step, as a caller gives them; None of brigades that decided nothing."""
    for actions, targets in zip(run.ragged("decisions.action")[1:], run.ragged("decisions.target")[1:], strict=True):
        yield [
            None if action < 0 else fw.Decision(int(action), target=int(target) if action == 4 else None)
            for action, target in zip(actions, targets, strict=True)
        ]


@pytest.mark.parametrize("policy", ["nearest-to-me", "chief", "best", "random"])
def test_a_policy_does_what_it_does_in_a_run(policy):
    run = fw.run("quick", policy=policy, seed=5, set=QUICK)
    assert finish(world("quick", seed=5, set=QUICK), policy) == run.outcome


@pytest.mark.parametrize("policy", ["each-another", "best", "random"])
@pytest.mark.parametrize("choices", ["in-turn", "simultaneous"])
def test_the_same_decisions_are_the_same_run(policy, choices):
    settings = {**QUICK, "choices": choices}
    run, session = fw.run("quick", policy=policy, seed=2, set=settings), world("quick", seed=2, set=settings)
    results = [session.step(decisions) for decisions in decisions_of(run)]
    assert session.outcome == run.outcome
    assert [result.reward for result in results] == run.series("rewards.total")[1:].tolist()
    assert [result.terminated or result.truncated for result in results] == [False] * (len(run) - 2) + [True]


def test_what_is_seen_is_what_the_first_brigade_sees_in_a_run():
    run, session = fw.run("quick", policy="chief", seed=3, set=QUICK), world("quick", seed=3, set=QUICK)
    for record, decisions in zip(list(run)[1:], decisions_of(run), strict=True):
        seen = session.observe()
        assert [one is not None for one in seen] == [made is not None for made in decisions]
        if seen[0] is not None:
            assert seen[0].state_index == record.observations.state_index[0]
        session.step(decisions)
    assert session.outcome == run.outcome, "looking changes nothing"


def test_actions_by_name_number_or_decision_are_the_same():
    several = ("nearest-to-me", fw.Action.NEAREST_TO_ME, 3, np.int64(3), fw.Decision(3))
    sessions = [world("quick", seed=4, set=QUICK) for _ in several]
    for _ in range(12):
        rewards = {session.step([action] * 2).reward for session, action in zip(sessions, several, strict=True)}
        assert len(rewards) == 1
    assert len({session.snapshot() for session in sessions}) == 1


def test_saved_restored_and_copied():
    session = world("quick", seed=4, set=QUICK)
    for _ in range(9):
        session.step(["easiest"] * session.n_brigades)
    saved, copied = session.snapshot(), session.copy()
    other = world("quick", seed=99, set=QUICK)
    other.restore(saved)
    assert (other.seed, other.step_number) == (4, 9)
    ends = [finish(one, ["nearest-to-me"] * one.n_brigades) for one in (copied, other, session)]
    assert ends[0] == ends[1] == ends[2] == finish_from(saved)
    session.reset()
    assert (session.step_number, session.done) == (0, False)
    session.reset(seed=7)
    assert session.seed == 7


def finish_from(saved):
    session = world("quick", set=QUICK)
    session.restore(bytes(saved))
    return finish(session, "nearest-to-me")


def test_a_step_that_fails_can_be_tried_again():
    run, session = fw.run("quick", policy="easiest", seed=6, set=QUICK), world("quick", seed=6, set=QUICK)
    while not session.done:
        with pytest.raises(PolicyError):
            session.step(["nearest-to-me", "no such action"] if session.observe()[1] else ["no such action", None])
        session.step(["easiest"] * session.n_brigades)
        if session.step_number > 5:
            break
    assert finish(session, ["easiest"] * session.n_brigades) == run.outcome


def test_a_policy_begins_once():
    begun = []

    class Counting(fw.Policy):
        def begin(self, city, n_brigades, seed):
            begun.append((n_brigades, seed))

        def decide(self, observation):
            return "easiest"

    session, policy = world("quick", seed=8, set=QUICK), Counting()
    session.step(policy)
    session.step(policy)
    assert begun == [(2, 8)]
    session.reset()
    session.step(policy)
    assert begun == [(2, 8)] * 2


@pytest.mark.parametrize(
    ("mistake", "error", "message"),
    [
        (lambda one: one.step(["easiest"]), ArgumentError, "expected an action for each of 2 brigades, got 1$"),
        (lambda one: one.step(["easiest", "far"]), PolicyError, "step 1, brigade 1: expected a Decision or an action"),
        (lambda one: one.step([None, "easiest"]), PolicyError, "brigade 0: expected an action: this brigade decides"),
        (lambda one: one.step(7), PolicyError, "expected a policy with a method decide"),
        (lambda one: one.reset(seed=-1), ArgumentError, "seed: expected a whole number from 0 to 4294967295, got -1$"),
        (lambda one: one.restore(b"nothing"), LogError, "snapshot: expected the bytes of a snapshot"),
        (lambda one: one.restore(world("quick").snapshot()), LogError, "snapshot: scenario: expected one of this"),
        (lambda _: world("quick", steps=0), ArgumentError, "steps: expected a whole number from 1 to 100000, got 0$"),
        (lambda _: world("nowhere"), ScenarioError, "expected the name of a scenario"),
        (lambda _: world("quick", set={"brigades": 3}), ScenarioError, "brigades: expected"),
        (lambda _: world("quick", set=["brigades.n=3"]), ArgumentError, "set: expected values by key"),
    ],
)
def test_mistakes(mistake, error, message):
    session = world("quick", set=QUICK)
    with pytest.raises(error, match=message):
        mistake(session)
    assert session.step_number == 0


def test_a_world_that_is_done():
    session = world("quick", steps=1)
    result = session.step("easiest")
    assert result.truncated
    assert session.done
    with pytest.raises(ArgumentError, match=r"got one that is; try reset\(\)"):
        session.step("easiest")
    assert repr(session).startswith("<Session quick, seed 1: done, ")
