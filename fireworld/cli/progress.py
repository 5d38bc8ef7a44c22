"""Progress on the error stream, where people watch it; it leaves nothing behind."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from pathlib import Path

    from rich.progress import Progress, ProgressColumn

BAR: Final = "<bar>"
COUNT: Final = "<count>"
ELAPSED: Final = "<elapsed>"
LEFT: Final = "<left>"
"""Columns that are not words: a bar, how many of how many, the time so far, the time left."""
DESCRIPTION: Final = "{task.description}"
"""The column that says what a bar is about."""


def is_watched() -> bool:
    """Tell whether people watch the error stream."""
    from rich.console import Console

    return Console(stderr=True).is_terminal


@contextmanager
def bars(*columns: str, quiet: bool = False) -> Iterator[Progress]:
    """Show bars, one for each task that is added; nothing where nobody watches.

    Args:
        columns: what a bar has from left to right: words, with what they tell of the task in braces, and BAR and the
            like. Rich's own if none are named.
        quiet: show nothing in any case.
    """
    from rich.console import Console
    from rich.progress import Progress

    console = Console(stderr=True)
    made = [_column(column) for column in columns]
    console.quiet = quiet or not console.is_terminal  # or Rich 14 writes an empty line
    with Progress(*made, console=console, transient=True, disable=console.quiet) as progress:
        yield progress


@contextmanager
def bar(what: str, total: int | None, *columns: str, quiet: bool = False) -> Iterator[Callable[[], None]]:
    """Show one bar, as `bars`, and give what is to be called after each of its parts.

    Args:
        what: its description.
        total: how many parts it has; None: nobody knows.
        columns: as for `bars`.
        quiet: show nothing in any case.
    """
    with bars(*columns, quiet=quiet) as progress:
        task = progress.add_task(what, total=total)
        yield lambda: progress.advance(task)


@contextmanager
def runs_bar(results: Path | None) -> Iterator[Callable[[int, int], None]]:
    """Show a bar of the runs that are made, and say how many are known.

    Args:
        results: the file that they are known from, if there is one.
    """
    import click

    with bars(DESCRIPTION, BAR, COUNT, LEFT) as progress:
        bar = progress.add_task("runs", total=None)
        n_known = -1

        def on_run(n_done: int, n_all: int) -> None:
            nonlocal n_known
            if n_known < 0:
                n_known = n_done
                if n_known:
                    click.echo(f"{n_known} of {n_all} runs are known from {results}", err=True)
            progress.update(bar, completed=n_done - n_known, total=n_all - n_known)

        yield on_run


def _column(name: str) -> ProgressColumn:
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    kinds = {BAR: BarColumn, COUNT: MofNCompleteColumn, ELAPSED: TimeElapsedColumn, LEFT: TimeRemainingColumn}
    return kinds[name]() if name in kinds else TextColumn(name)
