"""Extracts of OpenStreetMap as city files, scenarios and films; every complaint."""

from __future__ import annotations

import bz2
import gzip
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import fireworld as fw
from fireworld.city.formats.osm import kinds, reading
from fireworld.city.formats.osm.reader import STREETS
from fireworld.city.summary import load_plan
from fireworld.errors import CityError, FireworldError, ScenarioError
from fireworld.maps.osm import ATTRIBUTION
from fireworld.recording.pages.run_page import report
from tests.city.osm.extracts import LATITUDE, LONGITUDE, Drawing, place_of, town
from tests.real_data import real_file

osmium = pytest.importorskip("osmium")


@pytest.fixture
def extract(tmp_path):
    return town().write(tmp_path / "town.osm")


def findings(made):
    """Numbers, or texts, of an import's findings by key."""
    return {one.key: str(one) if one.n is None else one.n for one in made.report.findings}


def as_pbf(xml, path):
    """Write an extract as .pbf, with osmium's own writer."""
    reader = osmium.io.Reader(str(xml))
    writer = osmium.SimpleWriter(str(path), header=reader.header())
    reader.close()
    for one in osmium.FileProcessor(str(xml)):
        writer.add(one)
    writer.close()
    return path


def test_a_town(extract):
    made = fw.import_osm(extract)
    plan = made.plan
    assert plan.name == "town"
    assert len(plan.footprints.building_id) == 16
    assert plan.footprints.building_id.tolist() == list(range(1, 17))
    assert set(plan.footprints.floors.tolist()) == {2}
    assert plan.footprints.ground_area_m2.tolist() == pytest.approx([120] * 16, abs=1)
    assert plan.footprints.refuge.tolist() == [1] + [0] * 15
    assert plan.footprints.inflammable.tolist() == [0] + [1] * 15
    assert len(plan.streets.node_mm) == 25 + 1  # a node for the hydrant
    assert len(plan.streets.hydrant_node) == 1
    assert np.abs(plan.streets.node_mm).max() == pytest.approx(40_000, abs=30)
    assert plan.attribution == ATTRIBUTION
    assert findings(made) == {
        "floors": 16, "materials": 0, "nodes": 25, "oneway": "one-way streets are driven both ways", "hydrants": 1,
        "stations": 1,
    }  # fmt: skip


def test_all_kinds_of_files_make_one_city(extract, tmp_path):
    text = extract.read_bytes()
    (tmp_path / "town.osm.gz").write_bytes(gzip.compress(text))
    (tmp_path / "town.osm.bz2").write_bytes(bz2.compress(text))
    as_pbf(extract, tmp_path / "town.osm.pbf")
    whole = fw.import_osm(extract).plan
    for ending in ("osm.gz", "osm.bz2", "osm.pbf"):
        plan = fw.import_osm(tmp_path / f"town.{ending}").plan
        assert plan.name == "town"
        assert plan.source_id == whole.source_id
        for room in ("footprints", "streets"):
            for name, array in vars(getattr(whole, room)).items():
                assert (array == getattr(getattr(plan, room), name)).all(), name


def troubled() -> Drawing:
    """One of each trouble, and two sound buildings."""
    drawing = Drawing()
    drawing.box(0, 0, 20, 20, osm_id=11)
    drawing.box(0, 0, 20, 20, osm_id=12)  # the same again
    drawing.box(5, 5, 9, 9, osm_id=13)  # within the first
    drawing.box(18, 0, 40, 20, osm_id=14, building="office", height="12")  # overlaps it
    drawing.box(50, 0, 52, 2, osm_id=15)  # small
    drawing.way((60, 0), (70, 0), (70, 10), osm_id=16, building="yes")  # open
    drawing.way((60, 20), 4_999_999_999, (70, 30), (60, 20), osm_id=17, building="yes")  # lost a node
    drawing.box(80, 0, 90, 10, osm_id=18, building="no")
    drawing.box(80, 20, 90, 30, osm_id=19, building__part="yes")
    drawing.box(80, 40, 90, 50, osm_id=20, building="yes", layer="-1")
    drawing.ring((0, 60), (20, 80), (20, 60), (0, 90), osm_id=21, building="yes")  # crosses itself
    outer = drawing.box(40, 40, 80, 80, osm_id=31, building="yes")
    inner = drawing.box(50, 50, 70, 70, osm_id=32, height="1")
    drawing.box(55, 55, 65, 65, osm_id=33)  # in the courtyard
    drawing.relation([(outer, "outer"), (inner, "inner")], osm_id=41, building="apartments", building__levels="5")
    drawing.relation([(99, "outer")], osm_id=42, building="yes")
    drawing.relation([(outer, "outer")], osm_id=43, landuse="residential")
    drawing.node(100, 100, building="yes")
    drawing.way((-10, -10), (100, -10), (200, -10), highway="primary", oneway="yes")
    drawing.way((100, 200), (140, 200), highway="service")  # leads nowhere
    drawing.way((0, -10), (0, 100), highway="footway")
    return drawing


