"""Take the picture of docs/play.md: `python -m tests.viewer.play_picture`, after `make pictures` has made the runs."""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import fireworld as fw
from tests.docs.pages import ROOT
from tests.viewer.browser import browser, executable

LOG, STEP, SIZE = "picture-default.mcap", 38, "1400,1000"


def main() -> None:
    """Open the page at a step, and write what is to be seen."""
    if executable() is None:
        sys.exit("no browser here: the picture of the page stays as it is")
    with tempfile.TemporaryDirectory() as folder, browser(Path(folder) / "profile", size=SIZE) as page:
        made = fw.play(ROOT / "recordings" / LOG, output=Path(folder) / "play.html")
        wide, high = map(int, SIZE.split(","))
        page.devtools("Emulation.setDeviceMetricsOverride", width=wide, height=high, deviceScaleFactor=1, mobile=False)
        page.open(f"{made.as_uri()}#{STEP}")
        while page.execute("return document.documentElement.dataset.ready") != "yes":
            time.sleep(0.1)
        time.sleep(0.5)
        (ROOT / "docs" / "pictures" / "play.png").write_bytes(page.screenshot())


if __name__ == "__main__":
    main()
