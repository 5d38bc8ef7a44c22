"""`fireworld train`: train teams through a curriculum."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING

import click

from fireworld.cli import INTERRUPTED
from fireworld.cli.compiling import announce_compilation
from fireworld.cli.live import find_screen, view_options, watched_trainings
from fireworld.cli.options import executor_of, on_option, seed_option
from fireworld.cli.progress import BAR, DESCRIPTION, ELAPSED, bars, is_watched
from fireworld.training.methods import method_names

if TYPE_CHECKING:
    from fireworld.training.hooks import Hook
    from fireworld.training.method import Report
    from fireworld.training.training import Callback, Training


@click.command()
@click.argument("curriculum", required=False)
@click.option(
    "-o", "--output", required=True, metavar="TEAM.npz", type=click.Path(path_type=Path), help="Team file to write."
)
@click.option(
    "--method", default="paper", show_default=True, metavar="NAME", help=f"How to learn: {', '.join(method_names())}."
)
@click.option(
    "--set", "settings", metavar="KEY=VALUE", multiple=True, help="Override a hyperparameter of the method; repeatable."
)
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
@on_option
@click.option(
    "--log",
    metavar="F.csv",
    type=click.Path(path_type=Path),
    help="Write a line for every episode, or whatever the method reports.",
)
@click.option(
    "--record",
    metavar="F.mcap",
    type=click.Path(path_type=Path),
    help="Record every step that is learned from in a training log, which is the checkpoint too.",
)
@click.option(
    "--full-every",
    metavar="N",
    type=click.IntRange(min=1),
    help="Record every N-th episode as a whole run too; --record then names an existing folder.",
)
@click.option(
    "--jsonl",
    metavar="F.jsonl",
    type=click.Path(path_type=Path),
    help="Write a line of JSON for every report while it learns.",
)
@click.option(
    "--tensorboard",
    metavar="DIR",
    type=click.Path(path_type=Path),
    help="Keep curves for TensorBoard in this folder; of several teams in DIR/seed-1 and so on.",
)
@click.option(
    "--mlflow", metavar="DIR|URI", help="Keep curves and the team in MLflow, in a folder or at the address of a server."
)
@click.option("--strict", is_flag=True, help="Exit code 1 if any of these could not be kept to the end.")
@click.option("--resume", is_flag=True, help="Continue from the checkpoint of an interrupted training.")
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
    on: str | None,
    log: Path | None,
    record: Path | None,
    full_every: int | None,
    jsonl: Path | None,
    tensorboard: Path | None,
    mlflow: str | None,
    strict: bool,
    resume: bool,
    force: bool,
    view: bool,
    view_url: str | None,
) -> None:
    """Train a team in CURRICULUM and write its team file.

    CURRICULUM is the name of a curriculum or of a scenario, or a YAML file of either. If none is named, the method
    `paper` (SARSA in tables) trains in `paper`; `search` and `assignment` (weights of a ranking) and
    `targets` (SARSA over the features of targets: a network) train in `contested`, `evolution` (a network, by an
    evolution strategy), `gates` (rankings and what chooses among them, by the same), `rollouts` (a network, by
    what rollouts of its own decisions come to) and `imitation` (a network, by what the planner would do) in
    `conditions`.

    \b
    fireworld train -o team.npz                          the paper's method, both stages
    fireworld train -o alone.npz --stages alone          without cooperation: 270 states
    fireworld train -o team.npz --set alpha=0.1 --seed 7
    fireworld train test-1 -o team.npz                   in a single scenario
    fireworld train -o best.npz --method search          a ranking of targets
    fireworld train -o team.npz --record training.mcap   every step on record
    fireworld train -o team.npz --tensorboard runs/a     curves in TensorBoard; or --mlflow, --jsonl
    fireworld train -o team.npz --view                   curves while it learns, a fire after every stage
    fireworld run test-2 --policy team.npz               let it fight a fire

    The same seed gives the same team. Ctrl-C leaves a checkpoint, TEAM.npz.checkpoint, from which --resume continues
    bit for bit. With --record the log under way is the checkpoint, after a kill too; `info`, `verify`, `diff`, `view`,
    `report` and `export` read it, and `replay` writes any of its episodes as the log of a run.

    Curves of --jsonl, --tensorboard and --mlflow never cost a training: if a disk is full or a server gone, a line says
    so once, and the training continues without them.

    Exit code: 0 trained, 1 trained, but with --strict some curves are not complete, 2 could not train, 130 interrupted.
    """
    screen = find_screen(view=view, url=view_url)
    announce_compilation()
    from fireworld.scenario import split_settings
    from fireworld.training.train import prepare_trainings
    from fireworld.training.training import train_all

    trainings = prepare_trainings(
        curriculum,
        repetitions=repetitions,
        method=method,
        seed=seed,
        set=split_settings(settings, example="alpha=0.1"),
        stages=stages,
        output=output,
        log=log,
        record=record,
        full_every=full_every,
        resume=resume,
        force=force,
    )
    for number, training in enumerate(trainings, 1):
        training.attach(_hooks(training, number, len(trainings), jsonl, tensorboard, mlflow))
    with _progress(trainings) as progress, watched_trainings(screen, trainings) as watched:
        train_all(trainings, jobs=jobs, executor=executor_of(on, jobs), callbacks=(progress, watched))
    for training in trainings:
        _print_result(training)
    if any(training.team is None for training in trainings):
        context.exit(INTERRUPTED)
    context.exit(1 if strict and any(hook.failure for training in trainings for hook in training.hooks) else 0)


def _hooks(
    training: Training, number: int, n: int, jsonl: Path | None, tensorboard: Path | None, mlflow: str | None
) -> list[Hook]:
    """Return what keeps the curves of the number-th of n trainings."""
    from fireworld.training.hooks import JsonlCallback, MLflowCallback, TensorBoardCallback
    from fireworld.training.train import numbered

    hooks: list[Hook] = []
    if (path := numbered("jsonl", jsonl, number, n)) is not None:
        hooks.append(JsonlCallback(path))
    if tensorboard is not None:
        hooks.append(TensorBoardCallback(tensorboard if n == 1 else tensorboard / f"seed-{training.seed}"))
    if mlflow is not None:
        hooks.append(MLflowCallback(mlflow))
    for hook in hooks:
        hook.warn = partial(click.echo, err=True)
    return hooks


def _print_result(training: Training) -> None:
    """Print what came of a training."""
    team = training.team
    if team is not None:
        click.echo(f"{training.path}: seed {training.seed}, {team.summary}, digest {team.digest}")
    elif training.has_checkpoint:
        click.echo(training.interruption, err=True)


@contextmanager
def _progress(trainings: Sequence[Training]) -> Iterator[Callback]:
    """Show progress: a bar for every team where people watch, else a line for every milestone."""
    lock = Lock()
    if not is_watched():

        def line(training: Training, report: Report) -> None:
            if report.milestone:
                with lock:
                    click.echo(f"seed {training.seed}: {report.text}", err=True)

        yield line
        return
    with bars(DESCRIPTION, BAR, "{task.fields[state]}", ELAPSED) as progress:
        tasks = {
            training.seed: progress.add_task(f"seed {training.seed}", total=1.0, state="", start=False)
            for training in trainings
        }

        def advance(training: Training, report: Report) -> None:
            task = tasks[training.seed]
            progress.start_task(task)
            progress.update(task, completed=training.trainer.share_done, state=report.text)

        yield advance
