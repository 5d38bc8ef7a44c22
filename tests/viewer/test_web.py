"""The view in a browser: a real one opens the page that `--web` serves, draws the fire, and plays it."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from fireworld_viewer import colors
from fireworld_viewer.rerun_view.app import free_port

from tests import command_line
from tests.viewer.browser import Browser, browser, executable
from tests.viewer.headless import CALL
from tests.viewer.pixels import n_near, part

PATIENCE_SECONDS = 120.0
"""Drawing by software takes long where others compute too."""

pytestmark = [
    pytest.mark.heavy,
    pytest.mark.skipif(
        executable() is None, reason="no browser here; on Debian: apt-get install chromium chromium-driver"
    ),
]


@pytest.fixture
def served(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """Serve a recording as people do; yield the address that it says to open. Ctrl-C ends it well."""
    log = tmp_path / "run.mcap"
    assert command_line.call(monkeypatch, "run", "quick", "--policy", "chief", "--record", str(log)).code == 0
    command = [sys.executable, "-c", CALL, "view", str(log), "--web", "--port", str(free_port())]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        try:
            assert process.stdout is not None
            said = process.stdout.readline()
            found = re.search(r"http://127\.0\.0\.1:\S+", said)
            assert found, said
            yield found[0]
            process.send_signal(signal.SIGINT)
            assert process.wait(timeout=20) == 0
        finally:
            process.kill()


def seen(page: Browser, what: Callable[[np.ndarray], bool]) -> np.ndarray:
    """Look until something is to be seen; return the picture."""
    late = time.monotonic() + PATIENCE_SECONDS
    while time.monotonic() < late:
        image = page.picture()
        if what(image):
            return image
        time.sleep(0.2)
    raise AssertionError("it did not come to be seen")


def test_a_browser_draws_the_fire_and_plays_it(served: str, tmp_path: Path):
    with browser(tmp_path / "profile") as page:
        page.open(served)

        def on_map(image: np.ndarray, rgb: colors.Rgb) -> int:
            return n_near(part(image, rows=(0.1, 0.6), columns=(0.0, 0.6)), rgb)

        heating, minor_damage = colors.FIERYNESS_RGB[1], colors.FIERYNESS_RGB[5]
        first = seen(page, lambda image: on_map(image, heating) > 500)
        assert on_map(first, colors.FIERYNESS_RGB[0]) > 20_000
        assert on_map(first, minor_damage) < 50

        def in_curves(image: np.ndarray, rgb: colors.Rgb) -> int:
            return n_near(part(image, rows=(0.06, 0.7), columns=(0.66, 1.0)), rgb)

        drawn = seen(page, lambda image: in_curves(image, colors.BRIGADE_RGB[0]) > 100)
        assert in_curves(drawn, (255, 255, 255)) > 50_000  # the browser's own taste, and yet all curves are to be seen

        page.press(" ")  # plays, to the end of the fire
        seen(page, lambda image: on_map(image, minor_damage) > 500)