def test_every_trouble_is_counted(tmp_path):
    made = fw.import_osm(troubled().write(tmp_path / "a.osm"))
    assert made.plan.source_id == ("w11", "w14", "w21", "w33", "r41")
    assert made.plan.footprints.floors.tolist() == [2, 4, 2, 2, 5]
    found = findings(made)
    assert {key: found[key] for key in found if key not in {"materials", "nodes", "oneway"}} == {
        "incomplete": 1, "open": 1, "underground": 1, "outlines": 1, "duplicates": 1, "slivers": 1, "covered": 1,
        "overlapping": 1, "parts": 1, "points": 1, "courtyards": 1, "floors": 1, "separate-streets": 1,
        "far-buildings": 3, "no-station": 2,
    }  # fmt: skip
    block = made.plan.footprints
    assert block.ground_area_m2[4] == pytest.approx(1600 - 400, abs=2)
    assert len(made.plan.notes) == 1  # the reader's: outlines that touch themselves
    assert "buildings 3, 5;" in made.plan.notes[0]
    assert made.report.lines[0] == made.plan.source["report"][0]


def test_the_area_is_chosen(extract, tmp_path):
    at_corner = place_of(-30, -30)
    assert len(fw.import_osm(extract, radius_m=25).plan.source_id) == 4
    made = fw.import_osm(extract, around=at_corner, radius_m=15)
    assert made.plan.source_id == fw.import_osm(extract).plan.source_id[:1]
    assert made.plan.footprints.centroid_mm.tolist() == [[0, 0]] or np.abs(made.plan.footprints.centroid_mm).max() < 20
    low, high = place_of(-40, -40), place_of(0, 40)
    assert len(fw.import_osm(extract, box=(*low, *high)).plan.source_id) == 8
    free = Drawing(bounds_m=None)
    free.box(0, 0, 20, 20)
    plan = fw.import_osm(free.write(tmp_path / "free.osm")).plan
    assert np.abs(plan.footprints.centroid_mm).max() <= 12  # in the middle of its nodes
    assert len(plan.streets.street) >= 1  # footpaths


def test_materials_depend_on_seed_and_building_alone(extract):
    whole, part = fw.import_osm(extract).plan, fw.import_osm(extract, radius_m=25).plan
    by_id = dict(zip(whole.source_id, whole.footprints.material.tolist(), strict=True))
    assert [by_id[one] for one in part.source_id] == part.footprints.material.tolist()
    others = [fw.import_osm(extract, seed=seed).plan.footprints.material.tolist() for seed in range(2, 6)]
    assert len({tuple(one) for one in others}) > 1


def test_the_same_city_in_every_process(extract):
    program = (
        "import hashlib, sys, fireworld as fw;"
        "print(hashlib.sha256(fw.import_osm(sys.argv[1]).city_text.encode()).hexdigest())"
    )
    digests = set()
    for hash_seed in ("0", "1", "77"):
        environment = {**os.environ, "PYTHONHASHSEED": hash_seed}
        done = subprocess.run(
            [sys.executable, "-c", program, str(extract)], env=environment, capture_output=True, check=True
        )
        digests.add(done.stdout)
    assert len(digests) == 1


