"""A small map by hand: every number worked out."""

from __future__ import annotations

import gzip

import pytest

import fireworld as fw
from fireworld.city.formats.json_plan import BUILDING_TYPES
from fireworld.city.formats.official.folder import find_files, import_files
from tests.city.official.maps import rectangle, scenario_text, street_of_three, write_map

RANDOM = """random.seed: 3
gis.map.floor-placement.random = true  # as in most maps
gis.map.floor-placement.random.floor-rate.1=2
gis.map.floor-placement.random.floor-rate.2=1
gis.map.floor-placement.random.floor-rate.3=1
"""


def read(folder, gml, **files):
    """Read a map that is written for the test."""
    return import_files(find_files(write_map(folder, gml, **files)))


def keys(imported):
    return [finding.key for finding in imported.report.findings]


def test_lengths_are_whole_millimetres_from_the_least_node(tmp_path):
    found = read(tmp_path / "m", street_of_three().text()).plan.footprints
    assert found.building_id.tolist() == [11, 12, 13]
    assert found.outline_mm[:4].tolist() == [[2000, 6000], [12000, 6000], [12000, 18000], [2000, 18000]]
    assert found.centroid_mm.tolist() == [[7000, 12000], [36000, 10500], [64000, 34000]]
    assert found.ground_area_m2.tolist() == [120, 108, 64]


def test_numbers_are_cut_not_rounded(tmp_path):
    drawn = street_of_three()
    drawn.area("building", 14, [(80, 1), (90.0019, 1), (90.0019, 9), (80, 9)])
    found = read(tmp_path / "m", drawn.text().replace("90.002", "90.0019")).plan
    at = found.footprints.building_id.tolist().index(14)
    corners = found.footprints.outline_mm[found.footprints.outline_ptr[at] : found.footprints.outline_ptr[at + 1]]
    assert corners[1].tolist() == [90001, 1000]
    assert found.footprints.ground_area_m2[at] == 80


def test_floors_and_codes_have_a_most(tmp_path):
    imported = read(tmp_path / "m", street_of_three().text())
    assert imported.plan.footprints.floors.tolist() == [1, 3, 1]
    assert imported.plan.footprints.material.tolist() == [0, 2, 0]
    assert {"floors-cut", "codes-cut", "no-configuration", "no-scenario", "no-entrance"} == set(keys(imported))


def test_floors_are_drawn_in_the_order_of_the_table(tmp_path):
    imported = read(tmp_path / "m", street_of_three().text(), gis=RANDOM)
    from fireworld.city.formats.official.mersenne import MersenneTwister

    generator = MersenneTwister("3", where="test")
    rates = [1, 1, 2, 3]  # two of four numbers mean one floor
    assert imported.plan.footprints.floors.tolist() == [rates[generator.next_int(4)] for _ in range(3)]
    assert imported.plan.footprints.material.tolist() == [0, 2, 0]  # codes are not drawn


def test_the_order_is_that_of_a_table_of_everything(tmp_path):
    drawn = street_of_three()
    for building in (16, 32, 48, 33):
        drawn.area("building", building, rectangle(100 + building, 0, 10, 10))
    few = read(tmp_path / "few", drawn.text(), scenario=scenario_text(refuge=[16]))
    # 9 things in a table of 16: 16, 32 and 48 are in its first place, the refuge, made last, behind the others.
    assert few.plan.footprints.building_id.tolist() == [32, 48, 16, 33, 11, 12, 13]
    many = read(tmp_path / "many", drawn.text(), scenario=scenario_text(refuge=[16], civilian=[11] * 20))
    # 29 things: a table of 64, in which every building has a place of its own.
    assert many.plan.footprints.building_id.tolist() == [11, 12, 13, 16, 32, 33, 48]


def test_a_table_that_becomes_a_tree_is_noted(tmp_path):
    drawn = street_of_three()
    for at in range(8):
        drawn.area("building", 64 * (at + 1), rectangle(100 + 20 * at, 0, 10, 10))
    assert "crowded-table" not in keys(read(tmp_path / "m", drawn.text()))
    drawn.area("building", 64 * 9, rectangle(300, 0, 10, 10))
    assert "crowded-table" in keys(read(tmp_path / "n", drawn.text()))


def test_kinds_of_buildings(tmp_path):
    places = {"refuge": [11], "gasstation": [12], "firestation": [13], "hydrant": [2, 2]}
    plan = read(tmp_path / "m", street_of_three().text(), scenario=scenario_text(**places)).plan
    assert [BUILDING_TYPES[kind] for kind in plan.kind] == ["refuge", "gasstation", "firestation"]
    assert plan.footprints.inflammable.tolist() == [0, 1, 0]
    assert plan.footprints.refuge.tolist() == [1, 0, 0]
    assert plan.streets.node_mm[plan.streets.hydrant_node].tolist() == [[35000, 3000]]


