"""`fireworld city`: import, export, show."""

from __future__ import annotations

import json

import pytest

from tests.city.official.maps import scenario_text, street_of_three, write_map

PLACES = {"refuge": [12], "fire": [11], "civilian": [13, 2], "firebrigade": [1, 2], "gasstation": [13], "hydrant": [1]}


@pytest.fixture
def town(here):
    return write_map(here / "town", street_of_three().text(), scenario=scenario_text(**PLACES))


def test_from_a_folder_to_a_picture_of_a_fire(town, here, fireworld):
    made = fireworld("city", "import", "town", "-o", "town.json", "--write-scenario", "town.yaml")
    assert made.code == 0
    assert made.out.splitlines()[:2] == [
        "town: 3 buildings, 66 m by 32 m",
        "2 roads, 1 refuge, 1 hydrant, 2 entrances",
    ]
    assert "- 1 buildings without an entrance from a road: reached from the nearest point of" in made.out
    assert made.out.endswith("wrote town.json\nwrote town.yaml\n")
    assert max(map(len, made.out.splitlines())) <= 80
    assert fireworld("run", "town.yaml", "--steps", "5", "--record", "town.mcap").code == 0
    assert fireworld("verify", "town.mcap").code == 0
    shown = fireworld("city", "show", "town.json", "-o", "town.svg")
    assert (shown.code, shown.out) == (0, "town.svg: 3 buildings\n")
    drawn = (here / "town.svg").read_text()
    for text in ("wood (1)", "R   refuge (1)", "G   gas station (1)", "hydrant (1)", "entrance (2)", "road (2)"):
        assert f"<!-- {text} -->" in drawn
    assert "<!-- town, a map of the RoboCup Rescue simulation -->" in drawn


def test_a_report_as_json(town, fireworld):
    found = json.loads(fireworld("city", "import", "town", "-o", "t.json", "--attribution", "By Ada", "--json").out)
    assert (found["n_buildings"], found["n_roads"], found["n_entrances"]) == (3, 2, 2)
    keys = {item["key"]: item["ids"] for item in found["report"]}
    assert keys["no-entrance"] == [13]
    assert json.loads(fireworld("info", "t.json", "--json").out)["source"]["attribution"] == "By Ada"


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("--write-scenario", "t.yaml"), "; try --fires ID,... with ids of buildings"),
        (("--fires", "11"), "--fires goes with --write-scenario"),
        (("--fires", "11,x", "--write-scenario", "t.yaml"), "--fires: expected ids of buildings, separated by commas"),
        (("--config", "nowhere"), "nowhere: expected a folder with *.cfg, got no folder"),
        (("--links", "nowhere.npz"), "nowhere.npz: expected a file that can be read"),
        (("--scenario", "nowhere.xml"), "nowhere.xml: expected a scenario.xml, got No such file or directory"),
    ],
)
def test_what_cannot_be_imported(here, fireworld, words, line):
    write_map(here / "town", street_of_three().text(), scenario=scenario_text(refuge=[12]))
    refused = fireworld("city", "import", "town", "-o", "t.json", *words)
    assert refused.code == 2
    assert line in refused.err
    assert not (here / "t.json").exists()
    assert not (here / "t.yaml").exists()


def test_there_and_back(town, here, fireworld):
    fireworld("city", "import", "town", "-o", "a.json")
    made = fireworld("city", "export", "a.json", "-o", "again")
    assert (made.code, made.out) == (0, "wrote again: 3 buildings\n")
    assert fireworld("city", "import", "again", "-o", "b.json").code == 0
    one, other = (json.loads((here / name).read_text()) for name in ("a.json", "b.json"))
    for key in ("buildings", "roads", "passages", "hydrants"):
        assert one[key] == other[key], key
    found = json.loads(fireworld("city", "export", "a.json", "-o", "again", "--force", "--json").out)
    assert found == {"folder": "again", "n_buildings": 3, "differences": []}


def test_what_cannot_be_exported_or_drawn(here, fireworld):
    for words in (("export", "nowhere.json", "-o", "out"), ("show", "nowhere.json"), ("export", "nobody", "-o", "out")):
        refused = fireworld("city", *words)
        assert refused.code == 2
        assert "expected" in refused.err
    (here / "empty").mkdir()
    assert "expected a folder with map.gml or map.gml.gz" in fireworld("city", "show", "empty").err
    assert fireworld("city", "show", "quick", "-o", "quick.jpg").code == 2
    assert not (here / "out").exists()
