"""What official logs become: the same recording whatever their form, and every number of it."""

import math

import numpy as np
import pytest

import fireworld as fw
from fireworld.records import EVENT_KINDS
from tests.recording.official_log import writer
from tests.recording.official_log.conftest import FORMS
from tests.recording.official_log.writer import Log


@pytest.mark.parametrize("name", FORMS)
def test_every_form_becomes_the_same_recording(written, name):
    found = fw.import_log(written(name), "found.mcap")
    wanted = fw.import_log(written("town.log"), "wanted.mcap")
    assert found.digest == wanted.digest
    assert (found.damage, found.n_steps, found.last_step, found.n_left_out) == (None, 7, 6, 1)
    assert found.open().header.scenario_digest == wanted.open().header.scenario_digest


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("town.log", "protobuf, numbers of 2021"),
        ("real.log.xz", "protobuf, xz, numbers of 2022 and later"),
        ("alone.log.xz", "protobuf, lzma, numbers of 2022 and later"),
        ("unframed.log", "protobuf without lengths, numbers of 2021"),
        ("old.log.xz", "the form before 2021, xz, names as texts"),
        ("town.log.gz", "protobuf, gzip, numbers of 2021"),
        ("numbers.json", "JSON, names as numbers"),
    ],
)
def test_the_form_of_a_log_is_named(written, name, words):
    assert fw.import_log(written(name), "found.mcap").form == words


def test_fire_people_and_brigades_are_those_of_the_log_carried_forward(imported):
    run = fw.open_log(imported)
    assert run.steps.tolist() == [0, 1, 2, 3, 4, 5, 6]
    assert run.column("buildings.fieryness").tolist() == [
        [0, 0, 0], [0, 1, 0], [0, 2, 0], [0, 3, 1], [0, 3, 5], [0, 3, 5], [0, 8, 5],
    ]  # fmt: skip
    assert run.column("buildings.temperature").tolist() == [
        [0, 0, 0], [0, 90, 0], [0, 250, 0], [0, 311, 60], [0, 311, 12], [0, 311, 12], [0, 100, 12],
    ]  # fmt: skip
    assert run.column("civilians.hp").T.tolist() == [[10_000] * 2 + [9_980] * 5, [10_000] * 5 + [0] * 2]
    assert run.column("civilians.damage").T.tolist() == [[0] * 2 + [20] * 5, [0] * 5 + [500] * 2]
    assert run.column("civilians.buriedness")[:, 0].tolist() == [40, 40, 40, 0, 0, 0, 0]
    # in a building, then carried by an ambulance that moves on, then in the refuge
    assert run.column("civilians.in_building")[:, 0].tolist() == [1, 1, 1, -1, -1, 0, 0]
    assert run.column("civilians.x_m")[:, 0].tolist() == [-4, -4, -4, -5, -5.5, -15, -15]
    assert run.column("brigades.x_m")[:, 0].tolist() == [-15, -15, -15, -14, -14, -14, -14]
    assert run.column("brigades.tank_litres")[:, 0].tolist() == [7500] * 3 + [0] * 4


def test_events_are_those_that_can_be_seen(imported):
    run = fw.open_log(imported)
    found = [
        [(EVENT_KINDS[kind], int(entity)) for kind, entity in zip(step.events.kind, step.events.entity, strict=True)]
        for step in run
    ]
    assert found == [
        [], [("ignited", 1)], [("civilian-hurt", 0)], [("tank-empty", 0), ("ignited", 2)], [("extinguished", 2)],
        [("civilian-hurt", 1), ("civilian-died", 1)], [("burnt-out", 1)],
    ]  # fmt: skip


def test_the_city_is_that_of_the_log(imported):
    city = fw.open_log(imported).city
    assert city.name == "row"
    assert city.building_id.tolist() == [1, 2, 3]
    assert city.outline_x_m[:4].tolist() == [-20, -10, -10, -20]
    assert city.outline_y_m[:4].tolist() == [0, 0, 10, 10]
    assert (city.floors.tolist(), city.material.tolist()) == ([2, 2, 2], [1, 1, 1])
    assert (city.ground_area_m2.tolist(), city.inflammable.tolist()) == ([100, 100, 100], [0, 1, 1])
    assert city.refuge_building.tolist() == [0]
    assert (city.hydrant_x_m.tolist(), city.hydrant_y_m.tolist()) == ([-5], [12])
    assert (city.brigade_tank_litres.tolist(), city.brigade_power_litres.tolist()) == ([7500], [500])
    assert city.brigade_range_m.tolist() == [50]
    assert city.civilian_hp.tolist() == [10_000, 10_000]


