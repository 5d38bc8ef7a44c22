"""What the records tell: events in the step in which they happen, shapes, snapshots, and values that are copies."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

from fireworld.kernels.brigades import REFILLING
from fireworld.parameters import PAPER, Parameters
from fireworld.policy.kernel import always
from fireworld.records import ACTIVITIES, DTYPES, EVENT_KINDS, SNAPSHOT_EVERY_STEPS, STEP_TOPICS
from fireworld.simulation.choices import Choices
from fireworld.simulation.observer import Observer, city_record
from fireworld.simulation.placement import Placement
from tests.kernels.small import assess, burn, make_city, make_world, square
from tests.simulation.town import begin, policy_named, town, town_world

NO_CHOICES = Choices(np.zeros((0, 8), dtype=np.int64), np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int32))
FAR_APART = [square(200.0 * k, 0.0) for k in range(5)]


def told(record):
    """The events as (kind, entity)."""
    return [
        (EVENT_KINDS[kind], entity) for kind, entity in zip(*(record.events.kind, record.events.entity), strict=True)
    ]


def observe_change(world, change):
    """Record a step in which nothing happens but a change."""
    observer = Observer(world)
    world.look()
    change(world.state)
    return told(observer.record(NO_CHOICES))


def cold_world(**others):
    """Five buildings far apart, of which the first four burn, two people and a brigade."""
    world = make_world(make_city(*FAR_APART, refuges=[4]), civilians=[(-1, 0, 500)] * 2, brigades=[4], **others)
    burn(world, 0, 1, 2, 3)
    world.state.fire.energy[:4] = 1e7
    assess(world)
    return world


def test_events_of_buildings_and_sites():
    def change(arrays):
        arrays.fire.fieryness[:5] = 5, 8, 1, 2, 1
        arrays.outcome.counts[0] = 3

    assert observe_change(cold_world(), change) == [
        ("ignited", 4),
        ("extinguished", 0),
        ("burnt-out", 1),
        ("site-out", 1),
        ("site-out", 2),
    ]


def test_the_last_site_goes_out_with_the_run():
    world = town_world(seed=3, n_fires=1)
    observer, policy = Observer(world), begin(policy_named("fixed"), world)
    records = [observer.record()]
    while not world.terminated:
        records.append(observer.record(world.step(policy)))
    assert [entity for record in records for kind, entity in told(record) if kind == "site-out"] == [1]
    assert told(records[-1])[-1] == ("site-out", 1)


def test_sites_that_merge_do_not_go_out():
    world = make_world(make_city(*FAR_APART, links={0: [1], 1: [2]}))
    burn(world, 0, 2)
    observer = Observer(world)
    world.state.fire.fieryness[1] = 1
    world.look()
    assert [kind for kind, _ in told(observer.record(NO_CHOICES))] == ["ignited"]


def test_events_of_people_and_brigades():
    def change(arrays):
        arrays.civilians.hp[:] = 0, 990
        arrays.civilians.damage[:] = 100.0, 5.0
        arrays.brigades.hp[0], arrays.brigades.damage[0] = 0, 5.0
        arrays.brigades.tank[0] = 0

    assert observe_change(cold_world(), change) == [
        ("tank-empty", 0),
        ("civilian-hurt", 0),
        ("civilian-hurt", 1),
        ("civilian-died", 0),
        ("brigade-hurt", 0),
        ("brigade-died", 0),
    ]


def test_a_refilled_brigade_is_an_event():
    world = cold_world()
    world.state.brigades.tank[0], world.state.brigades.refilling[0] = 13_500, 1
    observer = Observer(world)
    events = told(observer.record(world.step(begin(always(3), world))))
    assert world.state.brigades.activity[0] == REFILLING
    assert ("refilled", 0) in events


def test_the_first_record_is_the_start():
    world = town_world(seed=1)
    record = Observer(world).record()
    assert (record.step, told(record), record.rewards.total) == (0, [], 0.0)
    assert record.snapshot is not None
    for topic in (record.observations, record.decisions):
        assert not any(len(getattr(topic, item.name)) for item in fields(topic) if item.name != "epsilon")
    assert len(record.buildings.energy) == world.city.n_buildings
    assert record.score.score_max == 6.0


def test_records_are_copies():
    world = town_world(seed=1)
    observer, policy = Observer(world), begin(policy_named("table"), world)
    record = observer.record(world.step(policy))
    held = {
        (topic.topic, item.name): np.array(getattr(getattr(record, topic.topic[1:]), item.name))
        for topic in STEP_TOPICS
        for item in fields(topic)
    }
    for _ in range(5):
        observer.record(world.step(policy))
    for (topic, name), value in held.items():
        np.testing.assert_array_equal(getattr(getattr(record, topic[1:]), name), value, err_msg=f"{topic}.{name}")


@pytest.mark.parametrize("name", ["table", "random", "ranking-of-named", "ranking-of-all"])
def test_what_a_step_tells(name):
    world = town_world(seed=2, n_brigades=4)
    observer, policy = Observer(world), begin(policy_named(name), world)
    record = observer.record(world.step(policy))
    decisions, seen = record.decisions, record.observations
    assert len(decisions.q_values) == (0 if name == "random" else 16)
    assert len(decisions.target_value) == (4 if name.startswith("ranking") else 0)
    assert decisions.epsilon == (0.3 if name == "table" else 0.0)
    assert (seen.state_index >= 0).all()
    assert (seen.site_id == np.sort(seen.site_id)).all()
    assert seen.site_n_burning.sum() == 3
    assert set(seen.site) <= set(seen.site_id)
    for action, target, b in zip(decisions.action, decisions.target, range(4), strict=True):
        assert (action == 4) if name == "ranking-of-all" else (0 <= action < 4)
        place = seen.site_id.tolist().index(seen.site[b])
        x, y = world.city_arrays.geometry.x[target] / 1000, world.city_arrays.geometry.y[target] / 1000
        assert seen.site_west_m[place] <= x <= seen.site_east_m[place]
        assert seen.site_south_m[place] <= y <= seen.site_north_m[place]
    assert all(0 <= activity < len(ACTIVITIES) for activity in record.brigades.activity)
    reward = record.rewards
    assert reward.total == reward.water_damaged + reward.burning + reward.burnt_out + reward.civilians
    assert reward.sum_so_far == reward.total


def test_snapshots_come_at_their_steps():
    parameters = replace(PAPER, fire=replace(PAPER.fire, burn_rate_mean=0.0, burn_rate_sd=0.0))
    world = cold_world(parameters=parameters, n_steps_max=2 * SNAPSHOT_EVERY_STEPS)
    observer, policy = Observer(world), begin(always(3), world)
    with_snapshot = [0] if observer.record().snapshot else []
    for step in range(1, 2 * SNAPSHOT_EVERY_STEPS + 1):
        world.state.fire.energy[:4], world.state.fire.fieryness[:4] = 1e7, 1
        if observer.record(world.step(policy)).snapshot is not None:
            with_snapshot.append(step)
    assert with_snapshot == [0, SNAPSHOT_EVERY_STEPS, 2 * SNAPSHOT_EVERY_STEPS]


def test_the_record_has_every_field_in_its_type():
    city, inside = town(), np.array([3, 5], dtype=np.int32)
    record = city_record(city, Placement(inside, inside, city.footprints.centroid_mm[inside], inside), Parameters())
    for item in fields(record):
        held, wire = getattr(record, item.name), item.metadata["wire"]
        if "per" in item.metadata:
            assert held.dtype == np.dtype(DTYPES[wire]), item.name
            assert held.ndim == 1, item.name
        else:
            assert isinstance(held, {"string": str, "double": float, "sfixed32": int}[wire]), item.name
    assert record.civilian_x_m.tolist() == (city.footprints.centroid_mm[[3, 5], 0] / 1000).tolist()
    assert record.civilian_hp.tolist() == [Parameters().health.initial_hp] * 2
    assert record.brigade_tank_litres.tolist() == [7500] * 2
    assert record.brigade_range_m.tolist() == [50.0] * 2
    assert record.refuge_building.tolist() == np.flatnonzero(city.footprints.refuge).tolist()
    assert len(record.hydrant_x_m) == len(city.streets.hydrant_node) > 0
    assert (record.air_cell_m, record.air_nx, record.air_ny) == (5.0, *city.air.shape)
    assert record.outline_ptr[-1] == len(record.outline_x_m) == len(record.outline_y_m)


def test_the_record_of_a_city_without_civilians_or_brigades():
    nobody = np.empty(0, np.int32)
    record = city_record(town(), Placement(nobody, nobody, np.empty((0, 2), np.int32), nobody), Parameters())
    assert len(record.civilian_x_m) == len(record.civilian_hp) == len(record.brigade_range_m) == 0
