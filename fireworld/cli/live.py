"""`--view`: what `fireworld run` and `fireworld train` show while they are under way."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import replace
from functools import partial
from threading import Lock
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from fireworld_viewer.rerun_view.live import PlayRun, Screen

    from fireworld.records import CityRecord, RunHeader, StepRecord
    from fireworld.training.method import Play, Report
    from fireworld.training.training import Callback, Training

Command = TypeVar("Command", bound=Callable[..., Any])


def view_options(command: Command) -> Command:
    """Add --view and --view-url to a command."""
    url = click.option(
        "--view-url", metavar="URL", help="Show it live in a viewer that runs: rerun+http://127.0.0.1:9876/proxy."
    )
    return click.option("--view", is_flag=True, help="Show it live in a window of Rerun.")(url(command))


def find_screen(*, view: bool, url: str | None) -> Screen | None:
    """Return where a live view goes, None for nowhere; before anything is run.

    Raises:
        ViewError: there is no viewer, no display, or nothing at the address.
    """
    if view and url is not None:
        raise click.UsageError("--view and --view-url exclude each other.")
    if not view and url is None:
        return None
    from fireworld_viewer.rerun_view.live import own_window, running_viewer

    return own_window() if url is None else running_viewer(url)


@contextmanager
def watched_run(screen: Screen | None, header: RunHeader, city: CityRecord) -> Iterator[Callable[[StepRecord], None]]:
    """Yield a function that shows the next record; at the end the rest is shown. Without a screen it does nothing."""
    if screen is None:
        yield lambda _: None
        return
    from fireworld_viewer.rerun_view.live import RunView

    with closing(RunView(screen, header, city, warn=partial(click.echo, err=True))) as watched:
        yield watched.add


@contextmanager
def watched_trainings(screen: Screen | None, trainings: Sequence[Training]) -> Iterator[Callback]:
    """Yield a callback that shows a report, as `watched_run` does for a run.

    What is drawn is up to the method. Runs that it has to show are those of the first team, in the thread of the view:
    neither the training nor its random draws depend on them. The viewer turns to each, so there are few.
    """
    if screen is None:
        yield lambda _, __: None
        return
    from fireworld_viewer.rerun_view.live import TrainingView

    from fireworld.training.log.pages.view import layout_of, point_of

    for training in trainings:
        training.trainer.watched = True
    lock, trainers = Lock(), [one.trainer for one in trainings]
    layout = layout_of(trainers, [f"seed {one.seed}" for one in trainers])
    with closing(TrainingView(screen, layout, warn=partial(click.echo, err=True))) as watched:

        def show(training: Training, report: Report) -> None:
            with lock:
                team = trainers.index(training.trainer)
                point = point_of(training.trainer, report, number=training.n_reports - 1, team=team)
                play = training.trainer.play(report) if training is trainings[0] else None
                watched.add(point, play=play and _play_run(play))

        yield show


def _play_run(play: Play) -> PlayRun:
    def run() -> tuple[str, RunHeader, CityRecord, list[StepRecord]]:
        from fireworld.policy.names import NamedPolicy
        from fireworld.simulation.built import build_scenario
        from fireworld.simulation.prepared_run import prepare_run

        policy = play.team.policy()
        named = NamedPolicy("team in training", policy.digest, policy)
        run = prepare_run(build_scenario(play.scenario), named, seed=1)
        return play.title, run.header, run.city, [replace(record, snapshot=None) for record in run]

    return run
