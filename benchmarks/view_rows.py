"""Rows of the viewer: turning a log into a Rerun file."""

from __future__ import annotations

import importlib.util
import tempfile
from collections.abc import Iterator
from pathlib import Path

from benchmarks.fires import city_of
from benchmarks.runs import new_world, write_log
from benchmarks.timing import Contender, Row, compare
from recorder.reader import open_log
from viewer.app import save


def rows(*, quick: bool) -> Iterator[Row]:
    """Yield the rows of the viewer; none where Rerun is not installed."""
    if importlib.util.find_spec("rerun") is None:
        return
    size, n_steps, seconds = (100, 50, 0.3) if quick else (1000, 300, 3.0)
    with tempfile.TemporaryDirectory() as name:
        log_path, view_path = Path(name, "run.mcap"), Path(name, "run.rrd")
        write_log(log_path, new_world(size, n_steps))

        def convert(_: None) -> None:
            save([open_log(log_path)], view_path, force=True)

        def read_only(_: None) -> int:
            return sum(1 for _ in open_log(log_path))

        convert(None)
        n_steps = len(open_log(log_path))
        label = f"{city_of(size).n_buildings} buildings, {n_steps} steps, {view_path.stat().st_size / 1e6:.1f} MB"
        ours, baseline = Contender("view --save", convert), Contender("reading the log", read_only)
        yield compare("view", "log to Rerun file", label, ours, baseline, seconds=seconds)
