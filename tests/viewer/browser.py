"""A browser without a window, driven by the WebDriver protocol: Chromium, where it and its driver are installed."""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fireworld_viewer.rerun_view import app

from tests.viewer.pixels import decoded

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
DRIVER = "chromedriver"
ARGUMENTS = (
    "--headless",
    "--no-sandbox",  # tests run as root in containers
    "--no-first-run",
    "--disable-quic",
    "--disable-sync",
    "--disable-component-update",
    "--disable-background-networking",
    "--use-angle=swiftshader",  # WebGL drawn by software
    "--enable-unsafe-swiftshader",
)


def executable() -> str | None:
    """Return the browser's path, if it and its driver are here."""
    found = (shutil.which(name) for name in BROWSERS)
    return next((path for path in found if path), None) if shutil.which(DRIVER) else None


@dataclass(frozen=True)
class Browser:
    """A session of the driver."""

    address: str

    def send(self, method: str, what: str, body: dict[str, Any] | None = None) -> Any:
        """Send a command of the WebDriver protocol and return its value."""
        content = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(f"{self.address}{what}", content, method=method)  # noqa: S310 - this machine
        with urllib.request.urlopen(request, timeout=60) as answer:  # noqa: S310 - the same
            return json.load(answer)["value"]

    def open(self, url: str) -> None:
        """Go to a page."""
        self.send("POST", "/url", {"url": url})

    def execute(self, script: str, *arguments: Any) -> Any:
        """Execute JavaScript in the page and return what it returns."""
        return self.send("POST", "/execute/sync", {"script": script, "args": list(arguments)})

    def devtools(self, command: str, **parameters: Any) -> Any:
        """Send a command of Chromium's own protocol."""
        return self.send("POST", "/goog/cdp/execute", {"cmd": command, "params": parameters})

    def complaints(self) -> list[str]:
        """Return what the console has said since the last call."""
        return [line["message"] for line in self.send("POST", "/se/log", {"type": "browser"})]

    def press(self, key: str) -> None:
        """Press a key and let go of it."""
        strokes = [{"type": stroke, "value": key} for stroke in ("keyDown", "keyUp")]
        self.send("POST", "/actions", {"actions": [{"type": "key", "id": "keyboard", "actions": strokes}]})

    def click(self, x: int, y: int) -> None:
        """Click at a place, in pixels from the upper left."""
        move = {"type": "pointerMove", "x": x, "y": y, "duration": 50}
        strokes = [move, {"type": "pointerDown", "button": 0}, {"type": "pointerUp", "button": 0}]
        self.send("POST", "/actions", {"actions": [{"type": "pointer", "id": "mouse", "actions": strokes}]})

    def screenshot(self) -> bytes:
        """Return what is to be seen, as a PNG file."""
        return base64.b64decode(self.send("GET", "/screenshot"))

    def picture(self) -> np.ndarray:
        """Return what is to be seen, (height, width, 3)."""
        return decoded(self.screenshot())


@contextmanager
def browser(home: Path, *, size: str = "1400,900") -> Iterator[Browser]:
    """Start a browser that ends with the block.

    Args:
        home: where it keeps what it keeps.
        size: of its window, in pixels.
    """
    port = app.free_port()
    root = Browser(f"http://{app.LOCALHOST}:{port}")
    arguments = [*ARGUMENTS, f"--window-size={size}", f"--user-data-dir={home}"]
    wanted = {"browserName": "chrome", "goog:chromeOptions": {"binary": executable(), "args": arguments}}
    with subprocess.Popen([DRIVER, f"--port={port}"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as driver:
        try:
            _await_driver(root, driver)
            try:
                session = root.send("POST", "/session", {"capabilities": {"alwaysMatch": wanted}})["sessionId"]
            except urllib.error.HTTPError as error:  # say, because browser and driver are of different versions
                pytest.skip(f"the browser does not start: {error.read().decode(errors='replace')[:200]}")
            opened = Browser(f"{root.address}/session/{session}")
            try:
                yield opened
            finally:
                opened.send("DELETE", "")
        finally:
            driver.terminate()


def _await_driver(root: Browser, driver: subprocess.Popen[bytes]) -> None:
    for _ in range(200):
        assert driver.poll() is None, "the driver ended"
        try:
            if root.send("GET", "/status")["ready"]:
                return
        except urllib.error.URLError:
            time.sleep(0.1)
    raise AssertionError("the driver did not start")
