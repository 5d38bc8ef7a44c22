"""How a difference spreads from step to step, and what is left out of a comparison."""

import dataclasses
import tracemalloc

import numpy as np
import pytest
from fireworld_recorder.diff import StepRange, compare
from fireworld_recorder.reader import open_log
from fireworld_recorder.spread import ValuePair

from fireworld.errors import LogError
from fireworld.records import MemoryRecording
from tests.recorder import synthetic
from tests.recorder.conftest import write_log
from tests.recorder.test_diff import altered, put


@pytest.fixture
def run(records, city):
    return MemoryRecording(synthetic.header(), city, records)


@pytest.fixture
def with_records(city):
    return lambda records: MemoryRecording(synthetic.header(), city, records)


@pytest.fixture
def spreading(records):
    """A choice of brigade 1 in step 4, its way in step 5, then ever more buildings, and a civilian at the end."""
    changed = altered(records, 4, "decisions", action=(1, 3))
    changed = altered(changed, 5, "brigades", x_m=(1, -1.0))
    for step in range(6, 31):
        burning = records[step].buildings.temperature.copy()
        burning[: min(step - 5, 12)] += 100
        changed = altered(changed, step, "buildings", temperature=burning, fieryness=(0, 8))
        changed = altered(changed, step, "score", n_burnt_out=records[step].score.n_burnt_out + 1, score=4.25)
    return altered(changed, 30, "civilians", hp=(2, 1))


def test_the_rows_are_those_1_2_5_10_20_steps_after_the_first_difference_and_the_last(run, with_records, spreading):
    spread = compare(run, with_records(spreading)).spread
    counts = [(row.step, row.n_buildings, row.n_states, row.n_brigades, row.n_civilians) for row in spread.rows]
    assert counts == [
        (4, 0, 0, 1, 0),
        (5, 0, 0, 1, 0),
        (6, 1, 1, 0, 0),
        (9, 4, 1, 0, 0),
        (14, 9, 1, 0, 0),
        (24, 12, 1, 0, 0),
        (30, 12, 1, 0, 1),
    ]
    assert spread.rows[2].score == ValuePair(4.5, 4.25)
    assert spread.rows[-1].n_burnt_out == ValuePair(30 // 9, 30 // 9 + 1)
    assert spread.n_entities == {"building": 12, "brigade": 3, "civilian": 4}
    assert spread.n_reached == {"building": 12, "brigade": 1, "civilian": 1}
    first = {kind: (found.step, found.topic, found.index) for kind, found in spread.first_by_entity.items()}
    assert first == {
        "building": (6, "/buildings", 0),
        "brigade": (4, "/decisions", 1),
        "civilian": (30, "/civilians", 2),
    }


def test_each_topic_has_its_own_first_difference(run, with_records, spreading):
    difference = compare(run, with_records(spreading))
    steps = {topic: found.step for topic, found in difference.first_by_topic.items()}
    assert steps == {"/decisions": 4, "/brigades": 5, "/buildings": 6, "/score": 6, "/civilians": 30}
    assert difference.n_steps_differing == {
        "/decisions": 1, "/brigades": 1, "/buildings": 25, "/score": 25, "/civilians": 1,
    }  # fmt: skip
    assert difference.first == difference.first_by_topic["/decisions"]


def test_the_first_brigade_is_the_one_whose_turn_came_first(run, with_records, records):
    other = altered(records, 21, "decisions", action=(1, 3))
    other = altered(other, 21, "brigades", x_m=(0, -1.0))
    other = altered(other, 21, "observations", state_index=(2, 77))
    assert compare(run, with_records(other)).spread.first_by_entity["brigade"].index == 1


def test_q_values_count_for_their_brigade_and_lengths_for_none(run, with_records, records):
    q_values = records[9].decisions.q_values
    other = altered(records, 9, "decisions", q_values=put(q_values, [4, 5, 6], 9.0))
    assert compare(run, with_records(other)).spread.rows[0].n_brigades == 1
    none = altered(records, 9, "decisions", q_values=np.empty(0))
    difference = compare(run, with_records(none))
    assert difference.first.sentence == "step 9, choose: q values is there for 0 brigades, was for 3"
    assert difference.spread.rows[0].n_brigades == 0
    assert difference.spread.first_by_entity["brigade"] is None


def test_what_is_ignored_is_not_counted(run, with_records, spreading):
    for ignored in ("brigades.x_m", "x_m", "/brigades"):
        difference = compare(run, with_records(spreading), ignore=["decisions", ignored])
        assert (difference.first.step, difference.first.topic) == (6, "/buildings")
        assert difference.spread.n_reached["brigade"] == 0
    tolerant = compare(run, with_records(spreading), tolerances={"/buildings.temperature": 100.5}, ignore=["fieryness"])
    assert tolerant.spread.n_reached["building"] == 0


def test_how_a_run_ended_can_be_ignored(run, with_records, records):
    other = with_records([*records[:-1], dataclasses.replace(records[-1], terminated=True)])
    assert not compare(run, other).same
    assert compare(run, other, ignore=["commit"]).same
    assert compare(run, other, ignore=["commit.terminated"]).same


def test_a_range_of_steps(run, with_records, spreading, log_path):
    other = with_records(spreading)
    before = compare(run, other, steps=StepRange(last=3))
    assert before.same
    assert (before.n_steps_compared, before.totals[0].outcome.steps) == (4, 3)
    within = compare(run, other, steps=StepRange(first=5, last=9))
    assert (within.first.step, within.n_steps_compared) == (5, 5)
    assert [row.step for row in within.spread.rows] == [5, 6, 7, 9]
    with pytest.raises(LogError, match="expected a range of the steps 0 to 30, got steps 31 to the last"):
        compare(run, other, steps=StepRange(first=31))
    log = open_log(log_path)
    same = compare(log, log, steps=StepRange(first=10, last=12))
    assert (same.n_steps_compared, same.totals[0].outcome.steps) == (3, 12)


def test_watching_sees_every_step_of_either_run(run, with_records, records):
    rows = []
    difference = compare(run, with_records(records[:29]), watch=rows.append)
    assert [row.step for row in rows] == list(range(31))
    assert rows[28].n_buildings == 0
    assert rows[29].n_buildings is None
    assert rows[29].score == ValuePair(4.5, None)
    assert difference.spread.rows == ()
    assert difference.first.phase == "length"


def test_memory_holds_a_step_of_each_run_and_not_the_runs(tmp_path):
    city = synthetic.city(3000)
    peaks = []
    for n_steps in (10, 60):
        records = synthetic.run(n_steps, city_record=city)
        a = open_log(write_log(tmp_path / f"a{n_steps}.mcap", records, city=city))
        other = altered(records, 1, "brigades", x_m=(0, -1.0))
        b = open_log(write_log(tmp_path / f"b{n_steps}.mcap", other, city=city))
        tracemalloc.start()
        assert compare(a, b).first.step == 1
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    step_bytes = 3000 * (4 + 8 + 4 + 4 + 1)
    assert peaks[0] > step_bytes
    assert peaks[1] < peaks[0] + step_bytes, peaks
