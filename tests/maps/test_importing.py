"""Maps as city and scenario files."""

from __future__ import annotations

import numpy as np
import pytest

import fireworld as fw
from fireworld.errors import CityError, FireworldError, OutputError, ScenarioError
from tests.city.official.maps import scenario_text, street_of_three, write_map

CONFIG = {
    "resq-fire": "resq-fire.water_capacity : 9000\nfire.tank.refill_rate = 700\nresq-fire.gamma: 0.21\n"
    "resq-fire.water_distance: 30000\n",
    "misc": "misc.injury.fire.slight: 6\nmisc.injury.fire.wood.none.slight: 0.3\n"
    "misc.injury.fire.steel.all.slight: 0.4\n",
    "common": "kernel.timesteps : 40\n",
}
PLACES = {
    "refuge": [12], "fire": [11, 11, 12], "civilian": [13, 13, 2, 13], "firebrigade": [1, 2, 12], "policeforce": [1],
}  # fmt: skip


@pytest.fixture
def town(tmp_path):
    return write_map(tmp_path / "town", street_of_three().text(), scenario=scenario_text(**PLACES), **CONFIG)


def test_a_map_becomes_a_city_and_a_fire_in_it(town, tmp_path):
    made = fw.import_city(town, output=tmp_path / "town.json", write_scenario=tmp_path / "town.yaml")
    scenario = fw.Scenario.from_yaml((tmp_path / "town.yaml").read_text(), folder=tmp_path)
    parameters = scenario.resolved_parameters
    assert parameters.brigades.tank_litres == 9000
    assert parameters.brigades.refuge_refill_litres == 700  # by its second name
    assert parameters.brigades.range_m == 30.0
    assert parameters.fire.water_unburnt_share == 0.21
    assert (parameters.health.slight_damage, parameters.health.slight_probability) == (6.0, 0.3)
    assert scenario.steps == 40
    assert scenario.fires[0].buildings == (11,)
    assert scenario.civilians.at == (13, 13, 2, 13)
    assert (scenario.brigades.n, scenario.brigades.at) == (3, (1, 2, 12))
    keys = [finding.key for finding in made.report.findings]
    assert {"fires-left-out", "left-out", "injuries"} <= set(keys)
    run = fw.run(tmp_path / "town.yaml")
    assert run.city.civilian_building.tolist() == [2, 2, -1, 2]
    start = run[0].brigades
    assert np.stack([start.x_m, start.y_m], axis=1).tolist() == [[10.0, 3.0], [35.0, 3.0], [36.0, 6.0]]


def test_fires_are_named(town, tmp_path):
    fw.import_city(town, fires=[13], output=tmp_path / "t.json", write_scenario=tmp_path / "t.yaml")
    assert fw.Scenario.from_yaml((tmp_path / "t.yaml").read_text(), folder=tmp_path).fires[0].buildings == (13,)


@pytest.mark.parametrize(
    ("places", "fires", "line"),
    [
        ({"refuge": [12]}, None, "fires: expected a scenario.xml with fires, got .*; try --fires ID,..."),
        ({"refuge": [12], "fire": [12]}, None, "expected a scenario.xml with fires"),
        (PLACES, [12], "fires.0.buildings: expected inflammable buildings, got building 12, which cannot burn"),
        (PLACES, [2], "fires.0.buildings: expected ids of buildings of town, got unknown ids: 2"),
        ({"fire": [11]}, None, "city: expected a city with a refuge"),
    ],
)
def test_fires_that_cannot_be(town, tmp_path, places, fires, line):
    write_map(town, street_of_three().text(), scenario=scenario_text(**places))
    with pytest.raises(ScenarioError, match=line):
        fw.import_city(town, fires=fires, output=tmp_path / "t.json", write_scenario=tmp_path / "t.yaml")
    assert not (tmp_path / "t.json").exists()
    assert not (tmp_path / "t.yaml").exists()


def test_parameters_out_of_bounds(town, tmp_path):
    write_map(town, street_of_three().text(), scenario=scenario_text(**PLACES), misc="misc.injury.fire.slight: -1\n")
    with pytest.raises(CityError, match=r"misc\.cfg: misc\.injury\.fire\.slight: expected a number at least 0 and"):
        fw.import_city(town, write_scenario=tmp_path / "t.yaml")


def test_links_that_are_given(town, tmp_path):
    links = {
        "conn_ptr": np.array([0, 1, 3, 3]),
        "conn_idx": np.array([1, 2, 0]),
        "conn_val": np.float32([0.5, 0.1, 0.2]),
    }
    np.savez(tmp_path / "links.npz", **links)
    made = fw.import_city(town, links=tmp_path / "links.npz", output=tmp_path / "t.json")
    assert made.plan.links.share.tolist() == links["conn_val"].tolist()
    city = fw.run({"city": {"file": str(tmp_path / "t.json")}, "fires": [{"buildings": [11]}], "steps": 3}).city
    assert city.link_ptr.tolist() == [0, 1, 3, 3]
    assert city.link_building.tolist() == [1, 0, 2]  # rising


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"conn_ptr": np.array([0, 1, 3])}, "conn_ptr: expected 4 numbers, one more than there are buildings, got"),
        ({"conn_ptr": np.array([0, 2, 1, 3])}, "conn_ptr: expected rising numbers from 0 to the number of links, 3"),
        ({"conn_idx": np.array([0, 2, 0])}, "expected links to other buildings, got building 0 linked with itself"),
        ({"conn_idx": np.array([1, 2, 3])}, r"conn_idx\[2\]: expected a whole number from 0 to 2, got 3"),
        ({"conn_val": np.array([0.5, 0.1])}, "conn_val: expected 3 numbers, one for each link, got"),
        ({"conn_val": np.array([0.5, 0.1, 2.0])}, r"conn_val\[2\]: expected a number from 0 to 1, got 2.0"),
        ({"id": np.array([1, 2, 3])}, "id: expected the ids of the 3 buildings of the city, in its order"),
    ],
)
def test_links_that_do_not_fit(town, tmp_path, change, line):
    links = {"conn_ptr": np.array([0, 1, 3, 3]), "conn_idx": np.array([1, 2, 0]), "conn_val": np.array([0.5, 0.1, 0.2])}
    np.savez(tmp_path / "links.npz", **{**links, **change})
    with pytest.raises(FireworldError, match=line):
        fw.import_city(town, links=tmp_path / "links.npz", output=tmp_path / "t.json")
    assert not (tmp_path / "t.json").exists()


def test_the_map_itself_is_never_replaced(town):
    before = (town / "map.gml").read_bytes()
    with pytest.raises(OutputError, match="a file of its own for every input and output"):
        fw.import_city(town, output=town / "map.gml", force=True)
    assert (town / "map.gml").read_bytes() == before


def test_files_that_exist_stay(town, tmp_path):
    (tmp_path / "t.json").write_text("mine")
    with pytest.raises(OutputError, match="expected a name that is free"):
        fw.import_city(town, output=tmp_path / "t.json")
    assert (tmp_path / "t.json").read_text() == "mine"
    fw.import_city(town, output=tmp_path / "t.json", force=True)
    assert (tmp_path / "t.json").read_text() != "mine"
