"""`fireworld reproduce`: train, test and judge the paper's method, and write its tables beside ours."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from fireworld.cli import INTERRUPTED
from fireworld.cli.compiling import announce_compilation
from fireworld.cli.installed import check_matplotlib
from fireworld.cli.progress import BAR, COUNT, DESCRIPTION, ELAPSED, bars
from fireworld.files import write_file
from fireworld.interrupt import gentle_interrupt
from fireworld.reproduction.folder import find_folder, make_folder

if TYPE_CHECKING:
    from rich.progress import Progress
    from rich.table import Table

    from fireworld.executors import Workers
    from fireworld.reproduction.paper_tables import Tables
    from fireworld.reproduction.pieces import Workshop
    from fireworld.reproduction.repetitions import Repetition
    from fireworld.reproduction.study import Study
    from fireworld.simulation.built import CityCache

CURRICULUM: Final = "paper"
FIRST_SEED: Final = 1000
REPETITIONS: Final = 20
SEEDS: Final = 20
QUICK_REPETITIONS: Final = 2
QUICK_SEEDS: Final = 5


@dataclass(frozen=True, kw_only=True)
class Order:
    """What was asked for."""

    n_repetitions: int
    n_seeds: int
    folder: Path
    resume: bool

    @property
    def seeds(self) -> range:
        """Seeds of the test runs."""
        return range(FIRST_SEED, FIRST_SEED + self.n_seeds)


@click.command()
@click.option(
    "--repetitions", metavar="N", type=click.IntRange(1, 1000), help=f"Trainings.  [default: {REPETITIONS}; quick: 2]"
)
@click.option("--seeds", metavar="N", type=click.IntRange(1, 1000), help=f"Runs a test.  [default: {SEEDS}; quick: 5]")
@click.option("--jobs", metavar="N", type=click.IntRange(1, 1000), help="Trainings at a time.  [default: cores]")
@click.option(
    "--out",
    metavar="DIR",
    default="report",
    show_default=True,
    type=click.Path(path_type=Path),
    help="Folder to make.",
)
@click.option("--quick", is_flag=True, help="Few repetitions and seeds: to see how it looks, not to claim anything.")
@click.option("--resume", is_flag=True, help="Go on with what an interrupted call has kept in DIR.")
@click.option("--force", is_flag=True, help="Replace an earlier reproduction in DIR.")
@click.pass_context
def command(
    context: click.Context,
    *,
    repetitions: int | None,
    seeds: int | None,
    jobs: int | None,
    out: Path,
    quick: bool,
    resume: bool,
    force: bool,
) -> None:
    """Train the paper's teams, test them beside controls, and write its Tables 1 to 3 with our figures beside.

    \b
    fireworld reproduce                        20 trainings, 20 seeds: minutes
    fireworld reproduce --quick --out quick    2 trainings, 5 seeds: a minute

    DIR gets report.html (open it in a browser), the tables and every run as CSV, the trained teams, a recording of
    one run of each row, and the figures. The same options give the same CSV, byte for byte. After Ctrl-C, or a kill,
    the same options with --resume go on: what was trained and tested by then is kept in DIR.

    Exit code: 0 done, whatever was found; 2 could not be done; 130 interrupted.
    """
    if force and resume:
        raise click.UsageError("--force and --resume exclude each other.")
    order = Order(
        n_repetitions=repetitions or (QUICK_REPETITIONS if quick else REPETITIONS),
        n_seeds=seeds or (QUICK_SEEDS if quick else SEEDS),
        folder=out,
        resume=resume,
    )
    check_matplotlib("reproduce")
    if resume:
        find_folder(out)
    else:
        make_folder(out, force=force)
    announce_compilation()
    from fireworld.executors import Workers

    with gentle_interrupt() as interrupted, bars(DESCRIPTION, BAR, COUNT, ELAPSED) as progress:
        found = _reproduce(order, Workers(jobs or os.cpu_count() or 1, interrupted), progress)
    if found is None:
        from fireworld.reproduction.kept import Kept

        n_kept = Kept(out).n_trained(order.n_repetitions)
        click.echo(
            f"interrupted; {n_kept} of {order.n_repetitions} trainings are kept in {out}: go on with --resume", err=True
        )
        context.exit(INTERRUPTED)
    _show(*found)
    click.echo(f"open {out / 'report.html'}")


def _reproduce(order: Order, workers: Workers, progress: Progress) -> tuple[Study, Tables] | None:
    """Train, test, judge, record, draw, write; None if interrupted."""
    from fireworld.reproduction.paper_tables import make_tables
    from fireworld.reproduction.pictures import draw_all, runs_to_record
    from fireworld.reproduction.report_page import report_page
    from fireworld.reproduction.sheets import sheets
    from fireworld.simulation.built import CityCache

    cities = CityCache()
    measured = _measure(order, _workshop(order, workers, cities, progress), workers)
    if measured is None:
        return None
    study, first = measured
    tables = make_tables(study)
    for name, text in sheets(study, tables).items():
        write_file(order.folder / name, text.encode())
    to_record = runs_to_record(first, seed=FIRST_SEED, folder=order.folder / "recordings")
    bar, recorded = progress.add_task("recording", total=len(to_record)), []
    for run in to_record:
        if workers.stop.is_set():
            return None
        recorded.append(run(cities))
        progress.advance(bar)
    images = {}
    for name, image in progress.track(draw_all(study, recorded), total=20, description="drawing"):
        images[name] = image
        write_file(order.folder / "figures" / f"{name}.png", image)
    write_file(order.folder / "report.html", report_page(study, tables, images).encode())
    return study, tables


def _workshop(order: Order, workers: Workers, cities: CityCache, progress: Progress) -> Workshop:
    """Get the work ready.

    Raises:
        TrainingError: what is to go on was begun with other settings.
    """
    from fireworld.reproduction.kept import Kept
    from fireworld.reproduction.pieces import Workshop
    from fireworld.reproduction.trials import build_tests
    from fireworld.training.curriculum import load_curriculum
    from fireworld.training.methods.sarsa import PAPER

    training, testing = (progress.add_task(name, total=None) for name in ("training", "testing"))
    workshop = Workshop(
        kept=Kept(order.folder),
        curriculum=load_curriculum(CURRICULUM),
        method=PAPER,
        n_repetitions=order.n_repetitions,
        tests=build_tests(order.seeds, cities),
        cities=cities,
        stop=workers.stop,
        on_scenario=lambda n: progress.advance(training, n),
        on_trial=lambda n: progress.advance(testing, n),
    )
    progress.update(training, total=workshop.n_scenarios)
    progress.update(testing, total=workshop.n_trials)
    if order.resume:
        workshop.kept.check_settings(workshop.identity)
    else:
        workshop.kept.keep_settings(workshop.identity)
    return workshop


def _measure(order: Order, workshop: Workshop, workers: Workers) -> tuple[Study, Repetition] | None:
    """Train and test all repetitions; return what was measured, and the first repetition. None if interrupted."""
    from fireworld.reproduction.study import Study
    from fireworld.reproduction.trials import collect

    done = workers.run(workshop.pieces())
    if done is None:
        return None
    repetitions = [repetition for repetition, _ in done if repetition is not None]
    *of_repetitions, of_rules = (tested for _, tested in done)
    study = Study(
        n_repetitions=order.n_repetitions,
        seeds=order.seeds,
        lessons=[lesson for repetition in repetitions for lesson in repetition.lessons],
        outcomes=collect(of_repetitions, of_rules),
        agreement=[repetition.agreement for repetition in repetitions],
    )
    return study, repetitions[0]


def _show(study: Study, tables: Tables) -> None:
    """Show the findings and the paper's tables in the terminal."""
    from rich.console import Console
    from rich.table import Table

    from fireworld.reproduction.findings import caveat, findings

    console = Console(highlight=False)
    console.print(_figures_table(tables))
    answers = Table("question", "answer", title="findings")
    for finding in findings(study, tables):
        answers.add_row(finding.question, finding.verdict)
    console.print(answers)
    if (warning := caveat(study)) is not None:
        click.echo(warning)


