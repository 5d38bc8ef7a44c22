"""What a function of recordings may be given: the path of a recording, or a run that is open or in memory."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from fireworld.errors import LogError, expected
from fireworld.records import Recording, Steps, StoredRun

AnyRun = str | os.PathLike[str] | StoredRun
"""The path of a recording, or a run."""
AnyRecording = str | os.PathLike[str] | Recording
"""The same, for functions that only show it."""

_WANTED = "the path of a recording, or a run"


def open_run(given: AnyRun, *, partial: bool = False) -> StoredRun:
    """Return a run; open it if a path is given.

    Args:
        given: the path of a recording, or a run.
        partial: accept a cut-off or damaged recording too.

    Raises:
        LogError: it is neither, or cannot be read.
    """
    if isinstance(given, str | os.PathLike):
        from fireworld_recorder import reader

        return reader.open_log(Path(given), partial=partial)
    if not isinstance(given, StoredRun):
        raise LogError(expected("recording", "", _WANTED, given))
    return given


def open_to_show(given: Sequence[AnyRecording]) -> list[Recording]:
    """Return one run or two to be shown; those given as paths are opened as far as they are good.

    Raises:
        LogError: they are more or fewer, one is neither a path nor a run, or cannot be read.
    """
    if not 1 <= len(given) <= 2:
        raise LogError(expected("recordings", "", "one or two", str(len(given))))
    for one in given:
        if not (isinstance(one, str | os.PathLike) or hasattr(one, "steps")):
            raise LogError(expected("recording", "", _WANTED, one))
    return [open_run(one, partial=True) if isinstance(one, str | os.PathLike) else one for one in given]


def run_name(run: Steps) -> str:
    """Return what to call a run: its file, or what was run where it has none."""
    path = getattr(run, "path", None)
    return f"{run.header.policy}, seed {run.header.seed}" if path is None else str(path)
