"""Where two runs first differ, and how that is said."""

import dataclasses

import numpy as np
import pytest
from fireworld_recorder.diff import StepRange, compare
from fireworld_recorder.match import find, unequal_entries
from fireworld_recorder.reader import open_log
from fireworld_recorder.schema import TOPICS, message_of
from fireworld_recorder.totals import final_outcome, plain, totals_of

from fireworld.errors import LogError
from fireworld.records import ACTIONS, MemoryRecording, Recording, Snapshot
from tests.recorder import synthetic
from tests.recorder.conftest import write_log


def put(array, index, value):
    changed = array.copy()
    changed[index] = value
    return changed


def altered(records, step, topic, **changes):
    """Copy a run with some fields of one step changed; a pair (index, value) changes one entry."""
    old = getattr(records[step], topic)
    new = {
        name: put(getattr(old, name), *change) if isinstance(change, tuple) else change
        for name, change in changes.items()
    }
    copy = list(records)
    copy[step] = dataclasses.replace(records[step], **{topic: dataclasses.replace(old, **new)})
    return copy


@pytest.fixture
def run(records, city):
    return MemoryRecording(synthetic.header(), city, records)


@pytest.fixture
def with_records(city):
    return lambda records: MemoryRecording(synthetic.header(), city, records)


def test_a_run_is_the_same_as_itself(run, with_records, records):
    difference = compare(run, with_records(records))
    assert difference.same
    assert difference.n_steps_compared == 31
    assert difference.n_steps_differing == {}
    assert difference.totals[0] == difference.totals[1]


def test_equal_digests_are_the_same_without_reading(log_path, monkeypatch):
    a, b = open_log(log_path), open_log(log_path)
    monkeypatch.setattr(type(a), "__iter__", lambda _: pytest.fail("read"))
    difference = compare(a, b)
    assert difference.same
    assert difference.n_steps_compared == 31
    assert difference.totals[0].outcome.n_burnt_out == 3


def test_another_choice_is_explained_by_its_q_value(run, with_records, records):
    q_before = records[21].decisions.q_values[7]
    other = altered(records, 21, "decisions", action=(1, 3), q_values=(7, q_before + 3e-3))
    first = compare(run, with_records(other)).first
    assert first.sentence == (
        "step 21, choose: brigade 1 chose nearest-to-me, was nearest-to-civilian;"
        " Q of nearest-to-me in state 121 differs by 0.003"
    )
    assert (first.step, first.phase, first.topic, first.field) == (21, "choose", "/decisions", "action")
    assert (first.entity, first.index, first.a, first.b) == ("brigade", 1, 1, 3)


def test_another_choice_is_explained_by_exploring(run, with_records, records):
    other = altered(records, 21, "decisions", action=(0, -1), explored=(0, 1))
    sentence = compare(run, with_records(other)).first.sentence
    assert sentence == "step 21, choose: brigade 0 chose none, was easiest; it explored"


def test_a_choice_comes_before_what_later_brigades_see_of_it(run, with_records, records):
    chosen = altered(records, 21, "decisions", action=(0, 3))
    seen = altered(chosen, 21, "observations", state_index=(1, 77))
    assert (
        compare(run, with_records(seen)).first.sentence == "step 21, choose: brigade 0 chose nearest-to-me, was easiest"
    )
    seen = altered(chosen, 21, "observations", state_index=(0, 77))
    assert compare(run, with_records(seen)).first.phase == "observe"


@pytest.mark.parametrize(
    ("topic", "changes", "sentence"),
    [
        (
            "draws",
            {"key": 5},
            "step 21, draw: the runs have different random draws: another seed, or another way to draw",
        ),
        ("observations", {"volume": (2, 4)}, "step 21, observe: brigade 2: volume is very-high, was low"),
        ("observations", {"site_n_burning": (1, 4)}, "step 21, observe: site 6: site n burning is 4, was 3"),
        (
            "decisions",
            {"q_values": (7, 9.0), "td_error": np.empty(0)},
            "step 21, choose: brigade 1: Q of nearest-to-me is 9.0, was ",
        ),
        ("brigades", {"activity": (0, 2)}, "step 21, act: brigade 0: activity is spraying, was driving"),
        (
            "brigades",
            {"tank_litres": (1, 14000)},
            "step 21, act: brigade 1: tank litres is 14000, was 14580 (differs by 580)",
        ),
        ("buildings", {"fieryness": (4, 8)}, "step 21, fire: building 4 (id 262): fieryness is burnt-out, was "),
        ("civilians", {"hp": (3, 0)}, "step 21, health: civilian 3: hp is 0, was 979 (differs by 979)"),
        ("rewards", {"total": -6.0}, "step 21, reward: total is -6.0, was -5.0 (differs by 1)"),
        ("score", {"n_burnt_out": 3}, "step 21, reward: n burnt out is 3, was 2 (differs by 1)"),
        (
            "events",
            {"kind": np.array([8], np.uint8), "entity": np.array([2], np.int32)},
            "step 21, events: event 0 is brigade-hurt brigade 2, was nothing",
        ),
        (
            "observations",
            {"site_id": np.empty(0, np.int32)},
            "step 21, observe: site id is there for 0 sites, was for 2",
        ),
    ],
)
def test_a_difference_names_phase_entity_field_and_values(run, with_records, records, topic, changes, sentence):
    difference = compare(run, with_records(altered(records, 21, topic, **changes)))
    assert difference.first.sentence.startswith(sentence)
    assert difference.n_steps_differing == {f"/{topic}": 1}
    # and the other way round it is the same place
    other = compare(with_records(altered(records, 21, topic, **changes)), run).first
    assert (other.topic, other.field, other.index, other.a, other.b) == (
        difference.first.topic,
        difference.first.field,
        difference.first.index,
        difference.first.b,
        difference.first.a,
    )


