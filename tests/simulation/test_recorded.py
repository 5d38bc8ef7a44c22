"""Records against plain numpy: derived fields, reasons and events, of runs and of states that no run would reach."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

from fireworld.events import FIRE_EVENTS, NO_EVENT, fire_event
from fireworld.kernels.arrays import DRAWS
from fireworld.policy.asking import complete
from fireworld.policy.words import FEATURES
from fireworld.records import DTYPES, EVENT_KINDS, STEP_TOPICS, Draws, Observations, Rewards, Score, StepRecord, filled
from fireworld.simulation.choices import Choices
from fireworld.simulation.observer import Observer
from fireworld.simulation.state import REWARDS, SCORE, copy_world
from tests.reference.observer import expected_fields
from tests.simulation.town import POLICIES, Asked, begin, policy_named, town_world


def assert_recorded(record, expected):
    for name, value in expected.items():
        topic, _, field = name.partition(".")
        held = getattr(getattr(record, topic), field)
        np.testing.assert_array_equal(held, value, err_msg=f"step {record.step}: {name}")


@pytest.mark.parametrize("name", POLICIES)
@pytest.mark.parametrize("seed", [1, 2])
def test_records_of_a_run(name, seed):
    world = town_world(seed=seed, n_fires=6)
    observer, policy = Observer(world), begin(policy_named(name), world)
    kinds = set()
    while not (world.terminated or world.truncated):
        before = copy_world(world.state)
        choices = world.step(policy)
        record = observer.record(choices)
        assert_recorded(record, expected_fields(world, choices, before))
        kinds |= set(record.events.kind.tolist())
    assert len(kinds) > 3


@pytest.mark.parametrize("seed", range(20))
def test_events_of_any_change(seed):
    world, random = town_world(seed=seed, n_fires=12), np.random.default_rng(seed)
    policy = begin(policy_named("each-another"), world)
    observer = Observer(world)
    choices = world.step(policy)
    observer.record(choices)
    world.look()
    before = copy_world(world.state)
    fire, civilians, brigades = world.state.fire, world.state.civilians, world.state.brigades
    changed = random.random(len(fire.fieryness)) < random.choice([0.1, 0.5, 1.0])
    fire.fieryness[changed] = random.integers(0, 9, changed.sum())
    for array in (civilians.hp, civilians.damage, brigades.hp, brigades.damage, brigades.tank, brigades.refilling):
        array[:] = random.integers(0, 2, len(array))
    brigades.activity[:] = random.integers(0, 6, len(brigades.activity))
    assert_recorded(observer.record(choices), expected_fields(world, choices, before))


@pytest.mark.parametrize("name", POLICIES)
def test_a_policy_that_kernels_follow_is_recorded_as_when_it_is_asked(name):
    worlds = [town_world(seed=3, n_brigades=4) for _ in range(2)]
    policies = [begin(policy_named(name), world) for world in worlds]
    policies[1] = complete(Asked(policies[1]))
    observers = [Observer(world) for world in worlds]
    while not (worlds[0].terminated or worlds[0].truncated):
        one, other = (
            observer.record(world.step(policy))
            for observer, world, policy in zip(observers, worlds, policies, strict=True)
        )
        for topic in STEP_TOPICS:
            for item in fields(topic):
                values = [getattr(getattr(record, topic.topic[1:]), item.name) for record in (one, other)]
                np.testing.assert_array_equal(*values, err_msg=f"step {one.step}: {topic.topic}: {item.name}")


@pytest.mark.parametrize("name", POLICIES)
def test_reasons_that_a_kernel_noted_are_those_of_the_decisions(name):
    world = town_world(seed=5, n_brigades=4)
    policy = begin(policy_named(name), world)
    while not (world.terminated or world.truncated):
        choices = world.step(policy)
        decided = Choices(choices.features, choices.state_index, choices.site, choices.decisions)
        for noted, made in zip(choices.reasons, decided.reasons, strict=True):
            np.testing.assert_array_equal(noted, made)


@pytest.mark.parametrize("started", [False, True])
@pytest.mark.parametrize("name", ["table", "ranking-of-all", "asked"])
def test_a_record_has_every_field_in_its_type(name, started):
    world = town_world(seed=1)
    observer = Observer(world)
    policy = begin(policy_named("each-another" if name == "asked" else name), world)
    record = observer.record(world.step(complete(Asked(policy)) if name == "asked" else policy) if started else None)
    assert list(vars(record)) == [item.name for item in fields(StepRecord)]
    for topic in STEP_TOPICS:
        part = getattr(record, topic.topic[1:])
        assert type(part) is topic
        assert list(vars(part)) == [item.name for item in fields(topic)]
        for item in fields(topic):
            held, wire = getattr(part, item.name), item.metadata["wire"]
            if "per" not in item.metadata:
                assert type(held) is {"double": float, "sfixed32": int, "fixed64": int}[wire], item.name
            elif not item.metadata.get("imported"):
                assert (held.dtype, held.ndim) == (np.dtype(DTYPES[wire]), 1), item.name


def test_names_stand_in_the_order_of_the_fields():
    def names(topic):
        return tuple(item.name for item in fields(topic))

    assert names(Rewards) == REWARDS
    assert names(Score) == SCORE
    assert names(Draws) == ("key", *DRAWS)
    assert names(Observations)[1 : 1 + len(FEATURES)] == tuple(feature.name for feature in FEATURES)


def test_a_filled_record_is_one_that_was_constructed():
    made, filled_one = Rewards(*range(6)), filled(Rewards, dict(zip(REWARDS, range(6), strict=True)))
    assert made == filled_one
    assert repr(made) == repr(filled_one)
    with pytest.raises(AttributeError):
        filled_one.total = 1.0


@pytest.mark.parametrize(
    ("before", "code", "event"),
    [
        *((old, new, "ignited") for old in (0, 4, 5, 6, 7, 8) for new in (1, 2, 3)),
        *((old, new, "extinguished") for old in (1, 2, 3) for new in (0, 4, 5, 6, 7)),
        *((old, 8, "burnt-out") for old in range(8)),
        *((code, code, None) for code in range(9)),
        *((old, new, None) for old in (1, 2, 3) for new in (1, 2, 3)),
        *((old, new, None) for old in (0, 4, 5, 6, 7, 8) for new in (0, 4, 5, 6, 7)),
    ],
)
def test_what_happens_to_a_building(before, code, event):
    assert fire_event(before, code) == (NO_EVENT if event is None else EVENT_KINDS.index(event))
    assert event is None or EVENT_KINDS.index(event) in FIRE_EVENTS
