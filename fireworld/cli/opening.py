"""Recordings as far as they are good, for commands that show what is there."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from fireworld_recorder.reader import Log


def open_committed(path: Path, *, doing: str) -> Log:
    """Open a log as far as it is good; where that is not to its end, say so and what is done with the rest.

    Raises:
        LogError: it is not a log.
    """
    from fireworld_recorder.reader import open_log

    log = open_log(path, partial=True)
    if log.damage is not None:
        click.echo(f"{path}: {log.damage}; {doing} {len(log.steps)} committed steps", err=True)
    return log
