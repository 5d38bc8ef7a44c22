"""Maps, scenarios and configurations that make no sense: one line each, which names file, place and both sides."""

# ruff: noqa: E501 - a case takes a line
from __future__ import annotations

import gzip
import io
import re
import zlib
from contextlib import suppress

import pytest

from fireworld.city.formats.official import xml_stream
from fireworld.city.formats.official.folder import find_files, import_files
from fireworld.errors import CityError
from tests.city.official.maps import scenario_text, street_of_three, write_map

GOOD = street_of_three().text()
BOMB = (
    '<?xml version="1.0"?><!DOCTYPE m [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">'
    '<!ENTITY c "&b;&b;&b;&b;&b;&b;&b;&b;">]>' + GOOD.replace("0.000,0.000", "&c;")
)


def refusal(folder, content, **files):
    """Return the line that a map is refused with; it names the folder's file and is one line."""
    write_map(folder, "", **files)
    (folder / "map.gml").write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(CityError) as caught:
        import_files(find_files(folder))
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (lambda _: "", "map.gml: expected well-formed XML, got no element found at line 1"),
        (lambda t: t[:300], "expected well-formed XML, got "),
        (lambda t: t.replace("urn:roborescue:map:gml", "urn:other"), "root element map in urn:roborescue:map:gml, got map in urn:o"),
        (lambda _: "<html/>", "got html in no namespace"),
        (lambda t: t.replace('gml:id="1000"', 'gml:id="-1"'), "line 3: Node: gml:id: expected a whole number from 0 to 2147483647, got '-1'"),
        (lambda t: t.replace('gml:id="1001"', 'gml:id="1000"'), "line 4: Node: gml:id: expected an identifier of its own, got 1000"),
        (lambda t: t.replace('building gml:id="12"', 'building gml:id="11"'), "building: gml:id: expected an identifier of its own, got 11"),
        (lambda t: t.replace("2.000,6.000", "2.000"), "node 1000: coordinates: expected x,y, got '2.000'"),
        (lambda t: t.replace("2.000,6.000", "nan,6"), "node 1000: coordinates: expected finite numbers, got 'nan,6'"),
        (lambda t: t.replace("2.000,6.000", "1e300,6"), "expected a map of at most 1000 km a side"),
        (lambda t: t.replace('<gml:Node gml:id="1000">', '<gml:Node gml:id="9">'), "expected nodes that are in the file, got unknown ids: 1000"),
        (lambda t: t.replace('gml:Edge gml:id="10000"', 'gml:Edge gml:id="9"'), "building 11: expected edges that are in the file, got unknown ids: 10000"),
        (lambda t: t.replace('neighbour="12"', 'neighbour="99"'), "road 2: expected neighbours that are in the file, got unknown ids: 99"),
        (lambda t: t.replace('<gml:directedNode orientation="-"', '<gml:directedNode orientation="+"', 1), "edge 10000: expected a directedNode - and a directedNode +, got orientations +"),
        (lambda t: t.replace('orientation="+" xlink:href="#1000"', 'orientation="*" xlink:href="#1000"', 1), "orientation: expected + or -, got '*'"),
        (lambda t: t.replace('xlink:href="#10000"', 'xlink:href="10000"', 1), "directedEdge: xlink:href: expected # and an identifier, got '10000'"),
        (lambda t: t.replace('rcr:floors="5"', 'rcr:floors="many"'), "building 12: floors: expected a whole number from 1 to 500, got 'many'"),
        (lambda t: re.sub(r"<rcr:building .*</rcr:building>", "", t), "buildinglist: expected at least one building, got"),
        (lambda t: re.sub(r'(building gml:id="13"><gml:Face>).*?(</gml:Face>)', r"\1\2", t), "building 13: expected an outline of edges, got"),
        (lambda t: t.replace("68.000,", "60.010,"), "building 13: expected an area of at least 1 m2, 3 corners, got 0 m2 and 4"),
        (lambda _: BOMB, "expected XML without a document type and entities, got <!DOCTYPE m>"),
        (lambda t: '<!DOCTYPE m SYSTEM "file:///etc/passwd">' + t, "expected XML without a document type and entities"),
        (lambda t: gzip.compress(t.encode())[:-20], "expected a whole gzip file, got"),
        (lambda _: b"\x1f\x8b" + bytes(40), "expected a whole gzip file, got"),
        (lambda _: b"\xff\xfe\x00", "expected well-formed XML, got"),
    ],
)  # fmt: skip
def test_a_bad_map_takes_one_line(tmp_path, change, line):
    assert line in refusal(tmp_path / "m", change(GOOD))


