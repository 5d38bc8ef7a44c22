"""Rows of the viewer: turning logs into Rerun files, one run and two; sending a run step by step; moving the cursor."""

from __future__ import annotations

import importlib.util
import tempfile
from collections.abc import Iterator
from itertools import cycle
from pathlib import Path
from typing import Final

from fireworld_recorder.reader import open_log
from fireworld_viewer.rerun_view.app import save
from fireworld_viewer.story.steps import select_steps

from benchmarks.fires import city_of
from benchmarks.runs import new_world, write_log
from benchmarks.timing import Contender, Row, compare
from fireworld.records import MemoryRecording
from tests.viewer.headless import has_driver, headless, opened, screenshot

N_STEPS: Final = 300
VISITED: Final = (1, 5, 3, 4, 2)
"""Where the cursor goes, in sixths of the run."""


def rows(*, quick: bool) -> Iterator[Row]:
    """Yield the rows of the viewer; none where Rerun is not installed."""
    if importlib.util.find_spec("rerun") is None:
        return
    seconds, sizes = (0.3, (100,)) if quick else (3.0, (1000, 4000))
    with tempfile.TemporaryDirectory() as name:
        for size in sizes:
            log_path = Path(name, f"run-{size}.mcap")
            write_log(log_path, new_world(size, 50 if quick else N_STEPS))
            yield _to_file("log to Rerun file", log_path, size, n_runs=1, seconds=seconds)
            if size == sizes[0]:
                if has_driver():
                    yield _cursor(log_path, size, seconds=seconds)
                yield _to_file("two logs to one Rerun file", log_path, size, n_runs=2, seconds=seconds)
                yield _by_steps(log_path, size, seconds=seconds)


def _to_file(what: str, log_path: Path, size: int, *, n_runs: int, seconds: float) -> Row:
    view_path = log_path.with_suffix(".rrd")

    def convert(_: None) -> None:
        save([select_steps(open_log(log_path)) for _ in range(n_runs)], view_path, force=True)

    def read_only(_: None) -> int:
        return n_runs * sum(1 for _ in open_log(log_path))

    convert(None)
    label = _label(log_path, size) + f", {view_path.stat().st_size / 1e6:.1f} MB"
    ours, baseline = Contender("view --save", convert), Contender("reading the log", read_only)
    return compare("view", what, label, ours, baseline, seconds=seconds)


def _by_steps(log_path: Path, size: int, *, seconds: float) -> Row:
    """Send a run step by step, as a live view does, beside all steps at once."""
    import rerun
    from fireworld_viewer.rerun_view.run_layers import RunLayers

    whole = select_steps(open_log(log_path))
    parts = [MemoryRecording(whole.header, whole.city, [record]) for record in whole]

    def send(recordings: list[MemoryRecording]) -> None:
        stream = rerun.RecordingStream("benchmark", send_properties=False)
        memory = stream.memory_recording()
        layers = RunLayers(stream, whole.city)
        for recording in recordings:
            layers.add(recording)
        memory.drain_as_bytes()

    ours = Contender("RunLayers.add for each step", lambda _: send(parts))
    baseline = Contender("for all steps at once", lambda _: send([whole]))
    return compare("view", "a run sent step by step", _label(log_path, size), ours, baseline, seconds=seconds)


def _cursor(log_path: Path, size: int, *, seconds: float) -> Row:
    """Move the cursor and wait until the picture is that of the step; drawn without a window, by software."""
    view_path = log_path.with_suffix(".rrd")
    recording = select_steps(open_log(log_path))
    save([recording], view_path, force=True)
    last = int(recording.steps[-1])
    steps = [last * place // 6 for place in VISITED]
    with tempfile.TemporaryDirectory() as home, headless(Path(home)) as (viewer, _):
        opened(viewer, view_path)
        for _ in range(2):  # what a panel shows may depend on where the cursor came from: the second round counts
            at_rest = {step: screenshot(viewer, step) for step in steps}
        turns = cycle(steps)

        def move(step: int) -> None:
            viewer.set_time("step", sequence=step)
            while viewer.take_screenshot() != at_rest[step]:
                pass

        ours = Contender("cursor moved, step drawn", move, lambda: next(turns))
        baseline = Contender("a picture without moving", lambda _: viewer.take_screenshot())
        return compare("view", "moving the cursor", _label(log_path, size), ours, baseline, seconds=seconds)


def _label(log_path: Path, size: int) -> str:
    return f"{city_of(size).n_buildings} buildings, {len(open_log(log_path))} steps"