def test_files_are_read_back_with_the_ids_of_their_source(extract, tmp_path):
    made = fw.import_osm(extract, output=tmp_path / "town.json", write_scenario=tmp_path / "town.yaml")
    plan = load_plan(tmp_path / "town.json")
    assert plan.source_id == made.plan.source_id
    assert all(int(one[1:]) > 2**31 and one[0] == "w" for one in plan.source_id)
    assert json.loads(made.city_text)["source"]["format"] == "OpenStreetMap"
    scenario = fw.Scenario.from_yaml((tmp_path / "town.yaml").read_text(), folder=tmp_path)
    assert len(set(scenario.fires[0].buildings) & {6, 7, 10, 11}) == 2  # the four in the middle
    run = fw.run(tmp_path / "town.yaml", steps=5, record=tmp_path / "town.mcap")
    assert run.city.attribution == ATTRIBUTION
    assert fw.open_log(tmp_path / "town.mcap").city.attribution == ATTRIBUTION
    assert fw.verify(tmp_path / "town.mcap").same


def test_fires_and_refuges_are_named_either_way(extract, tmp_path):
    source_id = fw.import_osm(extract).plan.source_id
    made = fw.import_osm(
        extract, refuges=[2, source_id[4]], write_scenario=tmp_path / "t.yaml", fires=[source_id[9], 1, "1"]
    )
    assert np.flatnonzero(made.plan.footprints.refuge).tolist() == [1, 4]
    assert "buildings: [10, 1]" in made.scenario_text
    assert "file: town.json" in made.scenario_text
    with pytest.raises(ScenarioError, match=r"--fires: expected numbers of buildings, 1 to 16, .* got 'w17'"):
        fw.import_osm(extract, write_scenario=tmp_path / "u.yaml", fires=["w17"])
    with pytest.raises(ScenarioError, match="building 2, which cannot burn"):
        fw.import_osm(extract, refuges=[2], write_scenario=tmp_path / "u.yaml", fires=[2])
    with pytest.raises(CityError, match="--refuge: expected the number of a building, 1 to 16"):
        fw.import_osm(extract, refuges=["x"])
    assert not (tmp_path / "u.yaml").exists()


def test_the_nearest_building_to_a_station_is_a_refuge(tmp_path):
    drawing = Drawing()
    for k in range(3):
        drawing.box(40 * k, 0, 40 * k + 20, 20)
    drawing.way((0, -10), (120, -10), highway="residential")
    drawing.box(44, 24, 56, 36, amenity="fire_station")  # grounds beside the second
    drawing.node(0, 200, amenity="fire_station")  # far from all
    made = fw.import_osm(drawing.write(tmp_path / "a.osm"))
    assert made.plan.footprints.refuge.tolist() == [0, 1, 0]
    assert findings(made)["lost-stations"] == 1


BOMB = (
    '<?xml version="1.0"?><!DOCTYPE osm [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]>'
    '<osm version="0.6"><node id="1" lat="1" lon="2"><tag k="building" v="&b;"/></node></osm>'
)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.txt", b"", "a.txt: expected a file ending in .osm, .osm.gz, .osm.bz2, .pbf, .osm.xml, got '.txt'"),
        ("a.osm", b"", "a.osm: expected OpenStreetMap data, got .*no element found"),
        ("a.osm", b'{"buildings": []}', "expected OpenStreetMap data, got .*not well-formed"),
        ("a.osm", b"<gpx/>", "expected OpenStreetMap data, got .*gpx"),
        ("a.osm", BOMB.encode(), "got .*XML entities are not supported"),
        ("a.osm", b'<osm version="0.6"></osm>', "expected OpenStreetMap data with nodes, got none of them"),
        ("a.osm", b'<osm version="0.6"><node id="1" lat="95" lon="2"/></osm>', "with nodes, got none of them"),
        ("a.osm", b'<osm version="0.6"><node id="1" lat="x" lon="2"/></osm>', "wrong format for coordinate"),
        ("a.osm", b'<osm version="0.6"><node id="1" lat="88" lon="2"/></osm>', "bounds: expected bounds"),
        ("a.osm", b'<osm version="0.6"><node id="1" lat="8" lon="2"/></osm>', "expected a building in the area"),
        ("a.osm", b'<osm version="0.6"><node id="1" lat="8" lon="2"/>', "expected OpenStreetMap data"),
        ("a.osm.gz", b"nonsense", "expected OpenStreetMap data"),
        ("a.pbf", b"", "expected OpenStreetMap data, got .*PBF error"),
        ("a.pbf", b"hello world, this is no extract", "expected OpenStreetMap data, got .*PBF error"),
        ("a.osm", b'<osm version="0.6"><node id="99999999999999999999" lat="8" lon="2"/></osm>', "illegal id"),
    ],
)
def test_bad_files(tmp_path, name, content, words):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(CityError, match=words) as caught:
        fw.import_osm(path, output=tmp_path / "out.json")
    assert str(caught.value).startswith(str(path))
    assert not (tmp_path / "out.json").exists()


