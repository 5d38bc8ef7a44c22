"""Why a team prefers a target: what the features add comes to the difference of the values that are on record."""

from __future__ import annotations

import json

import numpy as np
import pytest

import fireworld as fw
from fireworld.arguments import ArgumentError
from fireworld.errors import TrainingError
from fireworld.policy.teams.network_layers import FEATURES, OWN_SEEN
from fireworld.policy.teams.ranking_team import RankingTeam
from fireworld.policy.teams.team import load_team
from tests import command_line
from tests.networks import make_network

STEP = 12


def recorded(team, folder, scenario="test-1", **options):
    """A run of a team, on record; where the team is none of fireworld's, its file."""
    if not isinstance(team, str):
        team.save(folder / "team.npz")
        team = str(folder / "team.npz")
    fw.run(scenario, policy=team, seed=3, record=folder / "a.mcap", **options)
    return fw.open_log(folder / "a.mcap")


def assigned_team():
    return RankingTeam(np.random.default_rng(7).normal(size=(1, 17)), True, assigned=True)


def named_team(own_targets):
    return RankingTeam(np.random.default_rng(5).normal(size=(2, 17)), own_targets)


@pytest.mark.parametrize(
    "team",
    [
        named_team(own_targets=True),
        named_team(own_targets=False),
        make_network(features=FEATURES),
        make_network(len(OWN_SEEN), 9, 1, features=OWN_SEEN, own_targets=True),
        make_network(len(OWN_SEEN), 9, 4, 1, features=OWN_SEEN, own_targets=True, activation="relu"),
    ],
    ids=["ranking", "ranking-of-actions", "network-of-actions", "network", "relu"],
)
def test_the_parts_add_up_to_the_difference_of_the_values_on_record(team, tmp_path):
    run = recorded(team, tmp_path)
    found = fw.preferences(team, run, step=STEP)
    values = run.step(STEP).decisions.target_value
    assert any(one.other is not None for one in found.brigades)
    for one in found.brigades:
        assert one.chosen_value == pytest.approx(values[one.brigade], rel=1e-6)
        if one.other is None:  # all four actions name one building
            continue
        assert one.chosen_value >= one.other_value
        difference = one.chosen_value - one.other_value
        assert sum(share.part for share in one.shares) == pytest.approx(difference, rel=0.02, abs=0.005)
        assert [abs(share.part) for share in one.shares] == sorted((abs(s.part) for s in one.shares), reverse=True)


def test_a_feature_of_a_ranking_adds_its_weight_times_what_it_differs_by(tmp_path):
    run, team = recorded("best-2026", tmp_path), load_team("best-2026")
    weights = {weight.name: values[0] for weight, values in team.by_size}
    for one in fw.preferences("best-2026", run, step=1).brigades:
        for share in one.shares:
            assert share.part == pytest.approx(weights[share.feature] * (share.chosen - share.other))


def test_where_allocation_is_free_targets_of_other_sites_count(tmp_path):
    scenario = {
        "name": "two",
        "city": {"generated": {"seed": 7, "columns": 12, "rows": 12}},
        "fires": [{"at": [0.2, 0.2], "n_buildings": 3}, {"at": [0.8, 0.8], "n_buildings": 3}],
        "brigades": {"n": 2, "allocation": "free"},
        "steps": 30,
    }
    team = make_network(len(OWN_SEEN), 1, features=OWN_SEEN, own_targets=True, activation=())
    free = recorded(team, tmp_path, scenario)
    named = {one.chosen for one in fw.preferences(team, free, step=1).brigades}
    named |= {one.other for one in fw.preferences(team, free, step=1).brigades}
    (tmp_path / "b").mkdir()
    fixed = recorded(team, tmp_path / "b", {**scenario, "brigades": {"n": 2}})
    assert named != {b for one in fw.preferences(team, fixed, step=1).brigades for b in (one.chosen, one.other)}


def test_a_run_of_another_team_is_looked_at_with_this_ones_eyes(tmp_path):
    found = fw.preferences("best", recorded("easiest", tmp_path), step=STEP)
    assert any("though the team would go for" in one.text for one in found.brigades)
    assert str(found).startswith(f"step {STEP}\nbrigade ")
    assert "<table" in found._repr_html_()


def test_a_target_that_the_team_could_not_have_named_has_no_value(tmp_path):
    run = recorded("best", tmp_path)
    found = [fw.preferences(named_team(own_targets=False), run, step=step) for step in range(1, 60, 6)]
    strange = [one for of in found for one in of.brigades if one.chosen_value is None]
    assert strange
    assert all(one.text.endswith(f"{one.chosen}, which the team could not have named") for one in strange)
    assert json.loads(json.dumps([of.as_dict() for of in found], allow_nan=False))


def test_the_command_line_prints_the_same(tmp_path, monkeypatch):
    recorded("best", tmp_path)
    monkeypatch.chdir(tmp_path)
    words = ("policy", "show", "best", "--log", "a.mcap", "--step", str(STEP))
    done = command_line.call(monkeypatch, *words, "--json")
    assert json.loads(done.out) == json.loads(json.dumps(fw.preferences("best", "a.mcap", step=STEP).as_dict()))
    shown = command_line.call(monkeypatch, *words, "--limit", "3").out
    assert shown.startswith(f"step {STEP}: brigade 0 goes for ")
    assert "... and 23 more" in shown
    for words, wanted in (
        (("best", "--step", "3"), "--step needs --log"),
        (("best", "1193", "--log", "a.mcap", "--step", "3"), "no STATE"),
        (("paper-cooperative", "--log", "a.mcap", "--step", "3"), "team: expected a ranking or a network, got tables"),
        (("best", "--log", "a.mcap", "--step", "3000"), "step: expected a whole number from 1 to "),
    ):
        done = command_line.call(monkeypatch, "policy", "show", *words)
        assert (done.code, wanted in done.err) == (2, True), done.err


def test_errors_are_named(tmp_path):
    run = recorded("best", tmp_path)
    with pytest.raises(ArgumentError, match="step: expected a whole number from 1"):
        fw.preferences("best", run, step=0)
    with pytest.raises(TrainingError, match="a ranking or a network"):
        fw.preferences("paper-cooperative", run, step=1)


def test_an_assigned_brigade_is_told_what_targets_are_worth_to_it_alone(tmp_path):
    run = recorded(assigned_team(), tmp_path)
    found = fw.preferences(assigned_team(), run, step=STEP)
    values = run.step(STEP).decisions.target_value
    assert found.brigades
    for one in found.brigades:
        assert one.chosen_value == pytest.approx(values[one.brigade], rel=1e-6), "what is on record"
        if one.other is not None:
            difference = one.chosen_value - one.other_value
            assert sum(share.part for share in one.shares) == pytest.approx(difference, abs=1e-6)
            assert ("though alone it would be given" in one.text) == (difference < 0)
    assert any(one.other is not None for one in found.brigades)
