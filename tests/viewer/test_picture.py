"""A real picture: Rerun's viewer without a window draws the saved file, and the fire is to be seen in it."""

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


def test_the_fire_is_seen_to_spread(viewer: Any, tmp_path: Path):
    path = tmp_path / "run.rrd"
    app.save([make_recording(10, 8, 40, speed_m=4.0)], path)
    viewer.open(str(path))
    for _ in range(100):
        state = viewer.get_state()
        if state.recordings and state.recordings[0].timelines and not state.loading:
            break
        time.sleep(0.1)
    assert [(line.name, line.start, line.end) for line in state.recordings[0].timelines] == [("step", 0, 40)]
    assert state.recordings[0].current_time == 0  # it opens at the start of the fire

    early, late = picture(viewer, 3), picture(viewer, 30)
    assert not [report for view in viewer.get_state().views for report in view.reports]
    height, width = early.shape[:2]
    early_map, late_map = (image[height // 20 : height * 7 // 10, : width * 13 // 20] for image in (early, late))
    unburnt, heating, inferno, burnt_out = (colors.FIERYNESS_RGB[code] for code in (0, 1, 3, 8))
    assert n_near(early_map, unburnt) > 20_000  # the whole city, most of it untouched
    assert n_near(early_map, heating) > 200
    assert n_near(early_map, inferno) == 0
    assert n_near(late_map, inferno) > 1_000
    assert n_near(late_map, burnt_out) > 1_000
    assert n_near(late_map, unburnt) < n_near(early_map, unburnt)
    assert n_near(late_map, colors.WATER_RGB) > 100  # water flies
