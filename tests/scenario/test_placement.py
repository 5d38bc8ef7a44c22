"""Placement: fires at the nearest buildings, civilians in their band and direction, brigades at the refuges."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fireworld.city.city import Footprints, Plan, StreetMap
from fireworld.errors import ScenarioError
from fireworld.scenario import load_scenario, parse_scenario, scenario_names
from fireworld.simulation.placement import attachments, place, scenario_plan
from tests.city.plans import dump_plan

SIDE = 5
PITCH_MM = 20_000


def grid_plan(*, refuges=(0, 24), order=None):
    """Make 5 x 5 square buildings of 10 m, 20 m apart; ids 100 + row * 5 + column, south-west first."""
    places = [(column, row) for row in range(SIDE) for column in range(SIDE)]
    places = [places[index] for index in order] if order is not None else places
    low = np.array(places) * PITCH_MM
    corners = np.array([(0, 0), (10_000, 0), (10_000, 10_000), (0, 10_000)])
    ids = np.array([100 + row * SIDE + column for column, row in places])
    refuge = np.isin(ids - 100, refuges).astype(np.uint8)
    n = len(places)
    return Plan(
        name="grid",
        footprints=Footprints(
            building_id=ids,
            refuge=refuge,
            outline_ptr=(4 * np.arange(n + 1)).astype(np.int32),
            outline_mm=(low[:, None, :] + corners).reshape(-1, 2).astype(np.int32),
            centroid_mm=(low + 5000).astype(np.int32),
            floors=np.ones(n, np.int32),
            material=np.zeros(n, np.uint8),
            ground_area_m2=np.full(n, 100, np.float32),
            inflammable=1 - refuge,
        ),
        streets=StreetMap(
            node_mm=np.zeros((1, 2), np.int32), street=np.zeros((0, 2), np.int32), hydrant_node=np.zeros(0, np.int32)
        ),
    )


def scenario(fires, civilians="{n: 0}", brigades=3):
    text = f"city: {{generated: {{columns: 5, rows: 5}}}}\nfires: {fires}\ncivilians: {civilians}\n"
    return parse_scenario(f"{text}brigades: {{n: {brigades}}}\n", source="my.yaml")


def ids(plan, buildings):
    return [int(building_id) - 100 for building_id in plan.footprints.building_id[buildings]]


def test_a_fire_takes_the_nearest_inflammable_buildings():
    plan = grid_plan()
    # The centre of the box is building 12's centroid; its four neighbours are equally near.
    assert ids(plan, place(scenario("[{at: [0.5, 0.5]}]"), plan).ignited) == [12]
    assert ids(plan, place(scenario("[{at: [0.5, 0.5], n_buildings: 5}]"), plan).ignited) == [7, 11, 12, 13, 17]
    assert ids(plan, place(scenario("[{at: [0.5, 0.5], n_buildings: 3}]"), plan).ignited) == [7, 11, 12]
    # The south-west corner is a refuge, which does not burn; y points north.
    assert ids(plan, place(scenario("[{at: [0, 0], n_buildings: 2}]"), plan).ignited) == [1, 5]
    assert ids(plan, place(scenario("[{at: [0, 1]}]"), plan).ignited) == [20]


def test_fires_share_no_building():
    plan = grid_plan()
    setup = place(scenario("[{at: [0.5, 0.5], n_buildings: 5}, {at: [0.5, 0.5], n_buildings: 4}]"), plan)
    assert ids(plan, setup.ignited) == [6, 7, 8, 11, 12, 13, 16, 17, 18]
    assert ids(plan, place(scenario("[{buildings: [103, 101]}, {at: [0.25, 0]}]"), plan).ignited) == [1, 2, 3]


def test_brigades_start_at_the_refuges_in_turn():
    plan = grid_plan(refuges=(0, 4, 24))
    setup = place(scenario("[{at: [0.5, 0.5]}]", brigades=5), plan)
    assert ids(plan, setup.brigade_refuge) == [0, 4, 24, 0, 4]


@pytest.mark.parametrize(
    ("direction", "quarter"),
    [("N", {17, 16, 18, 22}), ("E", {13, 8, 18, 14}), ("S", {7, 6, 8, 2}), ("W", {11, 6, 16, 10})],
)
def test_a_direction_is_the_quarter_around_it(direction, quarter):
    # Within 41 m of building 12 lie the straight neighbours (20 and 40 m) and the diagonal ones (28 m).
    plan = grid_plan()
    civilians = f"{{n: 4, to_m: 41, directions: [{direction}]}}"
    assert set(ids(plan, place(scenario("[{at: [0.5, 0.5]}]", civilians), plan).civilian_building)) == quarter
    with pytest.raises(ScenarioError) as caught:
        place(scenario("[{at: [0.5, 0.5]}]", civilians.replace("n: 4", "n: 5")), plan)
    assert str(caught.value).startswith("my.yaml: civilians.n: expected at most 4, the unburnt inflammable buildings")


def test_both_ends_of_the_band_count():
    plan = grid_plan()
    assert ids(plan, place(scenario("[{at: [0.5, 0.5]}]", "{n: 4, from_m: 20, to_m: 20}"), plan).civilian_building) == [
        17,
        13,
        7,
        11,
    ]


def test_a_direction_that_is_full_leaves_its_turn_to_the_others():
    plan = grid_plan()
    # North of the upper edge there is nothing.
    setup = place(scenario("[{at: [0.5, 1]}]", "{n: 4, to_m: 45, directions: [N, S]}"), plan)
    assert set(ids(plan, setup.civilian_building)) == {17, 16, 18, 12}


def test_civilians_sit_in_unburnt_buildings_one_each():
    plan = grid_plan()
    setup = place(scenario("[{at: [0.5, 0.5], n_buildings: 5}]", "{n: 18}"), plan)
    assert sorted(ids(plan, setup.civilian_building) + ids(plan, setup.ignited)) == list(range(1, 24))
    assert np.array_equal(setup.civilian_mm, plan.footprints.centroid_mm[setup.civilian_building])


def test_civilians_around_a_named_fire_or_a_point():
    plan = grid_plan()
    near_fire = place(scenario("[{buildings: [106, 108]}]", "{n: 1, to_m: 1}"), plan)
    assert ids(plan, near_fire.civilian_building) == [7]
    near_point = place(scenario("[{at: [0, 0.5]}]", "{n: 1, to_m: 10, around: [1, 0.5]}"), plan)
    assert ids(plan, near_point.civilian_building) == [14]
    named = place(scenario("[{at: [0.5, 0.5]}]", "{buildings: [112, 100]}"), plan)
    assert ids(plan, named.civilian_building) == [12, 0]


@settings(max_examples=25)
@given(order=st.permutations(range(SIDE * SIDE)), seed=st.integers(0, 2**32 - 1))
def test_the_order_of_the_map_moves_no_one(order, seed):
    wanted = scenario("[{at: [0.41, 0.57], n_buildings: 3}]", f"{{n: 6, seed: {seed}}}")
    plan, shuffled = grid_plan(), grid_plan(order=order)
    one, other = place(wanted, plan), place(wanted, shuffled)
    assert ids(plan, one.civilian_building) == ids(shuffled, other.civilian_building)
    assert sorted(ids(plan, one.ignited)) == sorted(ids(shuffled, other.ignited))


def test_seeds_differ():
    plan = grid_plan()
    placed = {
        tuple(ids(plan, place(scenario("[{at: [0.5, 0.5]}]", f"{{n: 5, seed: {seed}}}"), plan).civilian_building))
        for seed in range(20)
    }
    assert len(placed) == 20


@pytest.mark.parametrize(
    ("fires", "civilians", "message"),
    [
        (
            "[{at: [0, 0], n_buildings: 24}]",
            "{n: 0}",
            "fires.0.n_buildings: expected at most 23, the city's inflammable",
        ),
        (
            "[{at: [0, 0], n_buildings: 20}, {at: [1, 1], n_buildings: 4}]",
            "{n: 0}",
            "fires.1.n_buildings: expected at mo",
        ),
        (
            "[{buildings: [101, 7, 8]}]",
            "{n: 0}",
            "fires.0.buildings: expected ids of buildings of grid, got unknown ids: 7, 8",
        ),
        (
            "[{buildings: [100]}]",
            "{n: 0}",
            "fires.0.buildings: expected inflammable buildings, got building 100, which",
        ),
        (
            "[{at: [0.5, 0.5]}, {buildings: [112]}]",
            "{n: 0}",
            "fires.1.buildings: expected buildings that no other fire",
        ),
        (
            "[{at: [0.5, 0.5]}]",
            "{n: 23}",
            "civilians.n: expected at most 22, the unburnt inflammable buildings of that",
        ),
        (
            "[{at: [0.5, 0.5]}]",
            "{buildings: [7]}",
            "civilians.buildings: expected ids of buildings of grid, got unknown",
        ),
    ],
)
def test_what_does_not_fit_the_city(fires, civilians, message):
    with pytest.raises(ScenarioError) as caught:
        place(scenario(fires, civilians), grid_plan())
    assert str(caught.value).startswith(f"my.yaml: {message}")
    assert "\n" not in str(caught.value)


def test_a_city_without_refuge():
    with pytest.raises(ScenarioError, match=r"my.yaml: city: expected a city with a refuge"):
        place(scenario("[{at: [0.5, 0.5]}]"), grid_plan(refuges=()))


def test_a_setup_cannot_be_changed():
    setup = place(scenario("[{at: [0.5, 0.5]}]", "{n: 2}"), grid_plan())
    for array in vars(setup).values():
        assert not array.flags.writeable
    assert setup.civilian_mm.shape == (2, 2)
    assert place(scenario("[{at: [0.5, 0.5]}]"), grid_plan()).civilian_mm.shape == (0, 2)


@pytest.mark.parametrize("name", scenario_names())
def test_every_shipped_scenario_fits_its_city(name):
    shipped = load_scenario(name)
    plan = scenario_plan(shipped)
    setup = place(shipped, plan)
    assert len(setup.ignited) == shipped.fires[0].n_buildings
    assert len(set(setup.civilian_building)) == shipped.civilians.n
    assert len(setup.brigade_refuge) == shipped.brigades.n
    assert not set(setup.ignited) & set(setup.civilian_building)


def test_a_city_file_travels_with_the_scenario(tmp_path):
    plan = grid_plan()
    (tmp_path / "town.json").write_text(json.dumps({"buildings": dump_plan(plan)["buildings"]}))
    (tmp_path / "my.yaml").write_text("city: {file: town.json}\nfires: [{buildings: [112]}]\ncivilians: {n: 3}\n")
    original = load_scenario(tmp_path / "my.yaml")
    files = attachments(original)
    assert set(files) == {"scenario.yaml", "city.json"}
    assert str(tmp_path).encode() not in files["scenario.yaml"]
    again = parse_scenario(files["scenario.yaml"], source="scenario.yaml")
    one, other = scenario_plan(original), scenario_plan(again, city_json=files["city.json"])
    assert one.name == other.name == "town"
    assert np.array_equal(place(original, one).civilian_building, place(again, other).civilian_building)

    (tmp_path / "town.json").write_text("{}")
    with pytest.raises(ScenarioError, match=r"my.yaml: city.file: expected a city file of SHA-256 .*, got one of "):
        scenario_plan(original)
    (tmp_path / "town.json").unlink()
    with pytest.raises(ScenarioError, match=r"my.yaml: city.file: expected a city file, got .*No such file"):
        scenario_plan(original)
    assert set(attachments(load_scenario("quick"))) == {"scenario.yaml"}


def test_a_generated_city_that_cannot_be():
    huge = scenario("[{at: [0.5, 0.5]}]").with_settings({"city.generated": "{columns: 200, rows: 100, lot_m: 100}"})
    with pytest.raises(ScenarioError, match=r"^my.yaml with .*: city.generated: "):
        scenario_plan(huge)
