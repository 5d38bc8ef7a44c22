"""Trainings in Rerun: curves over the episodes, the tables as a picture; from logs, or while a team learns."""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from fireworld_viewer.rerun_view import app
from fireworld_viewer.rerun_view.training_curves import CurveWriter, LayoutTab, TrainingLayout, TrainingPoint
from fireworld_viewer.table_pixels import table_pixels

from fireworld.errors import LogError, expected
from fireworld.records import ACTIONS
from fireworld.training.log.course import TablePicture, mark_of, table_picture
from fireworld.training.log.difference import AnyTraining
from fireworld.training.log.reader import TrainingLog, open_training
from fireworld.training.log.records import Episode
from fireworld.training.method import Report, Trainer

TALL: Final = 3
"""Pixels of a table's row in the picture; a moment is so wide that the picture is twice as wide as high at most."""
TABLES_HELP: Final = (
    "A row for each of the {n} states that were learned in most, and in it one for each brigade; a column for each"
    " moment at which the tables are recorded whole. The color is the greedy action: "
    "easiest blue, nearest-to-civilian vermilion, nearest-to-center yellow, nearest-to-me green."
    " The darker it is, the more the state costs; grey: never visited."
)
MARKED: Final = "return"
"""The plot that has the marks of where scenarios end."""


def layout_of(trainers: Sequence[Trainer[Any, Any]]) -> TrainingLayout:
    """Return what is drawn: plots of all teams, and a tab for each that has plots of its own."""
    first = trainers[0]
    return TrainingLayout(
        title=f"training-{first.method.name}",
        timeline=first.unit,
        plots=first.plots,
        tabs={f"Seed {one.seed}": LayoutTab(one.own_plots(), page_of(one)) for one in trainers if one.own_plots()},
        log="Milestones",
    )


def point_of(trainer: Trainer[Any, Any], report: Report, *, number: int, team: str) -> TrainingPoint:
    """Return a report as it is drawn: the number-th of a team, which curves are named after."""
    values = {
        plot: {", ".join(filter(None, (team, name))): value for name, value in curves.items()}
        if plot in trainer.plots
        else curves
        for plot, curves in trainer.points(report).items()
    }
    page = trainer.page()
    return TrainingPoint(
        number=number,
        values=values,
        note=f"{team}: {report.text}" if report.milestone else "",
        pages={page_of(trainer): page} if page else {},
    )


def page_of(trainer: Trainer[Any, Any]) -> str:
    """Return the name of the page about a team."""
    return f"page/{trainer.seed}"


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
    identity = hashlib.sha256("".join(f"{one.path.name} {one.digest}" for one in opened).encode()).hexdigest()
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
    opened = [one if isinstance(one, TrainingLog) else open_training(one, partial=True) for one in given]
    for one in opened:
        if not len(one):
            raise LogError(f"{one.path}: it holds no {one.header.unit}s; there is nothing to show")
        if one.method.name != opened[0].method.name:
            wanted = f"{opened[0].method.name}, as in {opened[0].path}"
            raise LogError(expected(str(one.path), "method", wanted, one.method.name))
    return opened


def names_of(logs: Sequence[TrainingLog]) -> list[str]:
    """Return what to call trainings: the names of their files, and their paths where these are the same."""
    names = [one.path.name for one in logs]
    if len(set(names)) == len(names):
        return names
    return [f"{letter}: {one.path}" for letter, one in zip("AB", logs, strict=True)]


def _write(logs: Sequence[TrainingLog], stream: Any) -> None:
    """Write all that is to be seen of trainings."""
    names = names_of(logs)
    pictures = [table_picture(log) for log in logs]
    layout = layout_of([log.trainer() for log in logs])
    tabs = dict(layout.tabs) if len(logs) == 1 else {}
    for k, (name, picture) in enumerate(zip(names, pictures, strict=True)):
        if picture is not None:
            tabs[f"Tables of {name}"] = LayoutTab({}, f"states/{k}", f"tables/{k}")
    writer = CurveWriter(stream, replace(layout, tabs=tabs, n_parts=max(map(len, logs))))
    for log, name in zip(logs, names, strict=True):
        writer.write(list(_points(log, name if len(logs) > 1 else "")))
    for k, picture in enumerate(pictures):
        if picture is not None:
            pixels = table_pixels(picture.action, picture.value)
            wide = max(1, 2 * TALL * len(pixels) // pixels.shape[1])
            enlarged = pixels.repeat(TALL, axis=0).repeat(wide, axis=1)
            writer.write_picture(f"tables/{k}", enlarged, f"states/{k}", states_page(picture))


def _points(log: TrainingLog, team: str) -> Iterator[TrainingPoint]:
    """Yield what is drawn of each part of a log, with a mark at the end of every scenario."""
    names = [one.name for one in log.scenarios]
    trainer = log.trainer()
    for number, part in enumerate(log.parts()):
        report = log.follow(trainer, part, number)
        point = point_of(trainer, report, number=number, team=team)
        if report.milestone and Episode in part:
            mark = mark_of(log, number, part[Episode], report, names)
            kind = ", ".join(filter(None, (team, "settled" if mark.settled else "not settled")))
            value = trainer.points(report).get(MARKED, {}).get("")
            marks = {MARKED: {kind: value}} if value is not None else {}
            note = ": ".join(filter(None, (team, f"{mark.text}; {mark.command}")))
            point = replace(point, marks=marks, note=note)
        yield point


def states_page(picture: TablePicture) -> str:
    """Return a page about the picture of the tables, in Markdown: which state each row is."""
    n_tables = picture.action.shape[1]
    heads = " | ".join(f"brigade {k}" for k in range(n_tables))
    lines = [
        "# The tables over the training",
        "",
        TABLES_HELP.format(n=len(picture.states)),
        "",
        f"| state | sees | learned | {heads} |",
        "|---|---|---|" + "---|" * n_tables,
    ]
    for row, (state, words, visits) in enumerate(zip(picture.states, picture.words, picture.visits, strict=True)):
        last = [ACTIONS[k] if k >= 0 else "-" for k in picture.action[row, :, -1]]
        lines.append(f"| {state} | {words} | {visits:,} | {' | '.join(last)} |")
    return "\n".join(lines) + "\n"
