"""City files: what is read, what is refused and in which words, and the way back."""

from __future__ import annotations

import copy
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fireworld.city.formats import json_plan
from fireworld.city.formats.json_plan import parse_plan
from fireworld.city.formats.json_text import plan_text
from fireworld.city.generator import generate_plan
from fireworld.conformance.city_file import load_city_file
from fireworld.errors import CityError
from tests.city.plans import dump_plan

HOUSE = {
    "id": 7,
    "type": "building",
    "apexes": [0, 0, 12000, 0, 12000, 10000, 0, 10000],
    "floors": 2,
    "code": 1,
    "ground_area": 120,
    "x": 6000,
    "y": 5000,
    "inflammable": True,
}
REFUGE = HOUSE | {"id": 9, "type": "refuge", "apexes": [20000, 0, 32000, 0, 32000, 9000], "inflammable": False}
CITY = {
    "name": "two",
    "buildings": [HOUSE, REFUGE],
    "streets": {"nodes": [[0, -4000], [30000, -4000]], "edges": [[0, 1]]},
    "hydrants": [{"id": 900, "x": 29000, "y": 0}],
    "ignitions": [7],
    "water": [],
    "source": {"map": "drawn by hand", "years": [2024]},
}


def parse(document):
    return parse_plan(json.dumps(document).encode(), where="city.json")


def changed(path, value):
    """Copy the city with one value replaced; DELETE takes it out."""
    document = copy.deepcopy(CITY)
    *way, last = path
    place = document
    for key in way:
        place = place[key]
    if value is DELETE:
        del place[last]
    else:
        place[last] = value
    return document


def complaint(text):
    """Return why a file is refused, "" if it is read."""
    try:
        parse_plan(text, where="city.json")
    except CityError as error:
        return str(error)
    return ""


DELETE = object()


def same(one, other):
    for part in ("footprints", "streets"):
        for name, array in vars(getattr(one, part)).items():
            twin = getattr(getattr(other, part), name)
            np.testing.assert_array_equal(array, twin, err_msg=name)
            assert array.dtype == twin.dtype
    return one.name == other.name


def test_a_city_is_read(tmp_path):
    path = tmp_path / "two.json"
    path.write_text(json.dumps(CITY))
    plan = load_city_file(path).plan
    assert plan.name == "two"
    footprints = plan.footprints
    assert footprints.building_id.tolist() == [7, 9]
    assert footprints.refuge.tolist() == [0, 1]
    assert footprints.outline_ptr.tolist() == [0, 4, 7]
    assert footprints.outline_mm.tolist()[4:] == [[20000, 0], [32000, 0], [32000, 9000]]
    assert footprints.centroid_mm.tolist() == [[6000, 5000], [6000, 5000]]
    assert footprints.floors.tolist() == [2, 2]
    assert footprints.material.tolist() == [1, 1]
    assert footprints.inflammable.tolist() == [1, 0]
    assert plan.streets.street.tolist() == [[0, 1]]
    assert plan.streets.hydrant_node.tolist() == [1]  # the nearest
    assert not footprints.outline_mm.flags.writeable


def test_what_a_building_may_leave_out():
    plan = parse({"buildings": [{"id": 3, "apexes": REFUGE["apexes"]}, {"id": 4, "type": "Refuge", **CORNERS}]})
    assert plan.name == "city"
    assert plan.footprints.centroid_mm.tolist()[0] == [28000, 3000]
    assert plan.footprints.ground_area_m2.tolist()[0] == 54
    assert plan.footprints.floors.tolist() == [1, 1]
    assert plan.footprints.material.tolist() == [0, 0]
    assert plan.footprints.inflammable.tolist() == [1, 0]
    assert plan.footprints.refuge.tolist() == [0, 1]


CORNERS = {"apexes": [50000, 0, 54000, 0, 54000, 4000]}


def test_corners_are_kept_as_they_are_listed():
    doubled = [0, 0, 0, 0, 12000, 0, 12000, 10000, 12000, 10000, 0, 10000, 0, 0]
    plan = parse(changed(("buildings", 0, "apexes"), doubled))
    assert plan.footprints.outline_ptr.tolist() == [0, 7, 10]
    assert plan.footprints.outline_mm.ravel().tolist()[:14] == doubled


def test_too_many_buildings_are_refused_at_once(monkeypatch):
    monkeypatch.setattr(json_plan, "BUILDINGS_MAX", 1)
    with pytest.raises(CityError, match=r"^city.json: buildings: expected at most 1 buildings, got 2 of them"):
        parse(CITY)


def test_a_source_may_be_anything_that_json_holds():
    source = deep(19) | {"text": "x" * 65_000, "none": None, "list": [1, 2.5, True], "\ud800": "\n"}
    assert parse(changed(("source",), source)).source == source