def test_roads_are_lines_between_the_sides_that_they_share(imported):
    city = fw.open_log(imported).city
    nodes = list(zip(city.node_x_m.tolist(), city.node_y_m.tolist(), strict=True))
    streets = {frozenset((nodes[a], nodes[b])) for a, b in zip(city.street_from, city.street_to, strict=True)}
    first, second = (-10.0, 15.0), (0.0, 15.0)  # the road between them has no node of its own
    assert streets == {frozenset(pair) for pair in [((-15.0, 12.0), first), (first, second), (second, (5.0, 12.0))]}


def test_scores_are_the_model_s_and_the_kernel_s(written):
    found = fw.import_log(written("town.log"), "town.mcap")
    last = found.open()[-1].score
    # one alive with 9980 of 20000 HP; areas 200, 200 burnt out, 200 with minor damage
    healthy = 9_980 / 20_000
    assert last.score == pytest.approx((1 + healthy) * math.sqrt(350 / 600))
    assert last.score_now == pytest.approx(math.exp(-5 * (1 - healthy)))
    assert (last.score_max, last.n_burning, last.n_water_damaged, last.n_burnt_out) == (3, 0, 1, 1)
    # the kernel weighs the third building by its importance, 5
    assert found.official.function == "LegacyScoreFunction"
    assert found.official.value == pytest.approx((1 + healthy) * math.sqrt((200 + 750) / 1400))
    assert found.official.ours == last.score


@pytest.mark.parametrize(
    ("function", "value"),
    [
        ("rescuecore2.standard.score.RSL21ScoreFunction", math.exp(-5 * (1 - 0.499))),
        ("somebody.OwnScore", None),
    ],
)
def test_the_kernel_s_own_function_is_computed_if_it_is_known(written, function, value):
    log = Log(settings=writer.SETTINGS | {"score.function": function})
    found = fw.import_log(written("town.log", log), "town.mcap").official
    assert found.function == function.rpartition(".")[2]
    assert found.value == (None if value is None else pytest.approx(value))


def test_the_header_says_where_it_is_from_and_what_is_absent(imported):
    header = fw.open_log(imported).header
    assert (header.scenario, header.policy, header.seed, header.n_steps_max) == ("row", "official-agents", 17, 6)
    assert header.origin == "official log: protobuf, numbers of 2021"
    assert header.imported
    for name in ("decisions.action", "rewards", "buildings.energy", "brigades.activity", "score.water_used_litres"):
        assert header.lacks(name)
    for name in ("buildings.temperature", "brigades.tank_litres", "score.score", "seed", "city.brigade_tank_litres"):
        assert not header.lacks(name)


def test_what_is_kept_of_the_configuration_names_no_folder(imported):
    text = fw.open_log(imported).header.attachments["kernel.cfg"].decode()
    assert "fire.tank.maximum : 7500\n" in text
    assert "somebody" not in text


def test_without_a_configuration_nothing_is_made_up(written):
    found = fw.import_log(written("town.log", Log(settings=None)), "town.mcap")
    run = found.open()
    assert found.official is None
    assert run.header.lacks("seed")
    assert run.header.lacks("city.brigade_tank_litres")
    assert run.header.lacks("city.brigade_range_m")
    assert run.city.name == "official map"
    assert "seed" not in run.header.title
    assert not len(run.city.brigade_range_m)


def test_two_imports_are_the_same_bytes(written, here):
    fw.import_log(written("town.log"), "a.mcap")
    (here / "another.name").write_bytes((here / "town.log").read_bytes())
    fw.import_log("another.name", "b.mcap")
    assert (here / "a.mcap").read_bytes() == (here / "b.mcap").read_bytes()


def test_steps_may_be_left_out_and_do_not_begin_at_one(written):
    log = Log(first_step=40)
    assert fw.import_log(written("town.log", log), "town.mcap").open().steps.tolist() == [0, *range(40, 46)]


def test_an_import_needs_no_simulator(written):
    import subprocess
    import sys

    code = (
        "import sys, fireworld as fw; fw.import_log('town.log', 'x.mcap'); "
        "assert not {'numba', 'matplotlib', 'rerun'} & set(sys.modules)"
    )
    written("town.log")
    subprocess.run([sys.executable, "-c", code], check=True)


def test_floats_of_what_is_absent_are_no_numbers_and_arrays_are_empty(imported):
    run = fw.open_log(imported)
    last = run[-1]
    assert math.isnan(last.rewards.total)
    assert math.isnan(last.score.water_used_litres)
    assert np.isnan(run.column("rewards.sum_so_far")).all()
    assert run.column("buildings.energy").shape == (7, 0)
    assert len(last.decisions.action) == len(last.brigades.activity) == 0
    assert not math.isnan(last.score.score)
