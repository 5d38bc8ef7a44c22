"""`new_scenarios`: fires that are contested, in cities of every kind, and the files that they are written to."""

from __future__ import annotations

import hashlib
import json
import re
import shlex
from dataclasses import replace
from threading import Event

import numpy as np
import pytest

import fireworld as fw
from benchmarks import contested as shipped
from fireworld.city.formats.json_text import plan_text
from fireworld.errors import CityError, FireworldError, OutputError, ScenarioError
from fireworld.evaluation.fire_base import base_of
from fireworld.evaluation.growth import FirePlace, Grown, grow, usual_counts
from fireworld.evaluation.judge import Judge
from fireworld.interrupt import Interrupted
from fireworld.scenario import load_scenario
from fireworld.scenario.document import Civilians
from fireworld.simulation.placement import scenario_plan
from fireworld.training.curriculum import load_curriculum
from tests.city.official.maps import scenario_text, street_of_three, write_map
from tests.real_data import real_file

TOWN = plan_text(scenario_plan(load_scenario("quick")))
SMALL = {"set": {"city.generated.columns": 10, "city.generated.rows": 8, "steps": 60}, "brigades": 2, "seeds": 2}


@pytest.fixture(scope="module")
def small():
    return fw.new_scenarios(n=2, **SMALL)


class Told:
    """A judge who is told from how many burning buildings on a fire is not held, and lost."""

    def __init__(self, contested_from, lost_from):
        self.ends, self.asked = (contested_from, lost_from), []

    def __call__(self, base, place, count, judge):
        self.asked.append(count)
        verdict = "lost" if count >= self.ends[1] else "contested" if count >= self.ends[0] else "held"
        return Grown(place=place, n_burning=count, verdict=verdict)


@pytest.mark.parametrize(
    ("ends", "counts", "grown", "asked"),
    [
        ((3, 9), range(1, 10), (3, "contested"), [1, 2, 3]),
        ((9, 99), [1, 2, 4, 8, 16], (16, "contested"), [1, 2, 4, 8, 16]),
        ((9, 12), [1, 2, 4, 8, 16, 32], (10, "contested"), [1, 2, 4, 8, 16, 12, 10]),
        ((9, 9), [4, 8, 16], (9, "lost"), [4, 8, 16, 12, 10, 9]),
        ((1, 1), [4, 8], (4, "lost"), [4]),
        ((50, 60), [4, 8], (8, "held"), [4, 8]),
    ],
)
def test_a_fire_grows_until_it_is_not_held(monkeypatch, ends, counts, grown, asked):
    told = Told(*ends)
    monkeypatch.setattr("fireworld.evaluation.growth._judged", told)
    place = FirePlace(1, ((0.5, 0.5),), Civilians(n=0))
    found = grow(load_scenario("quick"), place, counts, Judge((1,)))
    assert (found.n_burning, found.verdict) == grown
    assert told.asked == asked


@pytest.mark.parametrize(
    ("n_fires", "n_inflammable", "counts"),
    [
        (1, 1, [1]),
        (1, 11, [1, 2, 3, 4]),
        (3, 40, [3, 4, 6, 8, 12, 16]),
        (1, 600, [1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64]),
        (9, 4, [9]),
    ],
)
def test_the_usual_numbers(n_fires, n_inflammable, counts):
    assert usual_counts(n_fires, n_inflammable) == counts


def test_burning_buildings_are_shared_out():
    place = FirePlace(1, ((0.1, 0.1), (0.9, 0.9), (0.5, 0.5)), Civilians(n=0))
    assert [fire.n_buildings for fire in place.lit(load_scenario("quick"), 8).fires] == [3, 3, 2]


def test_what_is_found_is_contested(small):
    assert small.complete
    assert [check.name for check in small.checks] == ["generated-10x8-1-fire-1", "generated-10x8-1-fire-2"]
    again = fw.check_scenarios(small.scenarios, seeds=2)
    assert [check.verdict for check in again.checks] == ["contested"] * 2
    assert [check.rules for check in again.checks] == [check.rules for check in small.checks]
    assert all(check.brigades_matter for check in again.checks)
    assert len({check.scenario.digest for check in again.checks}) == 2
    assert {check.n_burning for check in again.checks} == {
        grown.n_burning for grown in small.tried if grown.verdict == "contested" and grown.brigades_matter
    }


