"""Cities as official maps: what is written is read again as it was."""

from __future__ import annotations

from dataclasses import fields, is_dataclass

import numpy as np
import pytest

import fireworld as fw
from fireworld.city.formats.json_text import plan_text
from fireworld.city.formats.official.corners import placed
from fireworld.city.formats.official.measuring import exact_measures
from fireworld.city.generator import generate_plan
from fireworld.errors import OutputError
from tests.city.official.maps import scenario_text, street_of_three, write_map
from tests.real_data import real_file


def differing(one, other, prefix=""):
    """Name the fields in which two plans differ; what a plan says of itself is left out."""
    found = []
    for item in fields(one):
        mine, theirs = getattr(one, item.name), getattr(other, item.name)
        if item.name in {"name", "source", "notes"}:
            continue
        if is_dataclass(mine):
            found += differing(mine, theirs, f"{prefix}{item.name}.")
        elif isinstance(mine, np.ndarray):
            found += [] if mine.dtype == theirs.dtype and np.array_equal(mine, theirs) else [prefix + item.name]
        elif mine is not theirs:
            found.append(prefix + item.name)
    return found


@pytest.mark.parametrize("named", [True, False])
def test_a_map_comes_back_as_it_was(tmp_path, named):
    places = {"refuge": [12], "fire": [11], "civilian": [13, 13, 1], "firebrigade": [2, 12], "hydrant": [1]}
    drawn = street_of_three(named=named)
    drawn.area("building", 15, [(50, 6), (58, 7), (57.5, 15), (49.25, 14.125), (50, 6)])  # touches road 2 at a corner
    folder = write_map(tmp_path / "m", drawn.text(), scenario=scenario_text(**places))
    made = fw.import_city(folder, output=tmp_path / "m.json", write_scenario=tmp_path / "m.yaml")
    back = fw.export_city(tmp_path / "m.yaml", tmp_path / "again")
    assert list(back.differences) == []
    again = fw.import_city(tmp_path / "again", output=tmp_path / "a.json", write_scenario=tmp_path / "a.yaml")
    assert differing(made.plan, again.plan) == []
    one, other = (fw.Scenario.from_yaml(text, folder=tmp_path) for text in (made.scenario_text, again.scenario_text))
    for key in ("fires", "civilians", "brigades", "steps", "resolved_parameters"):
        assert getattr(one, key) == getattr(other, key), key


SLOW = [pytest.param(name, marks=pytest.mark.slow) for name in ("kobe", "sakae")]


@pytest.mark.parametrize("name", ["test", *SLOW])
def test_real_maps_come_back_as_they_were(tmp_path, name):
    folder = real_file(f"maps/{name}")
    older = folder / "scenario-2020.xml"
    fires = [254] if name == "test" else None
    made = fw.import_city(
        folder, scenario=older if older.exists() else None, fires=fires,
        output=tmp_path / "m.json", write_scenario=tmp_path / "m.yaml",
    )  # fmt: skip
    assert list(fw.export_city(tmp_path / "m.yaml", tmp_path / "again").differences) == []
    assert differing(made.plan, fw.import_city(tmp_path / "again").plan) == []


@pytest.mark.parametrize("hydrants", [0.0, 0.4])
def test_a_generated_city_serves_the_official_program(tmp_path, hydrants):
    plan = generate_plan(columns=6, rows=5, seed=3, hydrant_share=hydrants)
    (tmp_path / "c.json").write_text(plan_text(plan))
    back = fw.export_city(tmp_path / "c.json", tmp_path / "c")
    (line,) = back.differences
    assert "roads are laid along the streets, with an entrance to every building" in line
    assert differing(plan.footprints, back.plan.footprints) == []
    assert (back.plan.streets.entrance_node >= 0).all()
    ours, theirs = (one.streets.node_mm[one.streets.hydrant_node] for one in (plan, back.plan))
    assert np.abs(ours - theirs).max(initial=0) <= 1500
    once_more = fw.export_city(tmp_path / "c", tmp_path / "d")
    assert list(once_more.differences) == []
    assert differing(back.plan, once_more.plan) == []


def test_a_scenario_is_written_with_its_parameters(tmp_path):
    scenario = fw.Scenario(
        city={"generated": {"columns": 4, "rows": 3}},
        fires=[{"buildings": [5]}, {"buildings": [2], "step": 9}],
        civilians={"at": [6, 6, 7]},
        parameters={"brigades": {"tank_litres": 8000}, "fire": {"water_unburnt_share": 0.25}},
        steps=77,
    )
    back = fw.export_city(scenario, tmp_path / "m")
    assert any("1 fires of later steps: left out" in line for line in back.differences)
    made = fw.import_city(tmp_path / "m", output=tmp_path / "m.json", write_scenario=tmp_path / "m.yaml")
    again = fw.Scenario.from_yaml(made.scenario_text, folder=tmp_path)
    ours, theirs = scenario.resolved_parameters, again.resolved_parameters
    assert theirs.brigades.tank_litres == 8000
    assert theirs.fire.water_unburnt_share == 0.25
    assert theirs.health.slight_damage == ours.health.slight_damage
    assert (again.steps, again.fires[0].buildings, again.civilians.at) == (77, (5,), (6, 6, 7))


def test_negative_coordinates_are_moved(tmp_path):
    (tmp_path / "c.json").write_text('{"buildings": [{"id": 1, "apexes": [-9500,-20,500,-20,500,9980,-9500,9980]}]}')
    back = fw.export_city(tmp_path / "c.json", tmp_path / "c")
    assert any("all is moved by" in line for line in back.differences)
    assert not any("otherwise" in line for line in back.differences)


@pytest.mark.parametrize("centroid", [(4999, 5000), (5000, 5001), (5001, 4999)])
def test_corners_are_found_for_a_centroid(centroid):
    square = [(0, 0), (10_001, 0), (10_001, 10_001), (0, 10_001)]
    found = placed(square, centroid, None)
    if centroid[0] >= 5000 and centroid[1] >= 5000:
        assert exact_measures(found)[0] == centroid
    assert [(int(x), int(y)) for x, y in found] == square


def test_folders_of_others_stay(tmp_path):
    (tmp_path / "m").mkdir()
    (tmp_path / "m" / "mine.txt").write_text("x")
    with pytest.raises(OutputError, match=r"mine\.txt in it"):
        fw.export_city("quick", tmp_path / "m", force=True)
    assert [path.name for path in (tmp_path / "m").iterdir()] == ["mine.txt"]
