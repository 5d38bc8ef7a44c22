"""`fireworld leaderboard`: policies in suites of scenarios that nobody learned in, ranked."""

from __future__ import annotations

import json
from pathlib import Path

import click

from fireworld.cli.compiling import announce_compilation
from fireworld.cli.options import executor_of, first_seed_option, jobs_option, on_option
from fireworld.cli.progress import runs_bar


@click.command()
@click.argument("policies", metavar="[POLICY]...", nargs=-1)
@click.option("--suites", metavar="NAMES", help="Suites, with commas; scenarios too.  [default: all suites]")
@click.option(
    "--seeds", "n_seeds", metavar="N", default=20, show_default=True, type=click.IntRange(1, 10_000),
    help="Runs of each policy in each scenario.",
)  # fmt: skip
@first_seed_option(1)
@jobs_option
@on_option
@click.option(
    "--results", metavar="FILE.parquet", type=click.Path(path_type=Path),
    help="Take known runs from here, rank its policies too, and add new.",
)  # fmt: skip
@click.option("--resume", is_flag=True, help="Continue what an interrupted call left in --results.")
@click.option("--html", metavar="FILE.html", type=click.Path(path_type=Path), help="Write a page.")
@click.option("--force", is_flag=True, help="Replace an existing page.")
@click.option("--markdown", "as_markdown", is_flag=True, help="Write a table of Markdown.")
@click.option("--json", "as_json", is_flag=True, help="Write JSON.")
def command(
    *,
    policies: tuple[str, ...],
    suites: str | None,
    n_seeds: int,
    first_seed: int,
    jobs: int | None,
    on: str | None,
    results: Path | None,
    resume: bool,
    html: Path | None,
    force: bool,
    as_markdown: bool,
    as_json: bool,
) -> None:
    """Run each POLICY in the suites, and rank them by the share of the greatest score that they reach.

    \b
    fireworld leaderboard chief best --results board.parquet        all suites, 20 seeds
    fireworld leaderboard my:Policy --results board.parquet         one more row
    fireworld leaderboard --results board.parquet --html board.html what is known, as a page
    fireworld leaderboard chief my:Policy --suites contested,larger --seeds 5

    Suites are fixed sets of fires that nobody learned or chose in; `fireworld scenarios` lists them. All policies see
    the same random draws. With --results the policies that the file has runs of, made by the same simulator, are ranked
    too; what another simulator measured is shown apart. After Ctrl-C the same call continues where it stopped.

    Exit code: 0; 2 could not be done; 130 interrupted (--results keeps every run that is done).
    """
    if as_json and as_markdown:
        raise click.UsageError("--json and --markdown exclude each other.")
    if force and html is None:
        raise click.UsageError("--force goes with --html.")
    if resume and results is None:
        raise click.UsageError("--resume goes with --results.")
    if not policies and results is None:
        raise click.UsageError("Missing argument 'POLICY...'; or name --results that hold runs.")
    from fireworld.evaluation.leaderboard import leaderboard
    from fireworld.executors import n_cores
    from fireworld.files import check_output

    if html is not None:
        check_output(html, force=force)
    announce_compilation()
    with runs_bar(results) as on_run:
        board = leaderboard(
            policies,
            suites=None if suites is None else [name.strip() for name in suites.split(",")],
            seeds=n_seeds,
            first_seed=first_seed,
            executor=executor_of(on, jobs) or n_cores(),
            results=results,
            resume=resume,
            on_run=on_run,
        )
    for warning in board.warnings:
        click.echo(warning, err=True)
    if html is not None:
        board.save_html(html, force=force)
    if as_json:
        click.echo(json.dumps(board.to_dict(), indent=2))
    else:
        click.echo(board.markdown if as_markdown else repr(board))