def _figures_table(tables: Tables) -> Table:
    """Return the paper's Tables 1 to 3 and ours side by side."""
    from rich.box import SIMPLE_HEAD
    from rich.markup import escape
    from rich.table import Table

    from fireworld.reproduction.findings import spread
    from fireworld.reproduction.paper_tables import APART, NEAR, WITHIN, Cell

    marks = {WITHIN: "=", NEAR: "~", APART: "x"}
    short = {"convergence episode": "episodes", "time to complete": "time"}

    def compared(cell: Cell) -> str:
        digits = 1 if cell.quantity == "score" else 0
        return escape(f"{marks[cell.verdict]} {cell.paper:.3g}: {spread(cell.ours, digits=digits)}")

    table = Table(
        title="paper: ours [95 % interval]",
        caption="= the paper's figure is in it, ~ our mean is within 25 % of it, x neither",
        box=SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
    )
    table.add_column("scenario", no_wrap=True)
    table.add_column("figure", no_wrap=True)
    table.add_column("without cooperation", justify="right", no_wrap=True)
    table.add_column("with", justify="right", no_wrap=True)
    for cell in tables.lessons:
        table.add_row(cell.scenario, short.get(cell.quantity, cell.quantity), "", compared(cell))
    for pair in (*tables.tests, *tables.more_brigades):
        scenario, quantity = pair.without.scenario.replace("-brigades-", ", "), pair.without.quantity
        figures = compared(pair.without), compared(pair.together)
        table.add_row(scenario, short.get(quantity, quantity), *figures)
    return table
