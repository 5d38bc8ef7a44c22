"""Teams by condition: fires of a curriculum, and others like them that are drawn."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.by_condition import main, more_than
from benchmarks.drawn_fires import FIRST_CITY, drawn_fires
from fireworld.errors import ScenarioError
from fireworld.simulation.built import CityCache
from fireworld.training.curriculum import load_curriculum
from tests.training.generations import CONDITIONS, read

TEAMS = ["easiest", "nearest-to-me"]


def stages_of(name):
    return {stage.name: stage.scenarios for stage in load_curriculum(name).stages}


def table(monkeypatch, capsys, *arguments):
    monkeypatch.setattr("sys.argv", ["by_condition", *TEAMS, *arguments])
    main()
    head, _, *rows = [
        [cell.strip() for cell in line.strip("| ").split("|")] for line in capsys.readouterr().out.splitlines()
    ]
    return head, rows


def test_drawn_fires_are_elsewhere_and_have_team_and_conditions_of_their_models():
    stages = stages_of("conditions")
    for name, n_fires in (("few-brigades", 1), ("three-sites", 3), ("official-like", 1)):
        models = stages[name]
        found = [built.scenario for built in drawn_fires(models, 6, CityCache(), seed=3)]
        assert len({scenario.digest for scenario in found}) == 6
        assert all(scenario.city.generated.seed >= FIRST_CITY for scenario in found)
        assert all(len(scenario.fires) == n_fires for scenario in found)
        assert {scenario.brigades.n for scenario in found} <= {model.brigades.n for model in models}
        assert {scenario.civilians.n for scenario in found} <= {8, 9, 10, 11}
        most = max(sum(fire.n_buildings for fire in model.fires) for model in models)
        assert all(sum(fire.n_buildings for fire in scenario.fires) <= 1.3 * most + 1 for scenario in found)
    models = stages["little-refill"]
    first, again, others = (
        [one.scenario.digest for one in drawn_fires(models, 4, CityCache(), seed=s)] for s in (1, 1, 2)
    )
    assert first == again
    assert not set(first) & set(others)


def test_what_a_team_saves_more_than_the_first_has_its_error(tmp_path, monkeypatch, capsys):
    read(CONDITIONS, tmp_path)
    (file,) = tmp_path.glob("*.yaml")
    for arguments in (["--seeds", "1"], ["--drawn", "3"]):
        head, rows = table(monkeypatch, capsys, "--curriculum", str(file), *arguments)
        assert head == ["team", "mean", "more than easiest", "usual", "many"]
        assert [row[0] for row in rows] == TEAMS
        assert rows[0][2] == "+0.000 ± 0.000"
        difference = float(rows[1][1]) - float(rows[0][1])
        assert abs(float(rows[1][2].partition(" ")[0]) - difference) <= 0.0011


def test_the_error_of_a_mean_over_conditions():
    assert more_than([np.array([0.1, 0.3]), np.array([0.0, 0.0])]) == "+0.100 ± 0.050"
    assert more_than([np.array([0.1, 0.3]), np.array([0.0])]) == "+0.100", "one fire has no spread"


def test_cities_without_room_for_such_fires():
    (model, *_) = stages_of("conditions")["few-brigades"]
    crowded = model.with_values({"fires.0.n_buildings": 100_000})
    with pytest.raises(ScenarioError, match="fires: expected room for 2 like these, got room for 0"):
        drawn_fires([crowded], 2, CityCache(), seed=1)


@pytest.mark.parametrize("odd", ["-1", "many", "2.5"])
def test_a_number_of_drawn_fires_that_is_none(monkeypatch, capsys, odd):
    with pytest.raises(SystemExit, match="2"):
        table(monkeypatch, capsys, "--drawn", odd)
    assert f"--drawn: expected a number of fires, got {odd}" in capsys.readouterr().err
