"""Two runs side by side: their difference, aligned by step."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fireworld_viewer import colors
from fireworld_viewer.rerun_view import app
from fireworld_viewer.rerun_view.layers import _UNNAMED
from fireworld_viewer.rerun_view.pages import OutcomePage
from fireworld_viewer.rerun_view.run_layers import AGREEMENT
from fireworld_viewer.story.steps import DAMAGE_ORDER, common_steps, compare_damage

from fireworld.errors import ViewError
from fireworld.records import MemoryRecording
from tests.viewer import rrd
from tests.viewer.conftest import make_recording

SCORE_FACTORS = (1, 0.66, 0.33, 0, 0.9, 0.75, 0.5, 0.25, 0)


def test_damage_follows_the_score():
    assert sorted(DAMAGE_ORDER) == list(range(9))
    factors = [SCORE_FACTORS[code] for code in DAMAGE_ORDER]
    assert factors == sorted(factors, reverse=True)


def test_difference_is_zero_only_for_equal_codes():
    every = np.arange(9, dtype=np.uint8)
    table = compare_damage(np.repeat(every, 9), np.tile(every, 9)).reshape(9, 9)
    assert np.array_equal(table == 0, np.eye(9, dtype=bool))
    assert np.array_equal(table, -table.T)
    assert table[0, 8] == 1  # unburnt in the first run, burnt out in the second: worse


def test_a_run_that_has_ended_keeps_its_last_state():
    steps, rows_a, rows_b = common_steps(np.array([0, 1, 2, 3]), np.array([1, 3, 5]))
    assert steps.tolist() == [1, 2, 3, 5]
    assert rows_a.tolist() == [1, 2, 3, 3]
    assert rows_b.tolist() == [0, 0, 1, 2]


def test_the_difference_is_colored_at_every_step(small, slower, tmp_path: Path):
    app.save([small, slower], tmp_path / "pair.rrd")
    found = rrd.read(tmp_path / "pair.rrd")
    steps = small.steps.tolist()
    codes_a = small.column("/buildings", "fieryness")
    codes_b = slower.column("/buildings", "fieryness")
    codes_b = np.concatenate([codes_b, np.repeat(codes_b[-1:], len(codes_a) - len(codes_b), axis=0)])
    change = compare_damage(codes_a, codes_b)
    assert set(np.unique(change).tolist()) == {-1, 0, 1}

    numbers = rrd.at_every_step(found["/diff/city/handles"]["Difference:difference"], steps)
    assert np.array_equal(np.array(numbers), change)
    shown = rrd.building_colors(found, "/diff/city/buildings", steps, change.shape[1])
    assert np.array_equal(shown, np.array(colors.DIFFERENCE_RGB)[change + 1])

    counts = np.array(rrd.at_every_step(found["/diff/plots/buildings"]["Scalars:scalars"], steps))
    assert counts[-1].tolist() == [(change[-1] > 0).sum(), (change[-1] < 0).sum()]
    for side, recording in (("/a", small), ("/b", slower)):
        own = rrd.at_every_step(found[f"{side}/city/handles"]["Building:fieryness"], recording.steps.tolist())
        assert np.array_equal(np.array(own), recording.column("/buildings", "fieryness"))


def test_both_runs_are_told_apart_in_one_plot(small, slower, tmp_path: Path):
    app.save([small, slower], tmp_path / "pair.rrd")
    found = rrd.read(tmp_path / "pair.rrd")
    for plot in ("burning", "score"):
        names = [found[f"{side}/plots/{plot}"]["SeriesLines:names"][0][1].as_py() for side in ("/a", "/b")]
        assert names == [["A"], ["B"]]
        looks = [found[f"{side}/plots/{plot}"]["SeriesLines:colors"][0][1].as_py() for side in ("/a", "/b")]
        assert looks == [colors.single(rgb).tolist() for rgb in colors.RUN_RGB]


def test_the_first_difference_is_marked_and_the_outcome_is_a_page(small, slower, tmp_path: Path):
    outcome = OutcomePage(
        heads=["a.mcap", "b|.mcap"],
        rows=[("steps", "41", "31"), ("score", "4.9", "5.5")],
        first_step=2,
        first_sentence="step 2, fire: building 5 burns",
    )
    app.save([small, slower], tmp_path / "pair.rrd", outcome=outcome)
    found = rrd.read(tmp_path / "pair.rrd")
    (line,) = found["/diff/log/first_difference"]["TextLog:text"]
    assert (line[0], line[1].as_py()) == (2, ["2  first difference: step 2, fire: building 5 burns"])
    (mark,) = found["/diff/plots/first_difference"]["Scalars:scalars"]
    assert mark[0] == 2
    lane = [
        (step, state.as_py()[0].removesuffix(_UNNAMED)) for step, state in found["/diff/agreement"]["StateChange:state"]
    ]
    codes_a, codes_b = (one.column("/buildings", "fieryness") for one in (small, slower))
    differ = int(np.flatnonzero(np.any(codes_a[:31] != codes_b, axis=1))[0])
    wanted = [(0, AGREEMENT[0]), (2, AGREEMENT[1])][: 2 if differ > 2 else 1]
    assert lane[: len(wanted)] == wanted
    assert (differ, AGREEMENT[2]) in lane
    page = found["/outcome"]["TextDocument:text"][0][1].as_py()[0]
    assert page.splitlines() == [
        "First difference: step 2, fire: building 5 burns.",
        "",
        "|  | A: a.mcap | B: b/.mcap |",
        "| --- | --- | --- |",
        "| steps | 41 | 31 |",
        "| score | 4.9 | 5.5 |",
    ]


def test_runs_that_are_the_same_have_no_mark(small, tmp_path: Path):
    app.save([small, small], tmp_path / "same.rrd", outcome=OutcomePage(heads=["a", "b"], rows=[]))
    found = rrd.read(tmp_path / "same.rrd")
    assert not {"/diff/log/first_difference", "/diff/plots/first_difference"} & set(found)
    assert [state.as_py() for _, state in found["/diff/agreement"]["StateChange:state"]] == [[AGREEMENT[0]]]
    assert found["/outcome"]["TextDocument:text"][0][1].as_py()[0].startswith("The runs are the same.")


def test_the_same_run_twice_differs_nowhere(small, tmp_path: Path):
    app.save([small, small], tmp_path / "same.rrd")
    rows = rrd.read(tmp_path / "same.rrd")["/diff/plots/buildings"]["Scalars:scalars"]
    assert {tuple(row.as_py()) for _, row in rows} == {(0.0, 0.0)}


def test_different_cities_are_refused(small, tmp_path: Path):
    other = make_recording(5, 5, 3)
    said = r"expected two of one city, got 'grid' with 36 .* and 'grid' with 25"
    with pytest.raises(ViewError, match=said):
        app.save([small, other], tmp_path / "x.rrd")
    taller = MemoryRecording(small.header, replace(small.city, floors=small.city.floors + 1), list(small))
    with pytest.raises(ViewError, match="floors differs"):
        app.save([small, taller], tmp_path / "x.rrd")
    assert list(tmp_path.iterdir()) == []


def test_a_run_without_steps_is_refused():
    with pytest.raises(ViewError, match="expected two with steps, got 3 and 0 steps"):
        common_steps(np.arange(3), np.arange(0))
