"""The air is shown at the steps of snapshots, where it is, in the color of its heat."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fireworld_viewer import colors
from fireworld_viewer.rerun_view import app
from fireworld_viewer.rerun_view.city_layers import HOTTEST, air_pixels

from fireworld.errors import LogError
from fireworld.recording.replay import Replay
from fireworld.records import CityRecord, MemoryRecording, Snapshot
from tests import command_line
from tests.viewer import rrd
from tests.viewer.conftest import make_recording


def city_with_air(city: CityRecord) -> CityRecord:
    return replace(city, air_origin_x_m=10.0, air_origin_y_m=20.0, air_nx=2, air_ny=3)


def snapshot(cells: list[list[float]]) -> Snapshot:
    """A snapshot whose air has a border of one cell, and a padding of three beyond it."""
    array = np.full((4, 8), 999.0)
    array[1:3, 1:4] = cells
    return Snapshot({"fire.air": array})


def test_hotter_air_is_paler_and_cold_air_is_clear():
    pixels = air_pixels(np.array([[0.0, 0.9], [HOTTEST, 2 * HOTTEST], [HOTTEST / 4, 5.0]]))
    assert pixels.shape == (2, 3, 4)  # y, x
    north, south = pixels
    assert south[0, 3] == north[0, 3] == 0
    assert tuple(south[1, :3]) == tuple(north[1, :3]) == colors.AIR_RGB[-1]
    assert tuple(south[2, :3]) == colors.AIR_RGB[1]  # a quarter of the heat is half of the scale
    assert 0 < north[2, 3] < south[2, 3] < south[1, 3] < 255


def test_the_air_of_a_snapshot_lies_over_the_city_and_bears_its_step(tmp_path: Path):
    made = make_recording(3, 3, 4)
    taken = {0: snapshot([[0, 0, 0], [0, 0, 0]]), 3: snapshot([[0, 0, 600], [0, 150, 0]])}
    steps = [replace(record, snapshot=taken.get(record.step)) for record in made]
    app.save([MemoryRecording(made.header, city_with_air(made.city), steps)], tmp_path / "air.rrd")
    found = rrd.read(tmp_path / "air.rrd")
    heat = found["/air/heat"]
    assert heat["GridMap:translation"][0][1].as_py()[0][:2] == [10.0, 20.0]
    assert heat["GridMap:cell_size"][0][1].as_py() == [5.0]
    assert [step for step, _ in heat["GridMap:data"]] == [0, 3]
    raw = np.array(heat["GridMap:data"][1][1].as_py()[0], dtype=np.uint8).reshape(3, 2, 4)  # y from the north, x
    assert tuple(raw[0, 0, :3]) == colors.AIR_RGB[-1]
    assert tuple(raw[1, 1, :3]) == colors.AIR_RGB[1]
    assert np.count_nonzero(raw[..., 3]) == 2
    said = [(step, text.as_py()) for step, text in found["/air/when"]["Points3D:labels"]]
    assert said == [(0, ["air after step 0: at most 0 degrees"]), (3, ["air after step 3: at most 600 degrees"])]


@pytest.mark.parametrize("sizes", [{"air_nx": -2}, {"air_nx": 10**6}, {"air_ny": 7}, {"air_nx": -2, "air_ny": -1}])
def test_air_of_other_cells_than_the_citys_is_a_line(tmp_path: Path, sizes: dict[str, int]):
    made = make_recording(3, 3, 2)
    steps = [replace(record, snapshot=snapshot([[0, 0, 0], [0, 0, 0]])) for record in made]
    recording = MemoryRecording(made.header, replace(city_with_air(made.city), **sizes), steps)
    with pytest.raises(LogError, match=r"^/snapshot: fire.air: expected an array of the city's"):
        app.save([recording], tmp_path / "air.rrd")
    assert not [*tmp_path.iterdir()]


def test_a_recording_without_snapshots_has_no_air(small, tmp_path: Path):
    app.save([small], tmp_path / "run.rrd")
    assert not [path for path in rrd.read(tmp_path / "run.rrd") if path.startswith("/air")]


def test_a_replay_knows_the_air_of_every_step(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    log, every, some = (str(tmp_path / name) for name in ("run.mcap", "every.rrd", "some.rrd"))
    for words in (("run", "quick", "--policy", "chief", "--record", log), ("view", log, "--save", some)):
        assert command_line.call(monkeypatch, *words).code == 0
    assert command_line.call(monkeypatch, "view", log, "--air", "--from", "10", "--save", every).code == 0
    heat = {path: dict(rrd.read(Path(path))["/air/heat"]["GridMap:data"]) for path in (every, some)}
    assert list(heat[some]) == [0, 50]
    assert list(heat[every]) == list(range(10, 63))
    assert heat[every][50] == heat[some][50]
    assert heat[every][49] != heat[every][50]


def test_the_air_of_another_simulator_is_not_made_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    log = tmp_path / "run.mcap"
    assert command_line.call(monkeypatch, "run", "quick", "--steps", "5", "--record", str(log)).code == 0
    computed = Replay.__iter__

    def hotter(replay: Replay):
        for record in computed(replay):
            buildings = replace(record.buildings, energy=record.buildings.energy + float(record.step == 3))
            yield replace(record, buildings=buildings)

    monkeypatch.setattr(Replay, "__iter__", hotter)
    done = command_line.call(monkeypatch, "view", str(log), "--air", "--save", str(tmp_path / "run.rrd"))
    first = "step 3, fire: building 0 (id 0): energy is 1.0, was 0.0 (differs by 1)"
    said = f"fireworld: {log}: does not replay to what is recorded: {first}; try without --air\n"
    assert (done.code, done.err) == (2, said)
    assert not (tmp_path / "run.rrd").exists()