def test_streets_lead_from_edge_to_edge(tmp_path):
    streets = read(tmp_path / "m", street_of_three().text()).plan.streets
    nodes = streets.node_mm.tolist()
    assert nodes[:2] == [[10000, 3000], [35000, 3000]]  # the middles of the roads
    assert nodes[2:] == [[20000, 3000], [7000, 6000], [36000, 6000]]  # road to road, road to building
    assert streets.entrance_node.tolist() == [3, 4, -1]
    pairs = {frozenset(pair) for pair in streets.street.tolist()}
    assert {frozenset(pair) for pair in ((0, 2), (0, 3), (1, 2), (1, 4))} <= pairs
    assert frozenset((2, 3)) in pairs  # straight from the entrance to the next road: shorter than by the middle


def test_neighbours_are_inferred_where_a_map_names_none(tmp_path):
    imported = read(tmp_path / "m", street_of_three(named=False).text())
    named = read(tmp_path / "n", street_of_three().text())
    assert "neighbours-inferred" in keys(imported)
    assert imported.plan.roads.passage_area.tolist() == named.plan.roads.passage_area.tolist()
    assert imported.plan.roads.passage_mm.tolist() == named.plan.roads.passage_mm.tolist()


def test_a_map_without_roads_gets_footpaths(tmp_path):
    drawn = street_of_three()
    drawn.areas["road"].clear()
    gml = drawn.text().replace(' rcr:neighbour="1"', "").replace(' rcr:neighbour="2"', "")
    write_map(tmp_path / "m", gml, scenario=scenario_text(refuge=[12]))
    made = fw.import_city(tmp_path / "m", output=tmp_path / "m.json")
    assert "no-streets" in [finding.key for finding in made.report.findings]
    scenario = {"city": {"official": str(tmp_path / "m")}, "fires": [{"buildings": [11]}], "steps": 5}
    assert len(fw.run(scenario)) > 1
    assert list(fw.export_city(tmp_path / "m.json", tmp_path / "again").differences) == []


def test_one_direction_is_enough(tmp_path):
    one_way = street_of_three().text().replace(' rcr:neighbour="1"', "")
    imported = read(tmp_path / "m", one_way)
    assert "one-direction" in keys(imported)
    assert imported.plan.streets.entrance_node.tolist() == [3, 4, -1]


def test_a_map_may_be_packed_and_its_configuration_elsewhere(tmp_path):
    (tmp_path / "town" / "map").mkdir(parents=True)
    (tmp_path / "town" / "config").mkdir()
    (tmp_path / "town" / "map" / "map.gml.gz").write_bytes(gzip.compress(street_of_three().text().encode()))
    (tmp_path / "town" / "config" / "kernel.cfg").write_text("!include gis.cfg\n!include ../../secret.cfg\n")
    (tmp_path / "town" / "config" / "gis.cfg").write_text("gis.map.max-floor : 4\n")
    imported = import_files(find_files(tmp_path / "town"))
    assert imported.plan.name == "town"
    assert imported.plan.footprints.floors.tolist() == [1, 4, 1]
    assert "included and not there: ../../secret.cfg" in imported.report.lines


def test_a_scenario_may_name_the_folder(tmp_path):
    write_map(tmp_path / "m", street_of_three().text(), scenario=scenario_text(refuge=[12], hydrant=[1]))
    made = fw.import_city(tmp_path / "m", output=tmp_path / "m.json")
    people = {
        "fires": [{"buildings": [11]}, {"buildings": [13], "step": 4}],
        "civilians": {"at": [11, 11, 2]},
        "steps": 12,
    }
    ways = [{"official": "m"}, {"file": "m.json"}]
    scenarios = [fw.Scenario.from_dict({**people, "city": way}, folder=tmp_path) for way in ways]
    assert scenarios[0].digest == scenarios[1].digest
    assert fw.run(scenarios[0]).digest == fw.run(scenarios[1]).digest
    assert made.plan.source["map"] == "map.gml"


@pytest.mark.parametrize("kind", ["policeoffice", "ambulancecentre"])
def test_what_burns_can_be_configured(tmp_path, kind):
    key = {"policeoffice": "police_office", "ambulancecentre": "ambulance_center"}[kind]
    imported = read(
        tmp_path / "m",
        street_of_three().text(),
        scenario=scenario_text(**{kind: [11]}),
        **{"resq-fire": f"resq-fire.{key}_inflammable: true"},
    )
    assert imported.plan.footprints.inflammable.tolist() == [1, 1, 1]
