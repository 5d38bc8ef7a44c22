"""Team files of earlier formats are read as ever; those that come with fireworld stay byte for byte."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
import pytest

from fireworld.policy.teams import team_names, team_path
from fireworld.policy.teams.ranking_team import RankingTeam
from fireworld.policy.teams.table_team import TableTeam
from fireworld.policy.teams.team import load_team
from fireworld.training.training import Training
from tests.training.conftest import SHORT

DATA = Path(__file__).parent / "data"
TABLES, RANKING = DATA / "fireworld-team-1.npz", DATA / "fireworld-ranking-1.npz"
SHIPPED = {
    "best": "f3b3f8c1bdfb2234",
    "best-2026": "042f726d665698a3",
    "paper-cooperative": "5eaa625114742317",
    "paper-noncooperative": "eb891902f38f8b04",
    "sarsa": "034968e452eec513",
}


def test_tables_of_format_1():
    team = load_team(TABLES)
    assert isinstance(team, TableTeam)
    assert team.digest == "c5fcfd079e1b85179c2fb48b3c41bd587d1a8501b42e78b9f90135680ec29fa4"
    assert team.policy().digest == "a97f9e3e026bedf001d647a63450c313edc1c4ad39bef05bb8617c414207d902"
    assert (team.tables.shape, team.commit, team.choices) == ((1, 270, 4), 2, "in-turn")
    assert team.visits.sum() > 0
    assert team.origin[0] == "trained in tiny, 2 scenarios, seed 1"
    assert team.provenance["method"]["name"] == "paper"


def test_a_ranking_of_format_1():
    team = load_team(RANKING)
    assert isinstance(team, RankingTeam)
    assert team.digest == "627612edce9d173797abbadbe6c3cc80c61ff759d7070f1e15eb2acc7c3609b1"
    assert team.policy().digest == "5ae1b0c2015a154ad3870a22ed37718f9f3f6dd1cc88feb10cf529ccaf8e8239"
    assert (team.weights.shape, team.own_targets) == ((1, 17), True)
    assert team.origin[0] == "trained in tiny, 4 generations, seed 1"
    assert {"weights", "own_targets", "format"}.isdisjoint(team.provenance)


@pytest.mark.parametrize("path", [TABLES, RANKING], ids=lambda path: path.stem)
def test_written_in_the_new_format(tmp_path, path):
    old = load_team(path)
    old.save(tmp_path / "a.npz")
    new = load_team(tmp_path / "a.npz")
    assert (new.digest, new.provenance) == (old.digest, old.provenance)
    assert not new.difference(old).as_dict()["changed"]
    with np.load(tmp_path / "a.npz") as opened:
        assert b'"format": "fireworld-team/2"' in opened["header"].tobytes()


def test_a_training_that_is_done_in_an_old_file(curriculum, here):
    (here / "a.npz").write_bytes(TABLES.read_bytes())
    trainer = SHORT.with_settings({"commit": 2}).trainer(curriculum.only(["alone"]), seed=1)
    training = Training(trainer, here / "a.npz")
    assert training.resume()
    assert training.team.digest == load_team(TABLES).digest


def test_the_teams_that_come_with_fireworld():
    assert {name: hashlib.sha256(team_path(name).read_bytes()).hexdigest()[:16] for name in team_names()} == SHIPPED
