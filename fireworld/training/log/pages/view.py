"""Trainings in Rerun: curves over the episodes, the tables as a picture; from logs, or while a team learns."""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from fireworld_viewer.rerun_view import app
from fireworld_viewer.rerun_view.training_curves import (
    CurveWriter,
    LayoutTab,
    TablePixels,
    TrainingLayout,
    TrainingPoint,
)
from fireworld_viewer.table_pixels import table_pixels

from fireworld.errors import LogError, expected
from fireworld.files import text_of
from fireworld.records import ACTIONS
from fireworld.training.log.course import TablePicture, opening, table_picture
from fireworld.training.log.reader import AnyTraining, TrainingLog, opened
from fireworld.training.log.records import Episode, Tables
from fireworld.training.method import Report, Trainer

TALL: Final = 3
"""Pixels of a table's row in the picture; a moment is so wide that the picture is about three times as wide as high."""
TABLES_HELP: Final = (
    "A row for each of the {n} states that were learned in most, and in it one for each brigade; a column for each"
    " moment at which the tables are recorded whole. The color is the greedy action: "
    "easiest blue, nearest-to-civilian vermilion, nearest-to-center yellow, nearest-to-me green."
    " The darker it is, the more the state costs; grey: never visited."
)


def layout_of(trainers: Sequence[Trainer[Any, Any]], names: Sequence[str]) -> TrainingLayout:
    """Return what is drawn: plots that teams of these names share, and a tab for each that has plots of its own."""
    first = trainers[0]
    return TrainingLayout(
        title=f"training-{first.method.name}",
        timeline=first.unit,
        plots=first.plots,
        teams=names,
        tabs={
            name.capitalize() or "The team": LayoutTab(team, trainer.own_plots())
            for team, (trainer, name) in enumerate(zip(trainers, names, strict=True))
            if trainer.own_plots()
        },
        bands="Scenario" if Tables in first.topics else "",
        log="Milestones",
    )


def point_of(trainer: Trainer[Any, Any], report: Report, *, number: int, team: int, command: str = "") -> TrainingPoint:
    """Return the number-th report of a team as it is drawn; the command opens it."""
    return TrainingPoint(
        number=number,
        team=team,
        values=trainer.points(report),
        band=report.place,
        mark=report.ending,
        note="; ".join(filter(None, (report.text, command))) if report.milestone else "",
        page=trainer.page(),
    )


def view_trainings(
    logs: AnyTraining | Sequence[AnyTraining],
    *,
    save: Path | str | None = None,
    force: bool = False,
    web: bool = False,
    port: int | None = None,
    announce: Callable[[str], None] = print,
) -> None:
    """Show one training, or two of one method, in Rerun; return when its window is closed.

    Args:
        logs: paths of training logs, or logs that are open; as far as they are good.
        save: a Rerun file to write instead.
        force: replace an existing file.
        web: serve the view to browsers on this machine until Ctrl-C instead.
        port: of that page.
        announce: called with its address.

    Raises:
        LogError: one cannot be read, or they are of two methods.
        OutputError: the file cannot be written.
        ViewError: there is no Rerun, or no display.
    """
    opened = open_trainings(logs)
    identity = hashlib.sha256("".join(f"{text_of(one.path.name)} {one.digest}" for one in opened).encode()).hexdigest()
    title = f"training-{opened[0].method.name}"
    write = functools.partial(
        app.save_training, functools.partial(_write, opened), identity=identity, title=title, force=force
    )
    if save is not None:
        write(Path(save))
    elif web:
        app.serve(write, port=port or app.WEB_PORT, announce=announce)
    else:
        app.show(write)


def open_trainings(logs: AnyTraining | Sequence[AnyTraining]) -> list[TrainingLog]:
    """Return one or two training logs of one method, open as far as they are good, each with a part at least.

    Raises:
        LogError: they are more or fewer, of two methods, or one cannot be read or is empty.
    """
    given: list[Any] = list(logs) if isinstance(logs, list | tuple) else [logs]
    if not 1 <= len(given) <= 2:
        raise LogError(expected("trainings", "", "one or two", str(len(given))))
    trainings = [opened(one, partial=True) for one in given]
    for one in trainings:
        if not len(one):
            raise LogError(f"{one.path}: it holds no {one.header.unit}s; there is nothing to show")
        if one.method.name != trainings[0].method.name:
            wanted = f"{trainings[0].method.name}, as in {trainings[0].path}"
            raise LogError(expected(str(one.path), "method", wanted, one.method.name))
    return trainings


def names_of(logs: Sequence[TrainingLog]) -> list[str]:
    """Return what to call trainings: the names of their files, and their paths where these are the same."""
    names = [text_of(one.path.name) for one in logs]
    if len(set(names)) == len(names):
        return names
    return [f"{letter}: {one.path}" for letter, one in zip("AB", logs, strict=True)]


def _write(logs: Sequence[TrainingLog], stream: Any) -> None:
    """Write all that is to be seen of trainings."""
    names = names_of(logs)
    pictures = [table_picture(log) for log in logs]
    layout = layout_of([log.trainer() for log in logs], names if len(logs) > 1 else [""])
    tables = {
        f"Tables of {name}": LayoutTab(team)
        for team, (name, picture) in enumerate(zip(names, pictures, strict=True))
        if picture is not None
    }
    layout = replace(layout, tabs={**layout.tabs, **tables}, n_parts=max(map(len, logs)))
    writer = CurveWriter(stream, layout)
    writer.write([point for team, log in enumerate(logs) for point in _points(log, team)])
    for team, picture in enumerate(pictures):
        if picture is not None:
            writer.write_tables(team, _table_pixels(picture))


def _points(log: TrainingLog, team: int) -> Iterator[TrainingPoint]:
    """Yield what is drawn of each part of a log, with the command that opens it where a scenario ended."""
    names = [one.name for one in log.scenarios]
    trainer = log.trainer()
    for number, part in enumerate(log.parts()):
        report, episode = log.follow(trainer, part, number), part.get(Episode)
        command = opening(log, names[episode.scenario], episode.episode) if report.milestone and episode else ""
        yield point_of(trainer, report, number=number, team=team, command=command)


def _table_pixels(picture: TablePicture) -> TablePixels:
    """Return the picture of the tables in pixels."""
    pixels = table_pixels(picture.action, picture.value)
    wide = max(1, 3 * TALL * len(pixels) // pixels.shape[1])
    enlarged = pixels.repeat(TALL, axis=0).repeat(wide, axis=1)
    return TablePixels(enlarged, picture.parts.tolist(), states_page(picture))


def states_page(picture: TablePicture) -> str:
    """Return a page about the picture of the tables, in Markdown: which state each row is."""
    n_tables = picture.action.shape[1]
    heads = " | ".join(f"brigade {k}" for k in range(n_tables))
    lines = [
        "# The tables over the training",
        "",
        TABLES_HELP.format(n=len(picture.states)) + " The white line moves with the time that is looked at.",
        "",
        f"| state | sees | learned | {heads} |",
        "|---|---|---|" + "---|" * n_tables,
    ]
    for row, (state, words, visits) in enumerate(zip(picture.states, picture.words, picture.visits, strict=True)):
        last = [ACTIONS[k] if k >= 0 else "-" for k in picture.action[row, :, -1]]
        lines.append(f"| {state} | {words} | {visits:,} | {' | '.join(last)} |")
    return "\n".join(lines) + "\n"