def test_a_packed_map_without_end_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(xml_stream, "SIZE_MAX_BYTES", 5_000_000)
    packed = io.BytesIO()
    with gzip.GzipFile(fileobj=packed, mode="wb") as file:
        file.write(GOOD.encode().replace(b"</rcr:map>", b" " * 6_000_000 + b"</rcr:map>"))
    assert len(packed.getvalue()) < 20_000
    line = refusal(tmp_path / "m", packed.getvalue())
    assert "expected at most 5000000 bytes of XML, got more of them when unpacked" in line.replace('"', "'")


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (
            scenario_text(refuge=[99]),
            "scenario.xml: refuge: expected ids of buildings of the map, got unknown ids: 99",
        ),
        (scenario_text(refuge=[1]), "refuge: expected ids of buildings of the map"),
        (scenario_text(fire=[1]), "fire: expected ids of buildings of the map"),
        (scenario_text(hydrant=[77, 78]), "hydrant: expected ids of roads of the map, got unknown ids: 77, 78"),
        (scenario_text(civilian=[5, 6, 7, 8, 9, 10]), "civilian: expected ids of buildings and roads of the map"),
        (scenario_text(firebrigad=[1]), "got 'firebrigad'; try firebrigade"),
        (scenario_text().replace("s:scenario", "s:other"), "root element scenario in urn:roborescue:map:scenario"),
        (
            '<s:scenario xmlns:s="urn:roborescue:map:scenario"><s:fire/></s:scenario>',
            "fire: location: expected a whole",
        ),
        (BOMB, "expected XML without a document type and entities"),
    ],
)
def test_a_bad_scenario_takes_one_line(tmp_path, text, line):
    assert line in refusal(tmp_path / "m", GOOD, scenario=text)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("gis.map.max-floor : three", "gis.cfg: gis.map.max-floor: expected a whole number from 1 to 100, got 'three'"),
        ("gis.map.max-floor", "gis.cfg: line 1: expected key : value, !include FILE or # comment, got"),
        (": 3", "gis.cfg: line 1: expected key : value"),
        ("gis.map.floor-placement.random: perhaps", "random: expected true or false, got 'perhaps'"),
        ("random.seed: 3\ngis.map.floor-placement.random: true", "floor-rate.1: expected a whole number from 0 to"),
        ("gis.map.building-code-placement.random: true\n" + "".join(f"gis.map.building-code-placement.random.code-rate.{k}: 0\n" for k in range(3)), "expected rates that are not all 0"),
        ("random.seed: xyz\ngis.map.building-code-placement.random: true\n" + "".join(f"gis.map.building-code-placement.random.code-rate.{k}: 1\n" for k in range(3)), "random.seed: expected a hexadecimal number"),
    ],
)  # fmt: skip
def test_a_bad_configuration_takes_one_line(tmp_path, text, line):
    assert line in refusal(tmp_path / "m", GOOD, gis=text)


def test_files_that_are_not_there(tmp_path):
    with pytest.raises(CityError, match=r"expected a folder with map\.gml or map\.gml\.gz, got none of them in it"):
        find_files(tmp_path)
    with pytest.raises(CityError, match=r"nowhere\.gml: expected a map, got No such file or directory"):
        find_files(tmp_path / "nowhere.gml")
    write_map(tmp_path / "m", GOOD)
    with pytest.raises(CityError, match=r"expected a folder with \*\.cfg, got no folder"):
        find_files(tmp_path / "m", config=tmp_path / "no")
    with pytest.raises(CityError, match=r"expected a scenario\.xml, got No such file"):
        find_files(tmp_path / "m", scenario=tmp_path / "no.xml")


def test_configurations_that_include_each_other_end(tmp_path):
    folder = write_map(tmp_path / "m", GOOD, kernel="!include gis.cfg\n!include kernel.cfg", gis="!include kernel.cfg")
    assert import_files(find_files(folder)).config.missing == []


def test_cut_and_altered_maps_are_read_or_refused(tmp_path):
    content = GOOD.encode()
    folder = write_map(tmp_path / "m", GOOD)
    for at in range(0, len(content), 97):
        changed = bytearray(content)
        changed[at] = zlib.crc32(bytes([at % 251])) % 256
        for altered in (bytes(changed), content[:at]):
            (folder / "map.gml").write_bytes(altered)
            with suppress(CityError):  # anything else is a fault
                import_files(find_files(folder))