@pytest.mark.parametrize("share", [0.0, 0.4])
def test_a_plan_survives_being_written_and_read(share):
    plan = generate_plan(columns=7, rows=5, seed=3, hydrant_share=share, name="round trip")
    assert same(plan, parse(dump_plan(plan)))


def test_a_plan_with_footpaths_survives_too():
    plan = parse(changed(("streets",), DELETE))
    assert same(plan, parse(dump_plan(plan)))


def deep(n):
    """Put objects into objects."""
    value = {}
    for _ in range(n):
        value = {"a": value}
    return value


B0 = ("buildings", 0)
REFUSALS = [
    (("buildings",), DELETE, "buildings: expected this key to be there, got an object without it"),
    (("buildings",), [], "buildings: expected at least one building, got an empty array"),
    (("buildings",), {}, "buildings: expected an array, got an object"),
    (("buildings", 1), 5, "buildings.1: expected an object, got a number"),
    ((*B0, "id"), DELETE, "buildings.0.id: expected this key to be there, got an object without it"),
    ((*B0, "id"), "7", "buildings.0.id: expected a whole number from 0 to 2147483647, got '7'"),
    ((*B0, "id"), -1, "buildings.0.id: expected a whole number from 0 to 2147483647, got -1"),
    ((*B0, "id"), 2**31, "buildings.0.id: expected a whole number from 0 to 2147483647, got 2147483648"),
    ((*B0, "id"), 9, "buildings.1.id: expected an identifier of its own, got 9"),
    ((*B0, "flors"), 2, "building 7: flors: expected one of the keys id, type, apexes,"),
    ((*B0, "type"), "refgue", "building 7: type: expected one of building, refuge, firestation,"),
    ((*B0, "floors"), 2.5, "building 7: floors: expected a whole number from 1 to 500, got 2.5"),
    ((*B0, "floors"), 2.0, "building 7: floors: expected a whole number from 1 to 500, got 2.0"),
    ((*B0, "floors"), 0, "building 7: floors: expected a whole number from 1 to 500, got 0"),
    ((*B0, "floors"), True, "building 7: floors: expected a whole number from 1 to 500, got True"),
    ((*B0, "floors"), None, "building 7: floors: expected a whole number from 1 to 500, got None"),
    ((*B0, "code"), 3, "building 7: code: expected a whole number from 0 to 2, got 3"),
    ((*B0, "ground_area"), 0, "building 7: ground_area: expected a whole number from 1 to"),
    ((*B0, "inflammable"), 1, "building 7: inflammable: expected true or false, got 1"),
    ((*B0, "x"), 10**10, "building 7: x: expected a whole number from -1000000000 to 1000000000, got 10000000000"),
    ((*B0, "apexes"), DELETE, "building 7: apexes: expected this key to be there"),
    ((*B0, "apexes"), "0,0", "building 7: apexes: expected an array, got a text"),
    ((*B0, "apexes"), [0, 0, 1], "building 7: apexes: expected as many y as x, got 3 numbers"),
    ((*B0, "apexes"), [0, 0, 9000, 9000], "building 7: apexes: expected at least 3 distinct corners, got 2 of them"),
    ((*B0, "apexes"), [0, 0, 9000, 0, 0, 0, 9000, 0], "building 7: apexes: expected at least 3 distinct corners"),
    ((*B0, "apexes"), [], "building 7: apexes: expected at least 3 distinct corners, got 0 of them"),
    ((*B0, "apexes"), [0, 0, 9000, 0, 18000, 0], "building 7: apexes: expected an area of at least 1 m2, got 0.0000"),
    (
        (*B0, "apexes"),
        [0, 0, 999, 0, 999, 999, 0, 999],
        "building 7: apexes: expected an area of at least 1 m2, got 0.998",
    ),
    ((*B0, "apexes"), [0, 0, 9000, 0, 9000, 0.5], "building 7: apexes.5: expected a whole number"),
    ((*B0, "apexes"), [0, 0, 2**31, 0, 9000, 5], "building 7: apexes.2: expected a whole number"),
    (("source",), "OpenStreetMap", "source: expected an object, got a text"),
    (("source",), None, "source: expected an object, got no value (null)"),
    (("source",), {"a": "x" * 65_536}, "source: expected at most 65536 bytes, got 65545 bytes"),
    (("source",), deep(20), "source: expected at most 20 objects and arrays in each other, got more of them"),
    (("source",), {"a": deep(800)}, "source: expected at most 20 objects and arrays in each other"),
    (("name",), "", "name: expected a text of 1 to 100 printable characters, got ''"),
    (("name",), "two\nlines", "name: expected a text of 1 to 100 printable characters, got 'two\\nlines'"),
    (("name",), "two \n lines", "name: expected a text of 1 to 100 printable characters, got two \\n lines"),
    (("wah\nter",), [], "wah\\nter: expected one of the keys name,"),
    (("wahter",), [], "wahter: expected one of the keys name, source, buildings, streets, hydrants,"),
    (("streets",), None, "streets: expected an object, got no value (null)"),
    (("streets", "nodes"), [], "streets.nodes: expected at least one pair, got an empty array"),
    (("streets", "nodes"), [[0, 0], [1]], "streets.nodes.1: expected a pair of whole numbers, got [1]"),
    (("streets", "nodes"), [[0, 0], [1, 0.5]], "streets.nodes.1.1: expected a whole number"),
    (("streets", "edges"), [], "streets.edges: expected at least one pair, got an empty array"),
    (("streets", "edges"), [[0, 2]], "streets.edges.0.1: expected a whole number from 0 to 1, got 2"),
    (("streets", "edges"), [[1, 1]], "streets.edges.0: expected two different nodes, got [1, 1]"),
    (("streets", "edegs"), [], "streets.edegs: expected one of the keys nodes, edges"),
    (("hydrants",), 3, "hydrants: expected an array, got a number"),
    (("hydrants", 0, "x"), DELETE, "hydrants.0.x: expected this key to be there"),
    (("hydrants", 0, "z"), 1, "hydrants.0.z: expected one of the keys id, x, y"),
]