def test_every_field_of_every_topic_is_compared(run, with_records, records):
    for topic in TOPICS[1:-2]:
        name = topic.topic[1:]
        for item in message_of(topic).fields:
            value = getattr(getattr(records[20], name), item.name)
            if not item.repeated:
                change = value + 1
            elif len(value):
                change = (len(value) - 1, value[-1] + 1)
            else:
                change = np.ones(1)
            first = compare(run, with_records(altered(records, 20, name, **{item.name: change}))).first
            assert first is not None, (name, item.name)
            assert (first.step, first.topic, first.field) == (20, topic.topic, item.name)
            assert first.sentence.startswith(f"step 20, {first.phase}: ")


def test_the_first_phase_of_the_first_step_comes_first(run, with_records, records):
    other = altered(records, 12, "buildings", fuel_share=(0, 0.5))
    other = altered(other, 12, "decisions", target=(2, 11))
    other = altered(other, 13, "draws", key=1)
    difference = compare(run, with_records(other))
    assert difference.first.sentence == "step 12, choose: brigade 2: target is 11, was 4 (differs by 7)"
    assert difference.n_steps_differing == {"/decisions": 1, "/buildings": 1, "/draws": 1}


def test_how_a_run_ended_is_compared(run, with_records, records):
    other = [*records[:-1], dataclasses.replace(records[-1], terminated=True)]
    first = compare(run, with_records(other)).first
    assert first.sentence == "step 30, end: terminated is True, was False"
    assert compare(run, with_records(other)).totals[1].outcome.time_to_complete == 30


def test_snapshots_are_compared_where_both_have_them(run, with_records, records):
    arrays = records[20].snapshot.arrays
    other = list(records)
    other[20] = dataclasses.replace(records[20], snapshot=Snapshot({**arrays, "air": put(arrays["air"], (1, 2), 7.0)}))
    other[10] = dataclasses.replace(records[10], snapshot=None)
    first = compare(run, with_records(other)).first
    assert first.sentence.startswith("step 20, state: air[5] is 7.0, was ")
    assert compare(run, with_records(other), ignore=["snapshot"]).same
    assert compare(run, with_records(other), tolerances={"hp": 1}).same


def test_tolerances_hold_for_their_fields_only(run, with_records, records):
    temperature = records[9].buildings.temperature[3]
    other = altered(records, 9, "buildings", temperature=(3, temperature + np.float32(0.5)))
    assert not compare(run, with_records(other)).same
    assert not compare(run, with_records(other), tolerances={"buildings.temperature": 0.4}).same
    assert not compare(run, with_records(other), tolerances={"energy": 1.0}).same
    assert compare(run, with_records(other), tolerances={"buildings.temperature": 0.6}).same
    assert compare(run, with_records(other), tolerances={"temperature": 0.6}).same
    assert compare(run, with_records(other), ignore=["buildings"]).same
    assert compare(run, with_records(other), ignore=["buildings.temperature"]).same
    more = altered(records, 9, "rewards", total=-5.5)
    assert compare(run, with_records(more), tolerances={"total": 0.5}).same


def test_unknown_names_are_answered_with_the_nearest(run):
    with pytest.raises(LogError, match=r"got 'buildings\.temprature'; try buildings\.temperature"):
        compare(run, run, tolerances={"buildings.temprature": 1.0})
    with pytest.raises(LogError, match="a number >= 0"):
        compare(run, run, tolerances={"hp": float("nan")})
    with pytest.raises(LogError, match="ignore: "):
        compare(run, run, ignore=["nothing"])


@pytest.mark.parametrize(
    ("a", "b", "tolerance", "index"),
    [
        ([1.0, np.nan], [1.0, np.nan], 0.0, None),
        ([0.0], [-0.0], 0.0, None),
        ([np.nan], [1.0], 5.0, 0),
        ([np.inf], [np.inf], 0.0, None),
        ([np.inf], [-np.inf], 1e308, 0),
        ([1e308], [-1e308], 1e308, 0),
        ([1.0, 2.0, 4.0], [1.0, 2.5, 3.0], 0.5, 2),
        ([], [], 0.0, None),
    ],
)
def test_equality_of_special_numbers(a, b, tolerance, index):
    unequal = unequal_entries(np.array(a), np.array(b), tolerance)
    assert (None if unequal is None else int(unequal.argmax())) == index


