"""Fires that are lit at later steps, people in one building and on roads, brigades at places."""

from __future__ import annotations

import numpy as np
import pytest

import fireworld as fw
from fireworld.errors import ScenarioError
from fireworld.simulation.built import build_scenario
from tests.simulation.town import play, policy_named

CITY = {"generated": {"columns": 6, "rows": 5, "seed": 4}}
QUIET = {"city": CITY, "fires": [{"buildings": [7], "step": 4}, {"buildings": [22], "step": 9}], "steps": 30}


def test_a_fire_is_lit_in_its_step_and_the_run_waits_for_it():
    run = fw.run(QUIET, policy="nearest-to-me", seed=1)
    codes = np.array([record.buildings.fieryness for record in run])
    position = {building: at for at, building in enumerate(run.city.building_id.tolist())}
    assert (codes[:4] == 0).all()
    assert codes[3, position[7]] == 0
    assert codes[4, position[7]] in {1, 5}  # the brigades are near, and may put it out at once
    assert codes[8, position[22]] == 0
    assert codes[9, position[22]] in {1, 5}
    assert len(run) >= 10  # with the start
    assert run[len(run) - 1].terminated


@pytest.mark.parametrize("actions", ["fixed", "each-another"])
def test_whole_episodes_and_single_steps_agree(actions):
    built = build_scenario(fw.Scenario.from_dict(QUIET))
    one, other = built.world(seed=2), built.world(seed=2)
    policy = policy_named(actions)
    last = one.run(policy.for_brigades(one.n_brigades))
    play(other, policy)
    assert last == other.step_number >= 9
    assert one.outcome == other.outcome
    assert np.array_equal(one.state.fire.energy, other.state.fire.energy)


def test_a_later_fire_replays(tmp_path):
    fw.run(QUIET, policy="best", seed=3, record=tmp_path / "a.mcap")
    assert fw.verify(tmp_path / "a.mcap").same


def test_a_fire_in_a_burning_building_changes_nothing():
    fires = [{"buildings": [7]}, {"buildings": [8], "step": 2}]
    with pytest.raises(ScenarioError, match=r"fires\.1\.buildings: expected buildings that no other fire takes"):
        fw.run({**QUIET, "fires": [fires[0], {"buildings": [7], "step": 2}]})
    assert fw.run({**QUIET, "fires": fires}).city is not None


def test_several_people_in_one_building_and_brigades_at_places():
    scenario = {**QUIET, "civilians": {"at": [3, 3, 3, 9]}, "brigades": {"n": 3, "at": [5, 11]}}
    run = fw.run(scenario, steps=1)
    assert run.city.building_id[run.city.civilian_building].tolist() == [3, 3, 3, 9]
    start = run[0].brigades
    assert (start.x_m[0], start.y_m[0]) == (start.x_m[2], start.y_m[2]) != (start.x_m[1], start.y_m[1])


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (
            {"civilians": {"at": [999]}},
            r"civilians\.at: expected ids of buildings of generated-6x5-4, got unknown ids: 999",
        ),
        ({"brigades": {"at": [888]}}, r"brigades\.at: expected ids of buildings of generated"),
        ({"city": {**CITY, "hydrants": [1]}}, r"city\.hydrants: expected ids of roads of generated"),
        ({"city": {**CITY, "refuges": [77]}}, r"city\.refuges: expected ids of buildings of generated"),
        ({"city": {**CITY, "gas_stations": [5, 5]}}, r"city\.gas_stations: expected each entry once"),
        ({"city": {**CITY, "scenario": "x.xml"}}, r"city\.scenario: expected null without `official`"),
        ({"fires": [{"buildings": [7], "step": 0}]}, r"fires\.0\.step: expected a whole number from 1 to 100000"),
        ({"city": {"official": "nowhere"}}, r"nowhere: expected a map, got No such file or directory"),
    ],
)
def test_places_that_are_not_there(change, line):
    with pytest.raises(fw.FireworldError, match=line):
        fw.run({**QUIET, **change})


def test_other_refuges_and_gas_stations():
    run = fw.run({**QUIET, "city": {**CITY, "refuges": [2], "gas_stations": [3]}}, steps=1)
    assert run.city.building_id[run.city.refuge_building].tolist() == [2]
    assert run.city.inflammable.sum() == 29