def test_the_same_seed_finds_the_same(small):
    for executor in (1, 4):
        again = fw.new_scenarios(n=2, executor=executor, **SMALL)
        assert again.scenarios == small.scenarios
        assert repr(again) == repr(small)
    other = fw.new_scenarios(n=1, seed=2, **SMALL)
    assert other.scenarios[0].city.generated.seed == 2
    assert other.scenarios[0].fires != small.scenarios[0].fires


def test_files_are_scenarios_and_a_curriculum(small, tmp_path):
    files = small.save(tmp_path / "fires.yaml")
    assert [file.name for file in files] == ["fires.yaml", "fires-1.yaml", "fires-2.yaml"]
    read = [load_scenario(file) for file in files[1:]]
    assert [one.digest for one in read] == [one.digest for one in small.scenarios]
    curriculum = load_curriculum(files[0])
    assert [one.digest for one in curriculum.scenarios] == [one.digest for one in small.scenarios]
    assert [(stage.name, stage.cooperation) for stage in curriculum.stages] == [("contested", True)]
    text = files[1].read_text()
    assert "parameters" not in text
    assert "brigades: {n: 2}\n" in text
    head = " ".join(line[2:] for line in text.splitlines() if line.startswith("# "))
    options = re.search("`fireworld scenarios new (.*?)`", head)[1]
    assert shlex.split(options)[:8] == ["--seed", "1", "--n", "2", "--brigades", "2", "--seeds", "2"]
    assert f"score {small.checks[0].score_share:.2f} of the maximum" in head
    before = {file: file.read_bytes() for file in files}
    files[0].unlink()
    with pytest.raises(OutputError, match=r"fires-1\.yaml: expected a name that is free"):
        small.save(tmp_path / "fires.yaml")
    assert sorted(tmp_path.iterdir()) == sorted(files[1:])
    small.save(tmp_path / "fires.yaml", force=True)
    assert {file: file.read_bytes() for file in files} == before


def test_one_fire_is_one_file(tmp_path, monkeypatch):
    found = fw.new_scenarios(output=tmp_path / "own.yaml", **SMALL)
    assert found.files == (tmp_path / "own.yaml",)
    read = load_scenario(tmp_path / "own.yaml")
    assert (read.name, read.digest) == ("own", found.scenarios[0].digest)
    monkeypatch.setattr("fireworld.evaluation.new_scenarios.base_of", None)  # refused before any work
    with pytest.raises(OutputError, match="use --force"):
        fw.new_scenarios(output=tmp_path / "own.yaml", **SMALL)


