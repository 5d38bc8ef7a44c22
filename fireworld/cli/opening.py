"""Recordings as far as they are good, for commands that show what is there."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fireworld.cli.compiling import announce_compilation

if TYPE_CHECKING:
    from fireworld_recorder.reader import Log

    from fireworld.training.log.reader import TrainingLog


def open_trainings(paths: Sequence[Path], *, doing: str) -> list[TrainingLog]:
    """Open training logs as `open_one_or_two` does runs; empty if these are none.

    What is shown of them is learned again: it may be announced that kernels are compiled.

    Raises:
        UsageError: there are more than two.
        LogError: one is a training and the other is not.
    """
    _check_number(paths)
    from fireworld_recorder.source import noun_of

    are = [noun_of(path) == "training" for path in paths]
    if not any(are):
        return []
    from fireworld.errors import LogError, expected
    from fireworld.training.log.reader import open_training

    if not all(are):
        other = paths[are.index(False)]
        raise LogError(expected(str(other), "", "the log of a training, as the other one", "no training"))
    logs = [open_training(path, partial=True) for path in paths]
    for log in logs:
        if log.damage is not None:
            click.echo(f"{log.path}: {log.damage}; {doing} {len(log)} committed {log.header.unit}s", err=True)
    announce_compilation()
    return logs


def open_to_replay(path: Path) -> Log:
    """Open a log that is to be replayed; then it may be announced that kernels are compiled.

    Raises:
        LogError: it is not a log, is cut off or damaged, or was imported and cannot be replayed.
    """
    from fireworld_recorder import reader

    from fireworld.recording.inputs import check_replayable

    log = reader.open_log(path)
    check_replayable(log)
    announce_compilation()
    return log


def open_one_or_two(paths: Sequence[Path], *, doing: str) -> list[Log]:
    """Open logs as far as they are good; where that is not to the end, print so and what is done with the rest.

    Raises:
        UsageError: there are more than two.
        LogError: one is not a log.
    """
    _check_number(paths)
    from fireworld_recorder import reader

    logs = [reader.open_log(path, partial=True) for path in paths]
    for log, path in zip(logs, paths, strict=True):
        if log.damage is not None:
            click.echo(f"{path}: {log.damage}; {doing} {len(log.steps)} committed steps", err=True)
    return logs


def _check_number(paths: Sequence[Path]) -> None:
    if len(paths) > 2:
        raise click.UsageError(f"Expected one or two recordings, got {len(paths)}.")
