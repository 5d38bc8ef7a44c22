"""Rerun's viewer without a window: pictures of what it shows; `python -m tests.viewer.headless` takes those of docs."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from fireworld_viewer.rerun_view import app

from tests.docs.pages import ROOT
from tests.viewer.pixels import decoded

DRIVERS = ("/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d", "/usr/local/share/vulkan/icd.d")


def has_driver() -> bool:
    """Tell whether something here can draw."""
    return any(Path(folder).is_dir() and any(Path(folder).iterdir()) for folder in DRIVERS)


@contextmanager
def headless(home: Path, *, size: str = "1400x900") -> Iterator[tuple[Any, str]]:
    """Start a viewer without a window, on this machine only; yield it, and the address to stream to."""
    from rerun.experimental import ViewerClient

    port = app.free_port()
    command = [str(app.viewer_executable()), "--headless", "--window-size", size]
    command += ["--bind", app.LOCALHOST, "--port", str(port)]
    environment = {**app.viewer_environment(os.environ), "HOME": str(home), "RUST_LOG": "off"}
    address = f"rerun+http://{app.LOCALHOST}:{port}/proxy"
    with subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            yield connect(lambda: ViewerClient.connect(address), process), address
        finally:
            process.terminate()
            process.wait(timeout=20)


def connect(client: Callable[[], Any], process: subprocess.Popen[bytes]) -> Any:
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


def screenshot(viewer: Any, step: int) -> bytes:
    """Take pictures at a step until two are equal; return a PNG file."""
    viewer.set_time("step", sequence=step)
    last = b""
    for _ in range(100):
        taken: bytes = viewer.take_screenshot()
        if taken == last:
            return taken
        last = taken
        time.sleep(0.1)
    raise AssertionError("the picture did not come to rest")


def picture(viewer: Any, step: int) -> np.ndarray:
    """Return what is to be seen at a step, (height, width, 3)."""
    return decoded(screenshot(viewer, step))


def opened(viewer: Any, path: Path) -> Any:
    """Open a file and return what the viewer says of it once it is loaded."""
    viewer.open(str(path))
    return loaded(viewer)


def loaded(viewer: Any) -> Any:
    """Return what the viewer says of what it shows, once that is loaded."""
    for _ in range(100):
        state = viewer.get_state()
        if state.recordings and state.recordings[0].timelines and not state.loading:
            return state
        time.sleep(0.1)
    raise AssertionError("nothing was loaded")


def main() -> None:
    """Take the pictures of docs/viewer.md: of one run, and of two side by side."""
    if not has_driver():
        sys.exit("no Vulkan driver here: the pictures of the viewer stay as they are")
    names = {"viewer": (("default.mcap",), 38), "viewer-two": (("alone.mcap", "together.mcap"), 60)}
    for name, (logs, step) in names.items():
        with tempfile.TemporaryDirectory() as folder, headless(Path(folder)) as (viewer, _):
            path = Path(folder) / "view.rrd"
            recorded = [str(ROOT / "recordings" / f"picture-{log}") for log in logs]
            subprocess.run([sys.executable, "-c", CALL, "view", *recorded, "--save", str(path)], check=True)
            opened(viewer, path)
            (ROOT / "docs" / "pictures" / f"{name}.png").write_bytes(screenshot(viewer, step))


CALL = "from fireworld.cli import main; main()"

if __name__ == "__main__":
    main()
