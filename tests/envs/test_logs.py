"""Every form, given the decisions of a log, does what is recorded: of all policies, and where brigades die."""

from __future__ import annotations

import pytest

import fireworld as fw
from tests.envs.extra import MISSING, needs_extra
from tests.envs.towns import HOT, LATER, SMALL, deadly

pytestmark = needs_extra()

if not MISSING:
    from fireworld.envs.check.logs import FOLLOWERS, follow

AT_ONCE = ("worlds", "team", "whole team", "vector")
IN_TURN = ("turns", "brigade")
POLICIES = ("easiest", "each-another", "random", "chief", "best", "paper-cooperative")


def recorded(path, scenario, policy, choices, **options):
    """Record a run and open its log."""
    fw.run(scenario, policy=policy, seed=4, set={"choices": choices}, record=path, **options)
    return fw.open_log(path)


@pytest.mark.parametrize("policy", POLICIES)
@pytest.mark.parametrize("scenario", [SMALL, LATER], ids=["small", "later"])
def test_logs_are_followed(scenario, policy, tmp_path):
    for choices, forms in (("simultaneous", AT_ONCE), ("in-turn", IN_TURN)):
        run = recorded(tmp_path / f"{choices}.mcap", scenario, policy, choices)
        for form in forms:
            assert follow(form, run) == len(run) - 1 > 3


def test_all_forms_are_followed():
    assert {*AT_ONCE, *IN_TURN} == set(FOLLOWERS)


@pytest.mark.parametrize("policy", ["random", "best"])
def test_logs_in_which_brigades_die(policy, tmp_path):
    """Their city comes with the log."""
    scenario = deadly(tmp_path)
    for choices, forms in (("simultaneous", AT_ONCE), ("in-turn", ("turns",))):
        run = recorded(tmp_path / f"{choices}.mcap", scenario, policy, choices)
        assert (run[-1].brigades.hp > 0).tolist() == [False, True, False]
        for form in forms:
            assert follow(form, run) == len(run) - 1 == 25


@pytest.mark.parametrize("kind", ["stock", "change"])
def test_logs_of_other_rewards(kind, tmp_path):
    weights = {"of": kind, "burning": -2.5, "civilians": 0.125}
    run = recorded(tmp_path / "a.mcap", {**HOT, "reward": weights}, "random", "in-turn", steps=12)
    for form in IN_TURN:
        assert follow(form, run) == 12


def test_a_brigade_among_others_that_choose_at_once(tmp_path):
    for policy in POLICIES:
        run = recorded(tmp_path / f"{policy}.mcap", SMALL, policy, "simultaneous")
        assert follow("brigade", run) == len(run) - 1
