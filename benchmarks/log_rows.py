"""Rows of the recorder: writing a step, reading the history of a building back, and comparing two recordings."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
import zlib
from collections.abc import Iterator
from dataclasses import fields, replace
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
from fireworld_recorder.reader import open_log
from fireworld_recorder.writer import LogWriter

from benchmarks.fires import city_of
from benchmarks.runs import (
    from_the_corner,
    header,
    new_world,
    record_of,
    records,
    run_silently,
    world_of,
    write_log,
)
from benchmarks.timing import Contender, Row, compare, duration, measure
from fireworld.policy.kernel import each_another
from fireworld.records import STEP_TOPICS, StepRecord
from fireworld.simulation.world import World


def as_json(record: StepRecord) -> bytes:
    """Write a step the plain way: a line of JSON, compressed."""
    topics: dict[str, Any] = {}
    for topic in STEP_TOPICS:
        part = getattr(record, topic.topic[1:])
        values = {item.name: getattr(part, item.name) for item in fields(part)}
        topics[topic.topic] = {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in values.items()}
    return zlib.compress(json.dumps({"step": record.step} | topics).encode(), 1)


def write_row(size: int, folder: Path, *, seconds: float) -> Row:
    """Time the writing of one step against a line of compressed JSON. Both flush it to the system."""
    world = new_world(size, 100)
    *_, last = records(world)
    record = replace(last, snapshot=None)
    numbers = count()
    with (folder / "lines.z").open("wb") as lines:
        log = LogWriter(folder / "write.mcap", header(100), record_of(world))

        def in_json(step: StepRecord) -> None:
            lines.write(as_json(step))
            lines.flush()

        def fresh() -> StepRecord:
            return replace(record, step=next(numbers))

        ours, baseline = Contender("LogWriter", log.write, fresh), Contender("JSON", in_json, fresh)
        row = compare("log", "write a step", f"{city_of(size).n_buildings} buildings", ours, baseline, seconds=seconds)
        log.close()
    return row


def observe_row(size: int, n_steps: int, *, seconds: float) -> Row:
    """Time the making of records that nobody writes, step by step of a run."""

    def fresh() -> World:
        return new_world(size, n_steps)

    def observed(world: World) -> None:
        for _ in records(world):
            pass

    n_made = sum(1 for _ in records(fresh()))
    ours = Contender("observed", observed, fresh, parts=n_made)
    baseline = Contender("not observed", partial(run_silently, policy=each_another()), fresh, parts=n_made)
    label = f"{city_of(size).n_buildings} buildings"
    return compare("log", "run and record in memory, a step", label, ours, baseline, seconds=seconds)


def run_row(size: int, n_steps: int, folder: Path, *, seconds: float) -> Row:
    """Time a run that is recorded against the same run that is not."""

    def fresh() -> World:
        return new_world(size, n_steps)

    path = folder / "run.mcap"

    def recorded(world: World) -> None:
        write_log(path, world)

    recorded(fresh())
    n_steps = len(open_log(path)) - 1  # all of them, unless nothing burns any more
    ours = Contender("recorded", recorded, fresh)
    baseline = Contender("not recorded", partial(run_silently, policy=each_another()), fresh)
    label = f"{city_of(size).n_buildings} buildings, {path.stat().st_size / 1e6:.2f} MB"
    row = compare("log", f"run of {n_steps} steps", label, ours, baseline, seconds=seconds)
    extra = (row.seconds - (row.baseline_seconds or 0.0)) / n_steps
    return replace(row, size=f"{label}, recording adds {duration(extra)} a step")


def read_rows(size: int, n_steps: int, folder: Path, *, seconds: float) -> Iterator[Row]:
    """Time the history of one building: its column against a pass over whole steps; and the opening of the log."""
    path = folder / "read.mcap"
    write_log(path, new_world(size, n_steps))
    log = open_log(path)

    def column(_: None) -> object:
        return log.column("/buildings", "temperature")[:, 0]

    def whole_steps(_: None) -> object:
        return [record.buildings.temperature[0] for record in log]

    label = f"{city_of(size).n_buildings} buildings, {len(log)} steps, {path.stat().st_size / 1e6:.1f} MB"
    ours, baseline = Contender("column", column), Contender("whole steps", whole_steps)
    yield compare("log", "history of a building", label, ours, baseline, seconds=seconds)
    opening = Contender("open_log", lambda _: open_log(path))
    yield measure("log", "open and check all of it", label, opening, seconds=seconds)


def other_world(size: int, n_steps: int) -> World:
    """Set up the same world as `new_world`, in which one building less burns at first."""
    return world_of(size, from_the_corner(city_of(size))[1:], n_steps)


def diff_rows(size: int, n_steps: int, folder: Path, *, seconds: float) -> Iterator[Row]:
    """Time `fireworld diff` as a whole process, for recordings that are the same and for two that are not."""
    golden, same, other = (folder / f"{name}.mcap" for name in ("golden", "same", "other"))
    write_log(golden, new_world(size, n_steps))
    shutil.copy(golden, same)
    write_log(other, other_world(size, n_steps))
    label = f"{city_of(size).n_buildings} buildings, {len(open_log(golden))} steps, whole process"
    baseline = Contender('python -c "import numpy"', lambda _: _python("import numpy", code=0))
    for what, path, code in (("the same", same, 0), ("different", other, 1)):
        line = f"import sys; sys.argv = {['fireworld', 'diff', str(golden), str(path)]}"
        ours = Contender("", partial(_diff, line=f"{line}; from fireworld.cli import main; main()", code=code))
        yield compare("log", f"fireworld diff, {what}", label, ours, baseline, seconds=seconds)


def _diff(_: None, *, line: str, code: int) -> None:
    _python(line, code=code)


def _python(line: str, *, code: int) -> None:
    """Start a Python process, wait for its end and check how it ended."""
    done = subprocess.run([sys.executable, "-c", line], check=False, stdout=subprocess.DEVNULL)
    assert done.returncode == code


def rows(*, quick: bool) -> Iterator[Row]:
    """Yield the rows of the recorder."""
    size, n_steps, seconds = (100, 50, 0.3) if quick else (1000, 300, 2.0)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        yield write_row(size, folder, seconds=seconds)
        yield observe_row(size, n_steps, seconds=seconds)
        yield run_row(size, n_steps, folder, seconds=seconds)
        yield from read_rows(size, n_steps, folder, seconds=seconds)
        yield from diff_rows(size, n_steps, folder, seconds=seconds)
