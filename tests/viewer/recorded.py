"""The made-up recordings as files."""

from __future__ import annotations

from pathlib import Path

from fireworld_recorder.writer import LogWriter

from fireworld.records import MemoryRecording


def write_log(path: Path, recording: MemoryRecording, *, last: int | None = None) -> Path:
    """Write a recording to a file and return its path; with `last`, as one that was cut off after that step."""
    with LogWriter(path, recording.header, recording.city) as log:
        for record in recording:
            log.write(record)
            if record.step == last:
                whole = path.with_name(path.name + ".partial").read_bytes()
    if last is not None:
        path.write_bytes(whole)
    return path
