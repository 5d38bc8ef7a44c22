"""`--view`: what `fireworld run` and `fireworld train` show while they are under way."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import replace
from threading import Lock
from typing import TYPE_CHECKING, Any, Final, TypeVar

import click

if TYPE_CHECKING:
    from fireworld_viewer.rerun_view.live import PlayRun, Screen
    from fireworld_viewer.rerun_view.training_curves import TrainingLayout, TrainingPoint

    from fireworld.records import CityRecord, RunHeader, StepRecord
    from fireworld.training.teams import Training
    from fireworld.training.trainer import EpisodeReport

Command = TypeVar("Command", bound=Callable[..., Any])

CURVES: Final = {
    "return": "Return",
    "score": "Score, as a share of the best",
    "epsilon": "Epsilon",
    "n_changed": "States in which the greedy action changed",
    "n_burnt_out": "Burnt out",
    "n_steps": "Steps",
}
"""What is drawn of each episode, and the titles."""


def view_options(command: Command) -> Command:
    """Add --view and --view-url to a command."""
    url = click.option(
        "--view-url", metavar="URL", help="Show it live in a viewer that runs: rerun+http://127.0.0.1:9876/proxy."
    )
    return click.option("--view", is_flag=True, help="Show it live in a window of Rerun.")(url(command))


def find_screen(*, view: bool, url: str | None) -> Screen | None:
    """Find out where a live view is to go, None for nowhere, before anything is run.

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
    """Give a function that shows the next record, and bring the rest at the end; without a screen it does nothing."""
    if screen is None:
        yield lambda _: None
        return
    from fireworld_viewer.rerun_view.live import RunView

    with closing(RunView(screen, header, city, warn=warn)) as watched:
        yield watched.add


@contextmanager
def watched_training(screen: Screen | None) -> Iterator[Callable[[Training, EpisodeReport], None]]:
    """Give a function that shows an episode, as `watched_run` does for a run.

    At the end of every stage the first team plays the last scenario once, greedily and with luck of its own, in the
    thread of the view: neither the training nor its luck knows of it. The viewer turns to each, so there are few.
    """
    if screen is None:
        yield lambda _, __: None
        return
    from fireworld_viewer.rerun_view.live import TrainingView

    episodes, lock = Episodes(), Lock()
    with closing(TrainingView(screen, _layout(), warn=warn)) as watched:

        def show(training: Training, episode: EpisodeReport) -> None:
            with lock:
                point, play = episodes.point(training, episode)
                watched.add(point, play=play)

        yield show


def _layout() -> TrainingLayout:
    from fireworld_viewer.rerun_view.training_curves import TrainingLayout

    return TrainingLayout(title="training", timeline="episode", plots=CURVES, log="Scenarios")


class Episodes:
    """Makes of the reports of all trainings what is shown of them."""

    def __init__(self) -> None:
        self._n_episodes: dict[int, int] = {}
        self._first: int | None = None

    def point(self, training: Training, episode: EpisodeReport) -> tuple[TrainingPoint, PlayRun | None]:
        """Return an episode as it is drawn, and what is to be played after it."""
        from fireworld_viewer.rerun_view.training_curves import TrainingPoint

        seed = training.trainer.seed
        number = self._n_episodes.get(seed, 0)
        self._n_episodes[seed] = number + 1
        self._first = seed if self._first is None else self._first
        ended = training.trainer.progress.episode == 0  # it starts at 0 again with every scenario
        settled = "settled" if episode.converged else "not settled"
        values = {
            "return": episode.total_reward,
            "score": episode.score / episode.score_max,
            "epsilon": episode.epsilon,
            "n_changed": episode.n_changed,
            "n_burnt_out": episode.n_burnt_out,
            "n_steps": episode.n_steps,
        }
        team = f"seed {seed}"
        point = TrainingPoint(
            number=number,
            values={name: {team: value} for name, value in values.items()},
            note=f"{team}: {episode.scenario}: {settled} after {episode.episode + 1} episodes" if ended else "",
        )
        return point, _play(training, episode) if ended and seed == self._first and _ends_stage(training) else None


def _ends_stage(training: Training) -> bool:
    """Whether the scenario that has just ended was the last of its stage."""
    stages = training.trainer.curriculum.stages
    lasts = itertools.accumulate(len(stage.scenarios) for stage in stages)
    return training.trainer.progress.scenario_number in lasts


def _play(training: Training, episode: EpisodeReport) -> PlayRun:
    """Prepare the play of a scenario by the team that has just finished it; the tables are copied now."""
    trainer = training.trainer
    team = trainer.graduate if trainer.graduate is not None else trainer.team()
    scenario = [one for stage in trainer.curriculum.stages for one in stage.scenarios][episode.scenario_number]
    title = f"after stage {episode.stage}: {scenario.name}, seed {trainer.seed}"

    def play() -> tuple[str, RunHeader, CityRecord, list[StepRecord]]:
        import msgspec

        from fireworld.policy.names import NamedPolicy
        from fireworld.simulation.built import build_scenario
        from fireworld.simulation.run import prepare_run

        policy = team.policy()
        as_trained = msgspec.structs.replace(scenario, choices=trainer.method.choices)
        run = prepare_run(build_scenario(as_trained), NamedPolicy("team in training", policy.digest, policy), seed=1)
        return title, run.header, run.city, [replace(record, snapshot=None) for record in run]

    return play


def warn(line: str) -> None:
    """Say why a view has ended before what it shows."""
    click.echo(line, err=True)
