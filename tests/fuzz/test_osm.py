"""Extracts of OpenStreetMap, altered: only complaints come out, whatever reads them."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

import fireworld as fw
from tests.city.osm.extracts import Drawing, town
from tests.fuzz.support import FUZZ, altered, file_of, only_complaints, target

osmium = pytest.importorskip("osmium")
pytestmark = pytest.mark.slow

XML = town(2).text.encode()


def pbf() -> bytes:
    """The same as .pbf, by osmium's own writer."""
    source, path = file_of(XML, "source.osm"), file_of(b"", "source.pbf")
    writer = osmium.SimpleWriter(str(path), overwrite=True)
    for one in osmium.FileProcessor(str(source)):
        writer.add(one)
    writer.close()
    return path.read_bytes()


def use_extract(data: bytes, name: str) -> None:
    """Make a city of an extract, with a fire in it."""
    path = file_of(data, name)
    with only_complaints():
        made = fw.import_osm(path)
        assert len(made.plan.source_id) == len(made.plan.footprints.building_id) > 0


@target
@FUZZ
@given(altered(XML))
def test_osm_text(data):
    use_extract(data, "town.osm")


@target
@FUZZ
@given(altered(pbf()))
def test_osm_pbf(data):
    use_extract(data, "town.osm.pbf")


corners = st.lists(st.tuples(*[st.integers(-60, 60)] * 2), min_size=1, max_size=9)
values = st.sampled_from(["yes", "no", "house", "", "-1", "1e9", "\u0663", "a\U0001f525", "5;6", "underground"])
keys = st.sampled_from(
    ["building", "building:levels", "building:material", "height", "layer", "location", "highway", "tunnel", "amenity"]
)


@target
@FUZZ
@given(st.lists(st.tuples(corners, st.booleans(), st.dictionaries(keys, values, max_size=4)), max_size=12), st.data())
def test_osm_shapes(ways, data):
    drawing = Drawing(bounds_m=None)
    ids = []
    for places, closed, tags in ways:
        named = {key.replace(":", "__"): value for key, value in tags.items()}
        ids.append((drawing.ring if closed else drawing.way)(*places, **(named or {"building": "yes"})))
    if ids:
        member = st.tuples(st.sampled_from(ids), st.sampled_from(["outer", "inner", "", "outline"]))
        drawing.relation(data.draw(st.lists(member, max_size=6)), building="yes")
    use_extract(drawing.text.encode(), "shapes.osm")
