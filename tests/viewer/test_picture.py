"""Real pictures: Rerun's viewer without a window draws saved files, and the fire and the difference are to be seen."""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.viewer.conftest import make_recording
from viewer import app, colors
from viewer.outcome import Outcome

DRIVERS = ("/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d", "/usr/local/share/vulkan/icd.d")

pytestmark = pytest.mark.skipif(
    not any(Path(folder).is_dir() and any(Path(folder).iterdir()) for folder in DRIVERS),
    reason="no Vulkan driver here; on Debian: apt-get install mesa-vulkan-drivers libvulkan1",
)


@pytest.fixture
def viewer(tmp_path: Path) -> Iterator[Any]:
    """A viewer without a window, on this machine only, that ends with the test."""
    from rerun.experimental import ViewerClient

    port = app.free_port()
    command = [str(app.viewer_executable()), "--headless", "--bind", app.LOCALHOST, "--port", str(port)]
    environment = {**app.viewer_environment(os.environ), "HOME": str(tmp_path), "RUST_LOG": "off"}
    with subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            yield connect(lambda: ViewerClient.connect(f"rerun+http://{app.LOCALHOST}:{port}/proxy"), process)
        finally:
            process.terminate()
            process.wait(timeout=20)


def connect(client: Any, process: subprocess.Popen[bytes]) -> Any:
    for _ in range(300):
        assert process.poll() is None, "the viewer ended"
        try:
            connected = client()
            connected.get_state()
        except Exception:  # noqa: BLE001 - whatever it is, the viewer is not ready
            time.sleep(0.1)
        else:
            return connected
    raise AssertionError("the viewer did not start")


def picture(viewer: Any, step: int) -> np.ndarray:
    """Take pictures at a step until two are equal; return (height, width, 3)."""
    import io

    from matplotlib.image import imread

    viewer.set_time("step", sequence=step)
    last = b""
    for _ in range(100):
        taken = viewer.take_screenshot()
        if taken == last:
            return (imread(io.BytesIO(taken))[..., :3] * 255).round().astype(np.uint8)
        last = taken
        time.sleep(0.1)
    raise AssertionError("the picture did not come to rest")


def n_near(image: np.ndarray, rgb: colors.Rgb, *, tolerance: int = 10) -> int:
    """How many pixels have about a color."""
    return int(np.all(np.abs(image.astype(int) - rgb) <= tolerance, axis=-1).sum())


def opened(viewer: Any, path: Path) -> Any:
    """Open a file and return what the viewer says of it once it is loaded."""
    viewer.open(str(path))
    for _ in range(100):
        state = viewer.get_state()
        if state.recordings and state.recordings[0].timelines and not state.loading:
            return state
        time.sleep(0.1)
    raise AssertionError("the file was not loaded")


def part(image: np.ndarray, *, rows: tuple[float, float], columns: tuple[float, float]) -> np.ndarray:
    """Cut a picture, by shares of its height and width."""
    height, width = image.shape[:2]
    (top, bottom), (left, right) = rows, columns
    return image[int(height * top) : int(height * bottom), int(width * left) : int(width * right)]


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
    outcome = Outcome(heads=["a", "b"], rows=[("steps", "41", "41")], first_step=3, first_sentence="step 3")
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
