"""Official maps against what the official reader made of them."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from fireworld.city.formats.json_plan import BUILDING_TYPES
from fireworld.city.formats.official.folder import find_files, import_files
from fireworld.errors import CityError
from tests.real_data import real_file


def buildings_of(plan):
    """Return the buildings of a plan as a trace's city file lists them."""
    found, ptr = plan.footprints, plan.footprints.outline_ptr
    return [
        {
            "id": int(found.building_id[at]),
            "type": BUILDING_TYPES[plan.kind[at]],
            "floors": int(found.floors[at]),
            "code": int(found.material[at]),
            "ground_area": int(found.ground_area_m2[at]),
            "x": int(found.centroid_mm[at, 0]),
            "y": int(found.centroid_mm[at, 1]),
            "inflammable": bool(found.inflammable[at]),
            "apexes": found.outline_mm[ptr[at] : ptr[at + 1]].ravel().tolist(),
        }
        for at in range(len(found.building_id))
    ]


def test_kobe_is_what_the_official_reader_makes_of_it():
    imported = import_files(find_files(real_file("maps/kobe")))
    assert buildings_of(imported.plan) == json.loads(real_file("traces/kobe.json").read_bytes())["buildings"]
    lines = {finding.key: finding for finding in imported.report.findings}
    assert len(lines["closed-outlines"].ids) == 739
    assert lines["no-entrance"].ids == (21662, 14220)
    assert "separate-parts" not in lines


def test_a_map_of_which_an_official_log_was_written():
    files = find_files(real_file("maps/test"), scenario=real_file("maps/test/scenario.xml"))
    config = tuple((name, content.replace(b"random.seed: 1023", b"random.seed: 1")) for name, content in files.config)
    key = {one["id"]: one for one in json.loads(real_file("logs/test-2021-city.json").read_bytes())["buildings"]}
    for building in buildings_of(import_files(replace(files, config=config)).plan):
        assert {name: building[name] for name in ("floors", "code", "x", "y", "ground_area", "apexes")} == {
            name: key[building["id"]][name] for name in ("floors", "code", "x", "y", "ground_area", "apexes")
        }


def test_a_whole_real_map_is_clean():
    imported = import_files(find_files(real_file("maps/sakae")))
    assert {finding.key for finding in imported.report.findings} == {"config-missing", "drawn"}
    assert len(imported.plan.footprints.building_id) == 626
    assert (imported.plan.streets.entrance_node >= 0).all()


def test_edge_lists_that_do_not_join_up():
    found = {one.key: one for one in import_files(find_files(real_file("maps/usp"))).report.findings}
    assert len(found["open-outlines"].ids) == 26
    assert len(found["no-entrance"].ids) == 18
    assert "8 separate parts" in found["separate-parts"].text


@pytest.mark.parametrize("name", ["southampton", "test-degrees"])
def test_maps_in_degrees_are_refused(name):
    with pytest.raises(CityError, match=r"expected coordinates in metres, got .* as if in degrees"):
        import_files(find_files(real_file(f"maps/{name}")))


def test_another_schema_is_refused():
    with pytest.raises(CityError, match="root element map in urn:roborescue:map:gml, got Topology in"):
        import_files(find_files(real_file("maps/meijo")))
