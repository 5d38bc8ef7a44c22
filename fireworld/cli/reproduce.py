"""`fireworld reproduce`: train, test and judge the paper's method, and write its tables beside ours."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from fireworld.cli.compiling import announce_compilation
from fireworld.cli.options import executor_of, on_option
from fireworld.cli.progress import BAR, COUNT, DESCRIPTION, ELAPSED, bars

if TYPE_CHECKING:
    from fireworld.executors import AnyExecutor


@click.command()
@click.option("--repetitions", metavar="N", type=click.IntRange(1, 1000), help="Trainings.  [default: 20; quick: 2]")
@click.option("--seeds", metavar="N", type=click.IntRange(1, 1000), help="Runs a test.  [default: 20; quick: 5]")
@click.option("--jobs", metavar="N", type=click.IntRange(1, 1000), help="Trainings at a time.  [default: cores]")
@on_option
@click.option(
    "--out",
    metavar="DIR",
    default="report",
    show_default=True,
    type=click.Path(path_type=Path),
    help="Folder to make.",
)
@click.option("--quick", is_flag=True, help="Few repetitions and seeds: to see how it looks, not to claim anything.")
@click.option(
    "--world",
    type=click.Choice(["paper", "tests"]),
    help="A world like the paper's, or the denser city of `test-1` to `test-3`.  [default: paper; --resume: as begun]",
)
@click.option("--record-trainings", is_flag=True, help="Keep a training log of every training in DIR/trainings.")
@click.option("--resume", is_flag=True, help="Continue what an interrupted call left in DIR.")
@click.option("--force", is_flag=True, help="Replace an earlier reproduction in DIR.")
@click.option(
    "--readings",
    metavar="[FILE]",
    is_flag=False,
    flag_value="",
    default=None,
    help="Try the paper's open choices instead, those of fireworld's readings.yaml or of FILE.",
)
@click.option(
    "--design",
    type=click.Choice(["screen", "full"]),
    default="screen",
    show_default=True,
    help="64 readings, or 128, and one for each further level.",
)
def command(
    *,
    repetitions: int | None,
    seeds: int | None,
    jobs: int | None,
    on: str | None,
    out: Path,
    quick: bool,
    world: str | None,
    record_trainings: bool,
    resume: bool,
    force: bool,
    readings: str | None,
    design: str,
) -> None:
    """Train the paper's teams, test them beside controls, and write its Tables 1 to 3 beside ours.

    \b
    fireworld reproduce                        20 trainings, 20 seeds: minutes
    fireworld reproduce --quick --out quick    2 trainings, 5 seeds: a minute

    DIR gets report.html (open it in a browser), the tables and every run as CSV, the trained teams, a recording of
    one run of each row, and the figures. The same options give the same CSV, byte for byte. After Ctrl-C, or a kill,
    the same options with --resume continue: what was trained and tested by then is kept in DIR. With --record-trainings
    every episode is on record, too: 13 MB a repetition.

    With --readings, what is asked is whether the claim, that cooperation helps, holds in other readings of the paper:
    a designed sample of them is tried, and DIR gets readings.html and CSV files. It takes hours; with
    --quick a minute.

    Exit code: 0 done, whatever was found; 2 could not be done; 130 interrupted.
    """
    if force and resume:
        raise click.UsageError("--force and --resume exclude each other.")
    if readings is not None and world is not None:
        raise click.UsageError("--readings begins with the world tests; its file says what else is tried, not --world.")
    announce_compilation()
    if readings is not None:
        executor = executor_of(on, jobs)
        _try_readings(readings, out, design, repetitions, seeds, executor, quick=quick, resume=resume, force=force)
        return
    from fireworld.reproduction.reproduce import reproduce

    with bars(DESCRIPTION, BAR, COUNT, ELAPSED) as progress:
        tasks = {what: progress.add_task(what, total=None) for what in ("training", "testing", "recording", "drawing")}
        reproduction = reproduce(
            out,
            repetitions=repetitions,
            seeds=seeds,
            quick=quick,
            world=world,
            record_trainings=record_trainings,
            resume=resume,
            force=force,
            executor=executor_of(on, jobs),
            on_progress=lambda what, n_done, n_all: progress.update(tasks[what], completed=n_done, total=n_all),
        )
    click.echo(reproduction)
    click.echo(f"open {reproduction.report}")


def _try_readings(
    file: str,
    out: Path,
    design: str,
    repetitions: int | None,
    seeds: int | None,
    executor: AnyExecutor,
    *,
    quick: bool,
    resume: bool,
    force: bool,
) -> None:
    """Try the readings of a file, "" for fireworld's own."""
    from fireworld.reproduction.readings.try_readings import try_readings

    with bars(DESCRIPTION, BAR, COUNT, ELAPSED) as progress:
        tasks = {what: progress.add_task(what, total=None) for what in ("trying", "confirming")}
        found = try_readings(
            out,
            file=file or None,
            design="full" if design == "full" else "screen",
            repetitions=repetitions,
            seeds=seeds,
            quick=quick,
            resume=resume,
            force=force,
            executor=executor,
            on_progress=lambda what, n_done, n_all: progress.update(tasks[what], completed=n_done, total=n_all),
        )
    click.echo(found)
    click.echo(found.study.timing.text, err=True)
    click.echo(f"open {found.report}")
