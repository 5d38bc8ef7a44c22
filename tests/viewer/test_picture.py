"""Real pictures: Rerun's viewer without a window draws saved files, and the fire and the difference are to be seen."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from fireworld_viewer import colors
from fireworld_viewer.rerun_view import app
from fireworld_viewer.rerun_view.pages import OutcomePage

from tests import command_line
from tests.viewer.conftest import make_recording
from tests.viewer.headless import has_driver, headless, loaded, opened, picture
from tests.viewer.pixels import n_near, part

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        not has_driver(),
        reason="no Vulkan driver here; on Debian: apt-get install mesa-vulkan-drivers libvulkan1",
    ),
]


@pytest.fixture
def viewer(tmp_path: Path) -> Iterator[Any]:
    """A viewer without a window that ends with the test."""
    with headless(tmp_path) as (client, _):
        yield client


def test_the_fire_is_seen_to_spread(viewer: Any, tmp_path: Path):
    path = tmp_path / "run.rrd"
    app.save([make_recording(10, 8, 40, speed_m=4.0)], path)
    state = opened(viewer, path)
    assert [(line.name, line.start, line.end) for line in state.recordings[0].timelines] == [("step", 0, 40)]
    assert state.recordings[0].current_time == 0  # it opens at the start of the fire

    early, late = picture(viewer, 3), picture(viewer, 30)
    assert not [report for view in viewer.get_state().views for report in view.reports]
    early_map, late_map = (part(image, rows=(0.05, 0.7), columns=(0.0, 0.65)) for image in (early, late))
    unburnt, heating, inferno, burnt_out = (colors.FIERYNESS_RGB[code] for code in (0, 1, 3, 8))
    assert n_near(early_map, unburnt) > 20_000  # the whole city, most of it untouched
    assert n_near(early_map, heating) > 200
    assert n_near(early_map, inferno) == 0
    assert n_near(late_map, inferno) > 1_000
    assert n_near(late_map, burnt_out) > 1_000
    assert n_near(late_map, unburnt) < n_near(early_map, unburnt)
    assert n_near(late_map, colors.WATER_RGB) > 100  # water flies


def test_two_runs_are_seen_side_by_side_with_their_difference(viewer: Any, tmp_path: Path):
    path = tmp_path / "pair.rrd"
    faster, slower = make_recording(10, 8, 40, speed_m=6.0), make_recording(10, 8, 40, speed_m=3.0)
    outcome = OutcomePage(heads=["a", "b"], rows=[("steps", "41", "41")], first_step=3, first_sentence="step 3")
    app.save([faster, slower], path, outcome=outcome)
    state = opened(viewer, path)
    assert state.recordings[0].current_time == 0
    image = picture(viewer, 25)
    assert not [report for view in viewer.get_state().views for report in view.reports]
    first, second, change = (
        part(image, rows=(0.05, 0.42), columns=(place / 3, (place + 1) / 3 - 0.01)) for place in range(3)
    )
    inferno, better = colors.FIERYNESS_RGB[3], colors.BETTER_RGB
    assert n_near(first, inferno) > 300
    assert n_near(second, inferno) > 100
    assert n_near(change, inferno) == 0
    assert n_near(change, better) > 1_000  # the slower fire has done less damage
    assert n_near(change, colors.WORSE_RGB) < n_near(change, better)
    lane = part(image, rows=(0.42, 0.58), columns=(0.0, 1.0))
    reddish = (lane[..., 0] > 120) & (lane[..., 1] < 80) & (lane[..., 2] < 80)
    assert reddish.sum() > 1_000  # the buildings differ most of the time


def test_a_run_is_seen_while_it_happens(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    with headless(tmp_path) as (viewer, address):
        done = command_line.call(monkeypatch, "run", "quick", "--policy", "chief", "--view-url", address)
        assert (done.code, done.err) == (0, "")
        assert [line.name for line in loaded(viewer).recordings[0].timelines] == ["step"]
        image = picture(viewer, 62)  # it follows what happens: the run is over, and the fire out
    seen = part(image, rows=(0.05, 0.7), columns=(0.0, 0.65))
    unburnt, heating, inferno, minor_damage = (colors.FIERYNESS_RGB[code] for code in (0, 1, 3, 5))
    assert n_near(seen, unburnt) > 20_000
    assert n_near(seen, minor_damage) > 1_000
    assert n_near(seen, heating) == n_near(seen, inferno) == 0