def test_a_truncated_pbf(extract, tmp_path):
    whole = as_pbf(extract, tmp_path / "whole.pbf").read_bytes()
    for n in range(1, len(whole), max(1, len(whole) // 15)):
        (tmp_path / "cut.pbf").write_bytes(whole[:n])
        with pytest.raises(CityError):
            fw.import_osm(tmp_path / "cut.pbf")


def test_a_file_of_the_time_before_versions(extract, tmp_path):
    old = tmp_path / "old.osm"
    old.write_text(extract.read_text().replace('<osm version="0.6">', "<osm>"))
    assert len(fw.import_osm(old).plan.source_id) == 16


def test_a_missing_file(tmp_path):
    with pytest.raises(CityError, match=r"a\.pbf: expected a file of OpenStreetMap data, got No such file"):
        fw.import_osm(tmp_path / "a.pbf")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"radius_m": 0}, "--radius: expected metres from 1 to 20000, got 0"),
        ({"radius_m": float("nan")}, "--radius: expected metres"),
        ({"radius_m": 1e9}, "--radius: expected metres"),
        ({"around": (LATITUDE, LONGITUDE)}, "--around: expected a radius with it, got 'none'; try --radius 500"),
        ({"around": (95.0, 0.0), "radius_m": 500}, "--around: expected a latitude|--around: expected degrees"),
        ({"around": (0.0, 200.0), "radius_m": 500}, "--around: expected degrees from -180 to 180, got 200"),
        ({"around": (10.0, 10.0), "radius_m": 500}, "--around: expected a place within .*got one beside it"),
        ({"around": place_of(200, 200), "radius_m": 50}, "expected a building in the area, got 'none'; try a larger"),
        ({"radius_m": 50, "box": (0, 0, 1, 1)}, "--box: expected a radius or a box, got 'both'"),
        ({"box": (1, 0, 0, 1)}, "--box: expected south below north"),
        ({"box": (0, 0, 1, 1)}, "--box: expected a place within"),
        ({"box": (40, -35, 50, -30)}, "expected an area of at most 40 km by 40 km"),
        ({"name": ""}, "--name: expected a text"),
        ({"attribution": "a\nb"}, "--attribution: expected a text"),
        ({"seed": -1}, "seed: expected a whole number"),
    ],
)
def test_bad_options(extract, options, words):
    with pytest.raises(FireworldError, match=words):
        fw.import_osm(extract, **options)


def test_without_pyosmium(extract, monkeypatch):
    monkeypatch.setitem(sys.modules, "osmium", None)
    with pytest.raises(CityError, match=r"pyosmium, .* is not installed; try pip install 'fireworld\[osm\]'"):
        fw.import_osm(extract)


def test_the_command(extract, tmp_path, fireworld):
    out = tmp_path / "town.json"
    lat, lon = place_of(0, 0)
    done = fireworld("city", "osm", extract, f"--around={lat},{lon}", "--radius", 200, "-o", out)
    assert done.code == 0, done.err
    lines = done.out.splitlines()
    assert lines[0] == "town: 16 buildings, 72 m by 70 m"
    assert lines[-1] == f"wrote {out}"
    assert max(map(len, lines[:-1])) <= 80
    assert fireworld("city", "osm", extract, "-o", out).code == 2  # it exists
    done = fireworld("city", "osm", extract, "-o", out, "--force", "--json", "--attribution", "Nobody")
    assert json.loads(done.out)["n_buildings"] == 16
    assert {"key", "text", "n", "ids"} == json.loads(done.out)["report"][0].keys()
    assert load_plan(out).attribution == "Nobody"
    for words in (["--around", "1,2,3", "--radius", "5"], ["--box", "a,b,c,d"], ["--fires", "1"]):
        done = fireworld("city", "osm", extract, "-o", tmp_path / "b.json", *words)
        assert done.code == 2
        assert not (tmp_path / "b.json").exists()