def test_unsigned_numbers_are_compared_without_wrapping():
    a, b = np.array([3], np.uint8), np.array([5], np.uint8)
    assert unequal_entries(a, b, 1.0).tolist() == [True]
    assert unequal_entries(a, b, 2.0) is None
    (key,) = (item for item in message_of(TOPICS[1]).fields if item.name == "key")
    assert find("/draws", key, 2**64 - 1, 2**64 - 2) is not None


def test_runs_of_other_lengths(run, with_records, records):
    difference = compare(run, with_records(records[:29]))
    assert difference.first.sentence == "2 steps, 29 to 30, are only in the first run; all others are the same"
    assert (difference.first.step, difference.first.phase) == (29, "length")
    assert (difference.first.a, difference.first.b) == (31, 29)
    longer = compare(with_records(records[:30]), run)
    assert longer.first.sentence == "step 30 is only in the second run; all others are the same"
    assert (longer.totals[0].n_steps, longer.totals[1].n_steps) == (30, 31)


def test_a_fork_is_compared_from_where_it_branched_off(run, with_records, records):
    fork = altered(records, 18, "decisions", action=(0, 2))[15:]
    difference = compare(run, with_records(fork))
    assert difference.first.step == 18
    assert difference.n_steps_compared == 16


def test_runs_in_other_cities_differ_in_the_city(run, records, city):
    moved = dataclasses.replace(city, floors=put(city.floors, 3, 2))
    difference = compare(run, MemoryRecording(synthetic.header(), moved, records))
    assert difference.first.sentence == "city: building 3 (id 259): floors is 2, was 1 (differs by 1)"
    assert difference.first.step is None
    assert difference.n_steps_compared == 0
    assert difference.totals[1].n_steps == 31
    drawn = dataclasses.replace(city, outline_x_m=put(city.outline_x_m, 2, 11.0))
    assert compare(run, MemoryRecording(synthetic.header(), drawn, records)).first.sentence == (
        "city: corner 2: outline x m is 11.0, was 12.0 (differs by 1)"
    )
    renamed = dataclasses.replace(city, name="other")
    assert compare(run, MemoryRecording(synthetic.header(), renamed, records)).first.sentence == (
        "city: name is other, was row"
    )
    smaller = synthetic.city(11)
    assert "for 11 buildings, was for 12" in (
        compare(run, MemoryRecording(synthetic.header(), smaller, [])).first.sentence
    )


def test_headers_are_compared_but_are_no_difference(records, city):
    a = MemoryRecording(synthetic.header(), city, records)
    b = MemoryRecording(synthetic.header(policy="random", seed=8), city, records)
    difference = compare(a, b)
    assert difference.same
    assert difference.header == {"seed": (7, 8), "policy": ("easiest", "random")}


def test_logs_are_compared_like_the_runs_they_hold(tmp_path, log_path, run, with_records, records):
    other = altered(records, 3, "brigades", x_m=(0, -1.0))
    path = write_log(tmp_path / "b.mcap", other)
    assert compare(open_log(log_path), open_log(path)) == compare(run, with_records(other))


def test_two_empty_runs(with_records):
    difference = compare(with_records([]), with_records([]))
    assert difference.same
    assert difference.totals[0].outcome is None
    assert plain(difference.totals[0]) == {
        "n_steps": 0, "last_step": None, "time_to_complete": None, "score": None, "score_max": None,
        "n_burnt_out": None, "n_civilians_alive": None, "sum_of_rewards": None, "water_used_litres": None,
    }  # fmt: skip
    with pytest.raises(LogError, match="a run without steps has no outcome"):
        final_outcome(with_records([]))


def test_a_replay_is_compared_with_its_log(log_path, with_records, records):
    log = open_log(log_path)
    assert compare(log, with_records(records)).same
    difference = compare(log, with_records(altered(records, 5, "buildings", energy=(11, 0.0))))
    assert difference.first.step == 5
    assert difference.first.b == 0.0
    assert compare(log, with_records(records[:-1])).first.phase == "length"


class Walked:
    """A run that can only be iterated over, and only once."""

    def __init__(self, records, city):
        self.header, self.city = synthetic.header(), city
        self._left = iter(records)

    def __iter__(self):
        return self._left


def test_a_run_that_is_only_iterated_over_is_compared(log_path, records, city):
    assert not isinstance(Walked(records, city), Recording)
    log = open_log(log_path)
    assert compare(log, Walked(records, city)).same
    assert compare(Walked(records, city), log).n_steps_compared == 31
    other = Walked(altered(records, 5, "civilians", hp=(1, 0)), city)
    assert compare(log, other).first.sentence.startswith("step 5, health: civilian 1: hp is 0")
    within = compare(log, Walked(records, city), steps=StepRange(first=3, last=9))
    assert (within.same, within.n_steps_compared) == (True, 7)
    assert totals_of(Walked(records, city)) == totals_of(log)


def test_actions_have_four_q_values():
    assert len(ACTIONS) == 4
