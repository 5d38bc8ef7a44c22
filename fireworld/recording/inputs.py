"""What a function of recordings may be given: the path of a recording, or a run that is open or in memory."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeGuard

from fireworld.errors import LogError, expected
from fireworld.records import Recording, Steps, StoredRun

if TYPE_CHECKING:
    from fireworld.training.log.reader import TrainingLog

AnyRun = str | os.PathLike[str] | StoredRun
"""The path of a recording, or a run."""
AnyRecording = str | os.PathLike[str] | Recording
"""The same, for functions that only show it."""

_WANTED = "the path of a recording, or a run"


def is_training(given: object) -> TypeGuard[str | os.PathLike[str] | TrainingLog]:
    """Return whether a training log is given, or the path of one."""
    if isinstance(given, str | os.PathLike):
        from fireworld_recorder.source import noun_of

        return noun_of(Path(given)) == "training"
    return hasattr(given, "raw_parts")


def open_run(given: object, *, partial: bool = False) -> StoredRun:
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


def check_replayable(run: Steps) -> None:
    """Check that a run can be replayed at all.

    Raises:
        LogError: it was imported from an official log, which has no decisions.
    """
    if run.header.imported:
        why = f"it was imported ({run.header.origin}), and has no decisions to replay"
        raise LogError(f"{run_name(run)}: {why}; `fireworld info`, view, render, report, diff and export show it")


def open_one_or_two(given: AnyRun | Sequence[AnyRun]) -> list[StoredRun]:
    """Return one run or two; those given as paths are opened as far as they are good.

    Raises:
        LogError: they are more or fewer, one is neither a path nor a run, or cannot be read.
    """
    return [open_run(one, partial=True) for one in _listed(given)]


def open_to_show(given: AnyRecording | Sequence[AnyRecording]) -> list[Recording]:
    """Return one recording or two to be shown, as `open_one_or_two` does; these need not know their digests."""
    return [open_run(one, partial=True) if isinstance(one, str | os.PathLike) else one for one in _listed(given)]


def _listed(given: object) -> list[Any]:
    """Return a list of the one or two that were given."""
    many = list(given) if isinstance(given, list | tuple) else [given]
    if not 1 <= len(many) <= 2:
        raise LogError(expected("recordings", "", "one or two", str(len(many))))
    for one in many:
        if not (isinstance(one, str | os.PathLike) or hasattr(one, "steps")):
            raise LogError(expected("recording", "", _WANTED, one))
    return many


def run_name(run: Steps) -> str:
    """Return what to call a run: its file, or what was run where it has none."""
    path = getattr(run, "path", None)
    return f"{run.header.policy}, seed {run.header.seed}" if path is None else str(path)
