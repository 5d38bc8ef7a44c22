"""Read a Rerun file back as plain tables, and run Rerun's own program."""

from __future__ import annotations

import os
import subprocess
from collections import defaultdict
from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np
from fireworld_viewer.rerun_view import app

Rows = dict[str, list[tuple[int | None, Any]]]


def read(path: Path, *, timelines: Collection[str] = ("step",)) -> dict[str, Rows]:
    """Entity path to component to (step, list of values) in order; step None is static."""
    from rerun.chunk import RrdReader

    found: dict[str, Rows] = defaultdict(lambda: defaultdict(list))
    for chunk in RrdReader(path).stream():
        batch = chunk.to_record_batch()
        assert set(chunk.timeline_names) <= set(timelines)
        steps = [None] * chunk.num_rows if chunk.is_static else batch.column("step").to_pylist()
        for name in batch.schema.names:
            if name in timelines or "RowId" in name:
                continue
            found[chunk.entity_path][name].extend(zip(steps, batch.column(name), strict=True))
    for rows in found.values():
        for component in rows.values():
            component.sort(key=lambda row: -1 if row[0] is None else row[0])
    return found


def read_all(path: Path) -> dict[str, Rows]:
    """Read a file of several recordings, each on its timeline; what is there always has no number."""
    from rerun.chunk import RrdReader

    found: dict[str, Rows] = defaultdict(lambda: defaultdict(list))
    reader = RrdReader(path)
    for store in reader.recordings():
        for chunk in reader.stream(store=store):
            batch = chunk.to_record_batch()
            times = [batch.column(name).to_pylist() for name in chunk.timeline_names] or [[None] * chunk.num_rows]
            for name in batch.schema.names:
                if "RowId" not in name and name not in chunk.timeline_names:
                    found[chunk.entity_path][name].extend(zip(times[0], batch.column(name), strict=True))
    return found


def at_every_step(rows: list[tuple[int | None, Any]], steps: list[int]) -> list[np.ndarray]:
    """What a viewer shows of a component at each step: the latest row."""
    shown, latest, place = [], None, 0
    for step in steps:
        while place < len(rows) and (rows[place][0] is None or rows[place][0] <= step):
            latest = rows[place][1]
            place += 1
        assert latest is not None
        shown.append(np.asarray(latest.as_py() or []))
    return shown


def building_colors(found: dict[str, Rows], path: str, steps: list[int], n_buildings: int) -> np.ndarray:
    """Return the colors of buildings that a mesh's picture has at each step, (k, n_buildings, 3)."""
    pictures = at_every_step(found[path]["Mesh3D:albedo_texture_buffer"], steps)
    return np.array([np.asarray(one, dtype=np.uint8).reshape(-1, 3)[:n_buildings] for one in pictures])


def rerun_program(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [str(app.viewer_executable()), *arguments],
        env=app.viewer_environment(os.environ),
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
