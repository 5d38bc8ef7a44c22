"""Two runs side by side: their difference, aligned by step."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fireworld.errors import ViewError
from fireworld.records import MemoryRecording
from tests.viewer import rrd
from tests.viewer.conftest import make_recording
from viewer import app, colors
from viewer.city_mesh import SHADES_PERCENT, build_mesh
from viewer.comparison import DAMAGE_ORDER, common_steps, difference

SCORE_FACTORS = (1, 0.66, 0.33, 0, 0.9, 0.75, 0.5, 0.25, 0)


def test_damage_follows_the_score():
    assert sorted(DAMAGE_ORDER) == list(range(9))
    factors = [SCORE_FACTORS[code] for code in DAMAGE_ORDER]
    assert factors == sorted(factors, reverse=True)


def test_difference_is_zero_only_for_equal_codes():
    every = np.arange(9, dtype=np.uint8)
    table = difference(np.repeat(every, 9), np.tile(every, 9)).reshape(9, 9)
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
    change = difference(codes_a, codes_b)
    assert set(np.unique(change).tolist()) == {-1, 0, 1}

    numbers = rrd.at_every_step(found["/diff/city/handles"]["Difference:difference"], steps)
    assert np.array_equal(np.array(numbers), change)
    mesh = build_mesh(small.city)
    table = colors.shaded_table(colors.DIFFERENCE_RGB, SHADES_PERCENT)
    shown = rrd.at_every_step(found["/diff/city/buildings"]["Mesh3D:vertex_colors"], steps)
    assert np.array_equal(np.array(shown), table[change[:, mesh.vertex_building] + 1, mesh.vertex_shade])

    counts = np.array(rrd.at_every_step(found["/diff/plots/buildings"]["Scalars:scalars"], steps))
    assert counts[-1].tolist() == [(change[-1] > 0).sum(), (change[-1] < 0).sum()]
    for side, recording in (("/a", small), ("/b", slower)):
        own = rrd.at_every_step(found[f"{side}/city/handles"]["Building:fieryness"], recording.steps.tolist())
        assert np.array_equal(np.array(own), recording.column("/buildings", "fieryness"))


def test_the_same_run_twice_differs_nowhere(small, tmp_path: Path):
    app.save([small, small], tmp_path / "same.rrd")
    rows = rrd.read(tmp_path / "same.rrd")["/diff/plots/buildings"]["Scalars:scalars"]
    assert {tuple(row.as_py()) for _, row in rows} == {(0.0, 0.0)}


def test_different_cities_are_refused(small, tmp_path: Path):
    other = make_recording(5, 5, 3)
    said = r"expected two recordings of one city, got 'grid' with 36 .* and 'grid' with 25"
    with pytest.raises(ViewError, match=said):
        app.save([small, other], tmp_path / "x.rrd")
    taller = MemoryRecording(small.header, replace(small.city, floors=small.city.floors + 1), list(small))
    with pytest.raises(ViewError, match="floors differs"):
        app.save([small, taller], tmp_path / "x.rrd")
    assert list(tmp_path.iterdir()) == []


def test_a_run_without_steps_is_refused():
    with pytest.raises(ViewError, match="expected two recordings with steps, got 3 and 0 steps"):
        common_steps(np.arange(3), np.arange(0))