@pytest.mark.parametrize(("path", "value", "message"), REFUSALS)
def test_refused_in_one_line_that_names_the_place(path, value, message):
    with pytest.raises(CityError) as caught:
        parse(changed(path, value))
    assert str(caught.value).startswith(f"city.json: {message}")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b"", "expected JSON, got Expecting value at line 1, column 1"),
        (b"[1, 2]", "expected an object, got an array"),
        (b'{"buildings": [', "expected JSON, got Expecting value at line 1, column 16"),
        (b'{"name": "a", "name": "b"}', "name: expected each key once, got two of them"),
        (b'{"buildings": [{"id": 1, "x": NaN}]}', "expected finite numbers, got 'NaN'"),
        (b'{"buildings": [{"id": 1, "x": -Infinity}]}', "expected finite numbers, got '-Infinity'"),
        (b'{"name": "\xff"}', "expected JSON in UTF-8, got another byte at offset 10"),
        (b"[" * 100_000, "expected JSON with numbers of sane size"),
        (b'{"buildings": [{"id": ' + b"9" * 5000 + b"}]}", "expected JSON with numbers of sane size"),
    ],
)
def test_broken_files(text, message):
    with pytest.raises(CityError) as caught:
        parse_plan(text, where="city.json")
    assert message in str(caught.value)
    assert str(caught.value).startswith("city.json: ")
    assert "\n" not in str(caught.value)


def test_files_that_cannot_be_read(tmp_path):
    for path in (tmp_path / "missing.json", tmp_path):
        with pytest.raises(CityError, match="expected a city file that can be read, got"):
            load_city_file(path)


def places(value, path=()):
    """List the ways to every part of a document."""
    yield path
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, part in items:
        yield from places(part, (*path, key))


JUNK = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=8,
)


@settings(max_examples=150)
@given(path=st.sampled_from([path for path in places(CITY) if path]), value=JUNK | st.just(DELETE))
def test_a_city_is_read_or_refused_but_never_fails(path, value):
    message = complaint(json.dumps(changed(path, value)).encode())
    assert message.startswith("city.json: ") or not message
    assert message.isprintable()


@settings(max_examples=100)
@given(st.binary(max_size=40), st.integers(0, len(json.dumps(CITY))))
def test_no_bytes_make_it_fail(noise, place):
    text = json.dumps(CITY).encode()
    assert complaint(text[:place] + noise + text[place + len(noise) :]).isprintable()


def test_buildings_keep_what_they_are_called_in_their_source():
    named = parse(changed(("buildings", 1, "source"), "w9223372036854775807"))
    assert named.source_id == ("", "w9223372036854775807")
    assert parse_plan(plan_text(named).encode(), where="city.json").source_id == named.source_id
    assert parse(CITY).source_id == ()
    assert '"source":' not in plan_text(parse(CITY)).split('"buildings"')[1]


@pytest.mark.parametrize("said", [5, "", "x" * 101, "a\nb", None, ["w1"]])
def test_what_a_building_is_called_in_its_source_is_a_short_text(said):
    assert complaint(json.dumps(changed(("buildings", 1, "source"), said)).encode()).startswith(
        "city.json: building 9: source: expected a text of 1 to 100 printable characters, got "
    )


@pytest.mark.parametrize(
    ("source", "attribution"),
    [
        ({"attribution": "© a\nb"}, "© a\\nb"),
        ({"attribution": 5}, ""),
        ({"attribution": "x" * 300}, "x" * 200),
        ({}, ""),
    ],
)
def test_whom_a_map_is_by(source, attribution):
    assert parse(changed(("source",), source)).attribution == attribution
