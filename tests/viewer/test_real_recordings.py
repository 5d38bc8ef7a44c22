"""Recordings of real runs, through the command: what the file shows is what the log holds, at every step."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fireworld_recorder.reader import Log, open_log
from fireworld_viewer import colors
from fireworld_viewer.rerun_view.city_layers import air_cells, air_pixels
from fireworld_viewer.rerun_view.plots import COUNTS, REWARDS, SCORES

from tests import command_line
from tests.viewer import rrd

pytestmark = pytest.mark.slow

GOLDEN = Path(__file__).parents[2] / "recordings" / "golden"


def saved(monkeypatch: pytest.MonkeyPatch, folder: Path, *names: str) -> tuple[list[Log], dict[str, rrd.Rows]]:
    """Save golden recordings as a Rerun file; return them and what is in it."""
    paths = [GOLDEN / f"{name}.mcap" for name in names]
    done = command_line.call(monkeypatch, "view", *paths, "--save", folder / "view.rrd")
    assert (done.code, done.err) == (0, "")
    return [open_log(path) for path in paths], rrd.read(folder / "view.rrd")


def assert_shown(log: Log, found: dict[str, rrd.Rows], prefix: str = "") -> None:
    """Colors of all buildings, their numbers and all curves are the log's."""
    steps = log.steps.tolist()
    wanted = log.column("/buildings", "fieryness").copy()
    wanted[:, log.city.refuge_building] = 9
    shown = rrd.building_colors(found, f"{prefix}/city/buildings", steps, wanted.shape[1])
    assert np.array_equal(shown, np.array((*colors.FIERYNESS_RGB, colors.REFUGE_RGB))[wanted])
    for name in ("temperature", "fuel_share", "water_litres", "fieryness"):
        shown = rrd.at_every_step(found[f"{prefix}/city/handles"][f"Building:{name}"], steps)
        assert np.array_equal(np.array(shown), log.column("/buildings", name))
    for path, fields in (
        {path: [one] for path, one in {**SCORES, **COUNTS}.items()} | {"reward": REWARDS, "tanks": None}
    ).items():
        shown = rrd.at_every_step(found[f"{prefix}/plots/{path}"]["Scalars:scalars"], steps)
        columns = (
            [log.column(*f"/{field}".split(".")) for field in fields]
            if fields
            else log.column("/brigades", "tank_litres").T
        )
        assert np.array_equal(np.array(shown), np.column_stack(list(columns)))


@pytest.mark.parametrize("name", ["quick", "quick-lost"])
def test_one_run(name: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    (log,), found = saved(monkeypatch, tmp_path, name)
    assert_shown(log, found)
    held = [(record.step, record.snapshot.arrays["fire.air"]) for record in log if record.snapshot is not None]
    assert [step for step, _ in found["/air/heat"]["GridMap:data"]] == [step for step, _ in held] == log.snapshots
    for (_, array), (_, shown) in zip(held, found["/air/heat"]["GridMap:data"], strict=True):
        cells = air_cells(log.city, array)
        assert cells.shape == (log.city.air_nx, log.city.air_ny)
        assert cells.sum() == array.sum()  # nothing warm lies in the border
        assert bytes(shown.as_py()[0]) == air_pixels(cells).tobytes()
    assert any(array.any() for _, array in held)


def test_two_runs(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    (first, second), found = saved(monkeypatch, tmp_path, "quick", "quick-lost")
    assert_shown(first, found, "/a")
    assert_shown(second, found, "/b")
    assert found["/diff/log/first_difference"]["TextLog:text"]
