"""`fireworld train`: train teams through a curriculum."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Protocol

import click

from fireworld.cli import INTERRUPTED
from fireworld.cli.compiling import announce_compilation
from fireworld.cli.live import find_screen, view_options, watched_training
from fireworld.cli.options import SEED_MAX, seed_option
from fireworld.cli.progress import BAR, DESCRIPTION, ELAPSED, bars, is_watched
from fireworld.interrupt import gentle_interrupt

if TYPE_CHECKING:
    from fireworld.training.teams import Training
    from fireworld.training.trainer import EpisodeReport


class Report(Protocol):
    """What is called after every episode, by any thread."""

    def __call__(self, training: Training, episode: EpisodeReport, /) -> None:
        """Show an episode."""
        ...


@click.command()
@click.argument("curriculum", required=False)
@click.option(
    "-o", "--output", required=True, metavar="TEAM.npz", type=click.Path(path_type=Path), help="Team file to write."
)
@click.option(
    "--method",
    default="paper",
    show_default=True,
    metavar="NAME",
    help="How to learn: paper (SARSA in tables), or search (weights of a ranking, by the cross-entropy method).",
)
@click.option("--set", "settings", metavar="KEY=VALUE", multiple=True, help="Set a figure of the method; repeatable.")
@click.option("--stages", metavar="NAME,...", help="Train in these stages of the curriculum only.")
@seed_option
@click.option(
    "--repetitions",
    default=1,
    show_default=True,
    type=click.IntRange(1, 10_000),
    metavar="N",
    help="Train N teams, TEAM-1.npz and so on, with the seeds that follow --seed.",
)
@click.option(
    "--jobs",
    type=click.IntRange(1, 1000),
    metavar="N",
    help="Teams to train, or fights to search with, at a time.  [default: cores]",
)
@click.option("--log", metavar="F.csv", type=click.Path(path_type=Path), help="Write a line for every episode.")
@click.option("--resume", is_flag=True, help="Go on from the checkpoint of an interrupted training.")
@click.option("--force", is_flag=True, help="Replace existing files, checkpoints too.")
@view_options
@click.pass_context
def command(
    context: click.Context,
    *,
    curriculum: str | None,
    output: Path,
    method: str,
    settings: tuple[str, ...],
    stages: str | None,
    seed: int,
    repetitions: int,
    jobs: int | None,
    log: Path | None,
    resume: bool,
    force: bool,
    view: bool,
    view_url: str | None,
) -> None:
    """Train a team in CURRICULUM (a shipped name or a YAML file) and write its team file.

    The method `paper` trains in the curriculum `paper` if none is named, the method `search` in `contested`.

    \b
    fireworld train -o team.npz                          the paper's method, both stages
    fireworld train -o alone.npz --stages alone          without cooperation: 270 states
    fireworld train -o team.npz --set alpha=0.1 --seed 7
    fireworld train -o best.npz --method search          a ranking of targets
    fireworld train -o team.npz --view                   curves while it learns, a fire after every stage
    fireworld train -o best.npz --method search --view   scores and weights, generation by generation
    fireworld run test-2 --policy team.npz               let it fight a fire

    The same seed gives the same team. Ctrl-C keeps a checkpoint, TEAM.npz.checkpoint, from which --resume goes on bit
    for bit.

    Exit code: 0 trained, 2 could not train, 130 interrupted.
    """
    if force and resume:
        raise click.UsageError("--force and --resume exclude each other.")
    if output.suffix != ".npz":
        raise click.UsageError(f"-o: expected a name that ends in .npz, got {str(output)!r}.")
    if log == output:
        raise click.UsageError("-o and --log name the same file.")
    if seed + repetitions - 1 > SEED_MAX:
        raise click.UsageError(f"--repetitions: expected seeds up to {SEED_MAX}, got up to {seed + repetitions - 1}.")
    screen = find_screen(view=view, url=view_url)
    announce_compilation()
    from fireworld.scenario import split_settings
    from fireworld.simulation.built import CityCache
    from fireworld.training.checkpoint import begin_all
    from fireworld.training.curriculum import load_curriculum
    from fireworld.training.method import SEARCH, find_method
    from fireworld.training.teams import Training, numbered, train_all
    from fireworld.training.trainer import Trainer

    figures = split_settings(settings, example="n_fires=20" if method == SEARCH else "alpha=0.1")
    chosen = load_curriculum(curriculum or ("contested" if method == SEARCH else "paper"))
    chosen = chosen if stages is None else chosen.only([name.strip() for name in stages.split(",")])
    if method == SEARCH:
        from fireworld.cli.searching import train_by_search

        if log is not None:
            raise click.UsageError("--log: a search has no episodes to write; its generations are shown.")
        done = train_by_search(
            chosen,
            figures,
            output=output,
            seed=seed,
            repetitions=repetitions,
            jobs=jobs,
            resume=resume,
            force=force,
            screen=screen,
        )
        context.exit(0 if done else INTERRUPTED)
    learned = find_method(method).with_settings(figures)
    cities = CityCache()
    trainings = [
        Training(
            trainer=Trainer(chosen, learned, seed=seed + number - 1, cities=cities),
            path=numbered(output, number, n_all=repetitions),
            log_path=numbered(log, number, n_all=repetitions) if log is not None else None,
            force=force,
        )
        for number in range(1, repetitions + 1)
    ]
    begin_all(trainings, resume=resume)
    n_jobs = min(jobs or os.cpu_count() or 1, repetitions)
    with gentle_interrupt() as interrupted, _progress(trainings) as report, watched_training(screen) as show:

        def report_and_show(training: Training, episode: EpisodeReport, /) -> None:
            report(training, episode)
            show(training, episode)

        train_all(trainings, n_jobs=n_jobs, stop=interrupted, report=report_and_show)
    for training in trainings:
        _show(training)
    context.exit(0 if all(training.team is not None for training in trainings) else INTERRUPTED)


def _show(training: Training) -> None:
    """Say what came of a training."""
    progress, team = training.trainer.progress, training.team
    if team is not None:
        n, states, _ = team.tables.shape
        what = f"{n} table{'s' if n > 1 else ''} of {states} states"
        click.echo(f"{training.path}: seed {training.trainer.seed}, {what}, digest {team.digest}")
    elif training.checkpoint.exists():
        where = f"scenario {progress.scenario_number + 1}, after {progress.episode} episodes"
        click.echo(f"interrupted in {where}; {training.checkpoint} is kept: go on with --resume", err=True)


@contextmanager
def _progress(trainings: list[Training]) -> Iterator[Report]:
    """Show progress: bars where people watch, else a line for every scenario that is done."""
    if not is_watched():
        yield _lines()
        return
    with _bars(trainings) as report:
        yield report


def _lines() -> Report:
    lock = Lock()

    def report(training: Training, episode: EpisodeReport, /) -> None:
        if training.trainer.progress.episode:  # it starts at 0 again with every scenario
            return
        ended = "settled" if episode.converged else "not settled"
        with lock:
            click.echo(
                f"seed {training.trainer.seed}: {episode.scenario}: {episode.episode + 1} episodes, {ended}, "
                f"score {episode.score:.2f} of {episode.score_max:.0f}, return {episode.total_reward:,.0f}",
                err=True,
            )

    return report


@contextmanager
def _bars(trainings: list[Training]) -> Iterator[Report]:
    with bars(DESCRIPTION, BAR, "{task.fields[state]}", ELAPSED) as progress:
        tasks = {
            training.trainer.seed: progress.add_task(
                f"seed {training.trainer.seed}", total=training.trainer.curriculum.n_scenarios, state="", start=False
            )
            for training in trainings
        }

        def report(training: Training, episode: EpisodeReport, /) -> None:
            trainer = training.trainer
            task = tasks[trainer.seed]
            progress.start_task(task)
            done = trainer.progress.scenario_number
            part = trainer.progress.episode / trainer.method.n_episodes_max
            state = (
                f"{episode.scenario}, episode {episode.episode + 1}, epsilon {episode.epsilon:.3f}, "
                f"return {episode.total_reward:,.0f}, {episode.n_changed} changes"
            )
            progress.update(task, completed=done + part, state=state)

        yield report
