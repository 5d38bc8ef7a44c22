"""The command that finds the world most like the paper's: its files are the shipped ones, and it takes the best fit."""

from __future__ import annotations

import shutil

import pytest
from click.testing import CliRunner

from benchmarks import paper_world
from benchmarks.paper_world import ROWS, Fit, World, best_of, fit_of, grid, table, text_of
from fireworld.executors import threads
from fireworld.reproduction import paper
from fireworld.scenario import load_scenario
from fireworld.scenario.shipped import shipped_folder
from fireworld.simulation.built import CityCache

SHIPPED = World(16.0, (0.6, 0.85), 2.0, 167)
NAMES = [row.scenario for row in (*ROWS, *paper.TESTS.table_1)]


@pytest.mark.parametrize("name", NAMES)
def test_shipped_scenarios_are_those_of_a_world_of_the_grid(name):
    path = shipped_folder() / f"{paper.like_the_papers(name)}.yaml"
    assert path.read_text(encoding="utf-8") == text_of(SHIPPED, name)
    assert SHIPPED in grid()
    civilians = {key: getattr(load_scenario(path).civilians, key) for key in ("from_m", "to_m")}
    assert (
        load_scenario(path).digest
        == SHIPPED.scenario(name).with_values({f"civilians.{key}": value for key, value in civilians.items()}).digest
    )


def test_the_papers_own_figures_fit_best():
    theirs = Fit([row.steps[0] for row in ROWS], [row.burnt_out[0] for row in ROWS])
    tenth = Fit([row.steps[0] * 1.1 for row in ROWS], [row.burnt_out[0] / 1.1 for row in ROWS])
    assert theirs.distance == 0.0
    assert tenth.distance == pytest.approx(0.0953, abs=1e-4)
    other = World(8.0, (0.7, 0.97), 1.0, 168)
    assert best_of({other: tenth, SHIPPED: theirs}) is SHIPPED
    *_, first, second = table({other: tenth, SHIPPED: theirs}, 2, todays=tenth)
    assert first.endswith("| 0.00 |")
    assert second.startswith("| streets 8 m, 70% to 97% built, fires x 1, city 168 |")


@pytest.mark.slow
def test_it_is_nearer_to_the_paper_than_todays_tests():
    """By a team that acts at random, on the seeds of the command."""
    ours = fit_of([SHIPPED.scenario(row.scenario) for row in ROWS], CityCache(), threads(2))
    todays = fit_of([load_scenario(row.scenario) for row in ROWS], CityCache(), threads(2))
    assert ours.distance < 0.5 * todays.distance


@pytest.mark.slow
def test_the_command_writes_what_it_chooses_and_checks_it(tmp_path, monkeypatch):
    """On a grid of two worlds, in a folder that has today's scenarios only."""
    for path in shipped_folder().glob("t*.yaml"):
        shutil.copy(path, tmp_path)
    monkeypatch.setattr(paper_world, "grid", lambda: iter((World(8.0, (0.7, 0.97), 1.0, 167), SHIPPED)))
    monkeypatch.setattr(paper_world, "shipped_folder", lambda: tmp_path)
    monkeypatch.setattr(paper_world, "SEEDS", range(500, 502))
    names = sorted(paper.like_the_papers(name) for name in NAMES)
    before = CliRunner().invoke(paper_world.main, ["--check"])
    assert before.exit_code == 1
    assert not [*tmp_path.glob("paper-*")]
    done = CliRunner().invoke(paper_world.main, [])
    assert (done.exit_code, sorted(path.stem for path in tmp_path.glob("paper-*"))) == (0, names)
    for name in names:
        assert (tmp_path / f"{name}.yaml").read_text() == (shipped_folder() / f"{name}.yaml").read_text()
    after = CliRunner().invoke(paper_world.main, ["--check"])
    assert (after.exit_code, after.stdout.splitlines()[-1]) == (0, "all as shipped")
    assert [line.split(" | ")[0] for line in after.stdout.splitlines()[2:5]] == [
        "| the paper, without cooperation",
        "| today's tests",
        "| streets 16 m, 60% to 85% built, fires x 2, city 167",
    ]