def test_a_city_file_is_named_from_the_folder_of_the_scenario(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for folder in ("cities", "fires"):
        (tmp_path / folder).mkdir()
    (tmp_path / "cities" / "town.json").write_text(TOWN)
    found = fw.new_scenarios("cities/town.json", output="fires/town.yaml", seeds=1)
    assert "city: {file: ../cities/town.json}\n" in (tmp_path / "fires" / "town.yaml").read_text()
    assert load_scenario("fires/town.yaml").digest == found.scenarios[0].digest
    assert found.options == "--city cities/town.json --seed 1 --seeds 1"


def test_a_digest_that_a_city_must_have_stays(tmp_path):
    (tmp_path / "town.json").write_text(TOWN)
    digest = hashlib.sha256(TOWN.encode()).hexdigest()
    pinned = load_scenario("quick").with_values({"city": {"file": str(tmp_path / "town.json"), "sha256": digest}})
    fw.new_scenarios(pinned, output=tmp_path / "a.yaml", seeds=1)
    assert f"city: {{file: town.json, sha256: {digest}}}" in (tmp_path / "a.yaml").read_text()


def test_places_are_buildings_that_burn(small):
    base = base_of("quick", seed=5, brigades=None, civilians=None, values={})
    places = [*base.places(5, n_places=300, n_fires=2)]
    assert len({place.at for place in places}) == len(places) > 200
    footprints = base.plan.footprints
    low, high = footprints.outline_mm.min(axis=0).astype(int), footprints.outline_mm.max(axis=0).astype(int)
    burning = footprints.centroid_mm[footprints.inflammable != 0]
    for place in places[:50]:
        for at in place.at:
            away = np.abs(burning - (low + np.array(at) * (high - low))).max(axis=1)
            assert away.min() < 50  # mm
    assert all(place.civilians == load_scenario("quick").civilians for place in places)


def test_people_are_near_but_not_in_the_fire():
    base = base_of(None, seed=1, brigades=None, civilians=None, values={})
    people = [place.civilians for place in base.places(1, n_places=50, n_fires=1)]
    assert {one.n for one in people} == {8, 9, 10, 11}
    assert min(one.from_m for one in people) > 50
    assert max(one.to_m for one in people) < 400
    small = base_of(None, seed=1, brigades=None, civilians=None, values={"city.generated": {"columns": 3, "rows": 3}})
    assert {place.civilians.n for place in small.places(1, n_places=9, n_fires=1)} == {1}


@pytest.mark.parametrize(
    ("city", "civilians", "found"),
    [
        ("quick", None, Civilians(n=4, from_m=35.0, to_m=90.0)),
        ("quick", 7, Civilians(n=7, from_m=35.0, to_m=90.0)),
        ("quick", 0, Civilians(n=0)),
        (None, 0, Civilians(n=0)),
    ],
)
def test_people_of_a_scenario_stay(city, civilians, found):
    base = base_of(city, seed=1, brigades=None, civilians=civilians, values={})
    (place,) = base.places(1, n_places=1, n_fires=1)
    assert place.civilians == found


def test_of_a_map_brigades_people_and_configuration_are_taken(tmp_path):
    people = {"refuge": [12], "civilian": [13, 13], "firebrigade": [1, 2]}
    config = {"resq-fire": "resq-fire.water_capacity : 9000\n", "common": "kernel.timesteps : 40\n"}
    write_map(tmp_path / "town", street_of_three().text(), scenario=scenario_text(**people), **config)
    base = base_of(tmp_path / "town", seed=1, brigades=None, civilians=None, values={})
    scenario = base.scenario
    assert (scenario.preset, scenario.steps) == ("official-2013", 40)
    assert scenario.resolved_parameters.brigades.tank_litres == 9000
    assert (scenario.brigades.n, scenario.brigades.at) == (2, (1, 2))
    places = [*base.places(1, n_places=20, n_fires=1)]
    assert {place.civilians.at for place in places} == {(13, 13)}
    found = fw.new_scenarios(tmp_path / "town", seeds=1, lost_below=0.0, held_above=0.001, places=20)
    for check in found.checks:
        assert check.scenario.city.official == str(tmp_path / "town")
        assert check.scenario.city.sha256 is None
    write_map(tmp_path / "bare", street_of_three().text(), scenario=scenario_text(refuge=[12]))
    bare = base_of(tmp_path / "bare", seed=1, brigades=3, civilians=2, values={})
    assert bare.scenario.brigades.n == 3
    assert {place.civilians.n for place in bare.places(1, n_places=5, n_fires=1)} == {2}


def test_what_is_missing_is_said(tmp_path):
    found = fw.new_scenarios(
        output=tmp_path / "none.yaml", places=3, seeds=1, lost_below=0.0, held_above=1e-9, counts=[1], brigades=4
    )
    assert not found.complete
    assert found.files == ()
    assert [*tmp_path.iterdir()] == []
    assert found.sentence.startswith("0 of 1 contested fire found at 3 places: ")
    assert "; try " in found.sentence
    values = json.loads(json.dumps(found.to_dict()))
    assert values["complete"] is False
    assert [place["number"] for place in values["places"]] == [1, 2, 3]
    with pytest.raises(OutputError, match="expected a contested fire to write, got"):
        found.save(tmp_path / "none.yaml")


@pytest.mark.parametrize(
    ("verdicts", "sentence"),
    [
        (["held", "held", "lost"], "2 held with 4 to 5 burning buildings, 1 lost with 6 burning buildings; try fewer"),
        (
            ["held", "lost", "lost"],
            "1 held with 4 burning buildings, 2 lost with 5 to 6 burning buildings; try more br",
        ),
        ([None, "lost"], "1 lost with 5 burning buildings, 1 without room for people and fire; try more brigades"),
        (["even", "even"], "2 where it makes hardly a difference what brigades do; try people nearer to the fire"),
    ],
)
def test_what_became_of_the_places(small, verdicts, sentence):
    tried = tuple(
        Grown(
            place=small.tried[0].place,
            n_burning=4 + k,
            verdict="held" if verdict == "even" else verdict,
            brigades_matter=verdict != "even",
        )
        for k, verdict in enumerate(verdicts)
    )
    found = replace(small, checks=(), tried=tried, n_wanted=3)
    assert found.sentence.startswith(f"0 of 3 contested fires found at {len(tried)} places: {sentence}")


def test_places_without_room_are_left_out(monkeypatch):
    real = FirePlace.lit

    def crowded(self, base, n_burning):
        scenario = real(self, base, n_burning)
        return scenario.with_values({"civilians.n": 5000}) if self.number == 1 else scenario

    monkeypatch.setattr(FirePlace, "lit", crowded)
    found = fw.new_scenarios(**SMALL)
    assert found.complete
    assert found.tried[0].verdict is None
    assert "civilians.n" in str(found.tried[0].error)


def test_what_it_shows(small):
    lines = repr(small).splitlines()
    assert max(map(len, lines)) <= 80
    assert lines[0].split() == ["fire", "at", "burning", "mean", "lowest", "highest", "no", "water"]
    assert lines[-1].startswith("2 contested fires found at ") or lines[-2].startswith("2 contested fires found at ")
    assert small._repr_html_().count("<tr>") == 1 + 2


def test_it_stops_when_asked(tmp_path):
    stop = Event()
    stop.set()
    with pytest.raises(Interrupted, match="interrupted; nothing is written"):
        fw.new_scenarios(output=tmp_path / "a.yaml", stop=stop, **SMALL)
    assert [*tmp_path.iterdir()] == []


@pytest.mark.parametrize(
    ("given", "error", "message"),
    [
        ({"n": 0}, FireworldError, "n: expected a whole number from 1 to 1000, got 0"),
        (
            {"n_fires": 3, "counts": [1, 2]},
            FireworldError,
            "counts: expected a number of at least 3, one for each fire",
        ),
        ({"civilians": -1}, FireworldError, "civilians: expected a whole number from 0"),
        (
            {"set": {"fires.0.n_buildings": 3}},
            FireworldError,
            "set: fires.0.n_buildings: expected keys other than fires",
        ),
        ({"output": "fire.txt"}, OutputError, "expected a file ending in .yaml, .yml"),
        ({"output": "none/fire.yaml"}, OutputError, "expected an existing folder none"),
        ({"city": "nowhere.json"}, ScenarioError, "city.file: expected a city file, got No such file"),
        ({"city": "nowhere"}, ScenarioError, "expected the name of a scenario"),
        ({"city": "tests"}, CityError, "expected a folder with map.gml"),
        ({"city": 7}, FireworldError, "city: expected the path of a file, got 7"),
        ({"civilians": 5000}, ScenarioError, "civilians.n: expected at most"),
        ({"seed": -1}, FireworldError, "seed: expected a whole number"),
    ],
)
def test_mistakes(given, error, message, here):
    (here / "tests").mkdir()
    with pytest.raises(error, match=re.escape(message)):
        fw.new_scenarios(**{"seeds": 1, **given})


def test_a_city_where_nothing_burns(tmp_path):
    city = json.loads(TOWN)
    for building in city["buildings"]:
        building |= {"inflammable": False}
    (tmp_path / "stone.json").write_text(json.dumps(city))
    with pytest.raises(ScenarioError, match="city: expected buildings that can burn, got"):
        fw.new_scenarios(tmp_path / "stone.json")


def test_the_shipped_curricula_begin_as_they_are_made_today():
    """All of them are made again by `python -m benchmarks.contested --check`."""
    text = (shipped.FOLDER / "contested.yaml").read_text()
    first = next(shipped.fires_of_city(5000))
    entries = [line.removeprefix("      - ") for line in text.splitlines() if line.startswith("      - ")]
    assert shipped.settings(first) == entries[0]
    assert shipped.settings(first, times=shipped.LARGER) == entries[80]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["test", "kobe"])
def test_real_maps_have_contested_fires(tmp_path, name):
    found = fw.new_scenarios(real_file(f"maps/{name}"), output=tmp_path / "a.yaml", seeds=2)
    assert found.complete
    again = fw.check_scenarios(tmp_path / "a.yaml", seeds=2)
    assert again.checks[0].rules == found.checks[0].rules
    assert again.checks[0].verdict == "contested"