def test_who_made_the_map_is_on_every_page(extract, tmp_path):
    pytest.importorskip("matplotlib")
    fw.import_osm(extract, output=tmp_path / "town.json", write_scenario=tmp_path / "town.yaml")
    run = fw.run(tmp_path / "town.yaml", steps=3, record=tmp_path / "a.mcap")
    report(run, tmp_path / "a.html")
    assert f'<p class="credit">Map: {ATTRIBUTION}</p>' in (tmp_path / "a.html").read_text()
    fw.run(tmp_path / "town.yaml", steps=3, policy="chief", record=tmp_path / "b.mcap")
    fw.diff(tmp_path / "a.mcap", tmp_path / "b.mcap").save_html(tmp_path / "d.html")
    assert f'<p class="credit">Map: {ATTRIBUTION}</p>' in (tmp_path / "d.html").read_text()


@pytest.mark.slow
def test_the_middle_of_helsinki(tmp_path):
    path = real_file("osm/Helsinki.osm.pbf")
    made = fw.import_osm(path, radius_m=500, output=tmp_path / "h.json", write_scenario=tmp_path / "h.yaml")
    assert len(made.plan.source_id) > 150
    assert findings(made)["courtyards"] > 20
    assert findings(made)["hydrants"] > 10
    run = fw.run(tmp_path / "h.yaml", steps=60)
    assert int(run.series("buildings.fieryness").max()) >= 2
    whole = fw.import_osm(path)
    assert findings(whole)["hydrants"] == 37
    assert findings(whole)["stations"] == 1
    assert len(whole.plan.source_id) > 420


@pytest.mark.parametrize(("name", "n"), [("southampton-2010.osm.gz", 42), ("fragment-2010.osm", 1)])
def test_extracts_of_2010(name, n):
    assert len(fw.import_osm(real_file(f"osm/{name}")).plan.source_id) == n


def rows_of(page, heading):
    """The first table below a heading line of a page, without its head."""
    lines = page.split(heading, 1)[1].splitlines()
    begin = next(k for k, line in enumerate(lines) if line.startswith("|---"))
    rows = []
    for line in lines[begin + 1 :]:
        if not line.startswith("|"):
            break
        rows.append([cell.strip() for cell in line.strip("|").split("|")])
    return rows


def test_the_page_has_the_tables_of_the_import():
    page = (Path(__file__).parents[2] / "docs" / "openstreetmap.md").read_text(encoding="utf-8")
    written = {}
    for names, floors in rows_of(page, "| kind, by `building` | floors |"):
        written |= dict.fromkeys(names.split(", "), int(floors))
    assert written.pop("all others") == kinds.DEFAULT_FLOORS
    assert written == {kind: n for kind, n in kinds.FLOORS_BY_KIND.items() if n != kinds.DEFAULT_FLOORS}
    groups = {}
    for names, *shares in rows_of(page, "| kinds | wood | steel | concrete |"):
        percent = tuple(int(share.removesuffix(" %")) for share in shares)
        groups |= dict.fromkeys(names.split(", "), percent)
    assert groups.pop("all others") == kinds.OTHER_SHARES
    assert groups.pop("and any other kind with 4 floors or more") == kinds.SHARES["blocks"]
    assert groups.pop("as in generated cities") == kinds.OTHER_SHARES
    assert groups == {kind: kinds.SHARES[group] for kind, group in kinds.GROUP_OF.items()}
    streets = page.split("`highway` = ", 1)[1].split(".", 1)[0].replace(",", " ").replace(" or ", " ").split()
    assert {name.removesuffix("_link") for name in STREETS} <= set(streets)


def test_the_page_has_every_finding():
    page = (Path(__file__).parents[2] / "docs" / "openstreetmap.md").read_text(encoding="utf-8")
    named = {key for keys, _ in rows_of(page, "## What is repaired") for key in re.findall(r"`([a-z-]+)`", keys)}
    source = Path(reading.__file__).read_text(encoding="utf-8")
    assert named == set(re.findall(r'report\.note\w*\(\s*"([a-z-]+)"', source))
