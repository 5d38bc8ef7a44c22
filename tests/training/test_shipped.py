"""The teams that come with fireworld: found by name, known where they come from, recorded with their file."""

from __future__ import annotations

import json
import pickle

import numpy as np
import pytest
from fireworld_recorder.reader import open_log

from benchmarks.shipped import COMMANDS
from fireworld.errors import PolicyError
from fireworld.policy.names import find_policy
from fireworld.policy.teams import team_names, team_path
from fireworld.policy.teams.table_team import TableTeam
from fireworld.policy.teams.team import load_team
from fireworld.training.curriculum import load_curriculum
from fireworld.training.methods.rollouts import Rollouts
from fireworld.training.methods.sarsa import PAPER
from fireworld.training.methods.search import Search
from fireworld.training.methods.targets import Targets
from fireworld.training.training import check_same

SHAPES = {"paper-cooperative": (4, 4320, 4), "paper-noncooperative": (1, 270, 4)}
CURRICULA = {
    "paper-cooperative": load_curriculum("paper"),
    "paper-noncooperative": load_curriculum("paper").only(["alone"]),
}


def test_the_papers_teams_are_there():
    assert {*SHAPES, "best", "best-2026", "sarsa"} == set(COMMANDS) <= set(team_names())


@pytest.mark.parametrize(
    ("name", "method", "curriculum", "seed"),
    [
        ("best", Rollouts(), "conditions", 2026),
        ("best-2026", Search(), "contested", 1),
        ("sarsa", Targets(), "contested", 1),
    ],
)
def test_teams_of_other_methods_come_from_the_shipped_curricula(name, method, curriculum, seed):
    team = load_team(name)
    wanted = method.trainer(load_curriculum(curriculum), seed=seed).identity
    check_same(team.provenance, wanted, team_path(name))
    parts = "lessons" if name == "sarsa" else "generations"
    assert team.provenance[f"{parts}_done"] == getattr(method, f"n_{parts}")
    assert team.own_targets


@pytest.mark.parametrize("name", SHAPES)
def test_a_team_comes_from_the_shipped_curriculum(name):
    """Training again takes half a minute: `python -m benchmarks.shipped` does. This finds a curriculum that changed."""
    team = load_team(name)
    assert team.tables.shape == SHAPES[name]
    wanted = PAPER.trainer(CURRICULA[name], seed=1).identity
    origin = team.provenance
    assert {key: origin["curriculum"][key] for key in ("name", "digest")} == wanted["curriculum"]
    check_same({"method": origin["method"]}, {"method": wanted["method"]}, team_path(name))
    assert origin["seed"] == 1
    assert origin["scenarios_done"] == CURRICULA[name].n_scenarios
    assert team_path(name).stat().st_size < 300_000


@pytest.mark.parametrize("name", COMMANDS)
def test_by_its_name(name):
    named = find_policy(name)
    assert named.name == name
    assert named.attachments == {"policy.npz": team_path(name).read_bytes()}
    assert named.digest == find_policy(str(team_path(name))).digest


@pytest.mark.parametrize("name", COMMANDS)
def test_it_shows_itself(name):
    team = load_team(name)
    network = ("NetworkTeam", "own targets")
    kinds = {"best": network, "sarsa": network, "best-2026": ("RankingTeam", "own targets")}
    kind, what = kinds.get(name, ("TableTeam", "states"))
    assert repr(team).startswith(f"<{kind}: ")
    assert what in repr(team)
    assert repr(team).endswith(f"digest {team.digest[:12]}>")
    assert team._repr_html_().count("<table>") == (2 if kind == "NetworkTeam" else 1)
    assert team.digest in team._repr_html_()
    assert pickle.loads(pickle.dumps(team)).policy().digest == team.policy().digest  # noqa: S301 - our own


def test_run_and_recorded(here, fireworld):
    words = ("run", "quick", "--policy", "paper-noncooperative", "--steps", 5)
    done = fireworld(*words, "--record", "a.mcap", "--json")
    assert (done.code, done.err) == (0, "")
    assert json.loads(done.out)["policy"] == "paper-noncooperative"
    header = open_log(here / "a.mcap").header
    assert header.policy == "paper-noncooperative"
    assert header.attachments["policy.npz"] == team_path("paper-noncooperative").read_bytes()
    assert fireworld("verify", "a.mcap").code == 0


def test_help_and_hints_name_them(fireworld):
    text = "".join(fireworld("run", "--help").out.split())  # lines may end within a name
    for name in team_names():
        assert name in text
    with pytest.raises(PolicyError, match=r"one of .*paper-noncooperative.*; try paper-cooperative$"):
        find_policy("paper-coperative")


def test_any_team_in_the_folder_is_found(tmp_path, monkeypatch):
    monkeypatch.setattr("fireworld.policy.teams._FOLDER", tmp_path)
    assert team_names() == []
    TableTeam(np.zeros((1, 270, 4)), np.zeros((1, 270, 4), dtype=np.int64)).save(tmp_path / "mine.npz")
    assert team_names() == ["mine"]
    assert find_policy("mine").policy.tables.shape == (1, 270, 4)
