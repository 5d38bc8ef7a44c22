"""Official maps, altered: map.gml, scenario.xml, *.cfg, and city files with roads. Only complaints come out."""

import gzip
import json
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fireworld.city.formats.json_plan import parse_plan
from fireworld.city.formats.json_text import plan_text
from fireworld.city.formats.official.folder import MapFiles, import_files
from fireworld.city.formats.official.text import city_text
from tests.city.official.maps import scenario_text, street_of_three
from tests.fuzz.support import FUZZ, altered, changed, only_complaints, target

pytestmark = pytest.mark.slow

GML = street_of_three().text().encode()
SCENARIO = scenario_text(refuge=[12], fire=[11], civilian=[13, 13, 1], firebrigade=[2], hydrant=[1]).encode()
CONFIG = b"""!include other.cfg
random.seed : 3
gis.map.max-floor = 4  # most
gis.map.building-code-placement.random: true
gis.map.building-code-placement.random.code-rate.0: 75
gis.map.building-code-placement.random.code-rate.1: 20
gis.map.building-code-placement.random.code-rate.2: 5
"""
NUMBERS = [match.span() for match in re.finditer(rb'(?<=[">#,])-?[0-9.]+(?=["<,])', GML)]
ODD = [
    b"",
    b"0",
    b"-1",
    b"1",
    b"2",
    b"11",
    b"1000",
    b"2147483647",
    b"99999999999",
    b"1e9",
    b"1e308",
    b"nan",
    b"-",
    b"0.0001",
]


def read(gml: bytes = GML, scenario: bytes = SCENARIO, config: bytes = CONFIG) -> MapFiles:
    """Return the files of a map."""
    return MapFiles(
        name="town",
        map_file=Path("map.gml"),
        map_content=gml,
        scenario_file=Path("scenario.xml"),
        scenario_content=scenario,
        config_folder=Path("config"),
        config=(("gis.cfg", config), ("other.cfg", b"a: b")),
    )


def use_map(files: MapFiles) -> None:
    """Read a map, write its city file and read that."""
    with only_complaints():
        imported = import_files(files)
        plan = parse_plan(city_text(files, imported).encode(), where="city.json")
        assert np.array_equal(plan.footprints.outline_mm, imported.plan.footprints.outline_mm)
        assert np.array_equal(plan.streets.street, imported.plan.streets.street)
        assert all(line.isprintable() for line in imported.report.lines)


@target
@FUZZ
@given(altered(GML), st.booleans())
def test_map_text(text, packed):
    use_map(read(gml=gzip.compress(text) if packed else text))


@target
@FUZZ
@given(altered(gzip.compress(GML)))
def test_packed_map(content):
    use_map(read(gml=content))


@target
@FUZZ
@given(st.lists(st.tuples(st.sampled_from(NUMBERS), st.sampled_from(ODD)), min_size=1, max_size=4))
def test_map_numbers(changes):
    text = GML
    for (start, end), value in sorted(changes, reverse=True):
        text = text[:start] + value + text[end:]
    use_map(read(gml=text))


@target
@FUZZ
@given(altered(SCENARIO))
def test_map_scenario(text):
    use_map(read(scenario=text))


@target
@FUZZ
@given(altered(CONFIG))
def test_map_configuration(text):
    use_map(read(config=text))


@target
@FUZZ
@given(changed(json.loads(city_text(read(), import_files(read())))))
def test_city_with_roads(document):
    with only_complaints():
        plan = parse_plan(json.dumps(document).encode(), where="city.json")
        again = parse_plan(plan_text(plan).encode(), where="city.json")
        assert np.array_equal(plan.streets.street, again.streets.street)
