"""`fireworld scenarios check`: are the fires of scenarios contested?"""

from __future__ import annotations

import json
from typing import get_args

import click

from fireworld.cli.compiling import announce_compilation
from fireworld.cli.options import (
    counts_option,
    first_seed_option,
    held_option,
    jobs_option,
    lost_option,
    settings_option,
)
from fireworld.cli.progress import BAR, COUNT, DESCRIPTION, LEFT, bars
from fireworld.cli.tables import print_blocks
from fireworld.evaluation.contested import FIRST_SEED, N_SEEDS, Contest


@click.command()
@click.argument("scenarios", metavar="[SCENARIO]...", nargs=-1)
@counts_option
@click.option(
    "--seeds", "n_seeds", metavar="N", default=N_SEEDS, show_default=True, type=click.IntRange(1, 10_000),
    help="Runs of each policy.",
)  # fmt: skip
@first_seed_option(FIRST_SEED)
@lost_option
@held_option
@settings_option
@jobs_option
@click.option("--require", type=click.Choice(get_args(Contest)), help="Exit with 1 unless all fires are so.")
@click.option("--json", "as_json", is_flag=True, help="Write JSON.")
@click.option("--markdown", is_flag=True, help="Write a table in Markdown.")
@click.pass_context
def check(
    context: click.Context,
    *,
    scenarios: tuple[str, ...],
    counts: list[int] | None,
    n_seeds: int,
    first_seed: int,
    lost_below: float,
    held_above: float,
    settings: tuple[str, ...],
    jobs: int | None,
    require: str | None,
    as_json: bool,
    markdown: bool,
) -> None:
    """Is the fire of each SCENARIO contested?

    Or is it lost, or held, whatever brigades do? A SCENARIO is the name of one that comes with fireworld, or a YAML
    file; without any, all that come with it are checked. Six rules that learn nothing play each; beside them stands the
    same fire without any water. The mean score of the rules, as a share of the maximum, makes the verdict: lost,
    contested or held. If it is not contested, a hint says what to change.

    \b
    fireworld scenarios check test-1
    fireworld scenarios check town.yaml --set brigades.n=6
    fireworld scenarios check test-1 --counts 5-12           if so many buildings burn
    fireworld scenarios check town.yaml --require contested  for CI

    Exit code: 0 checked, whatever the verdict; with --require 1 if a verdict is another; 2 could not check; 130
    interrupted.
    """
    if as_json and markdown:
        raise click.UsageError("--json and --markdown exclude each other.")
    announce_compilation()
    from fireworld.evaluation.check_scenarios import check_scenarios
    from fireworld.scenario import split_settings
    from fireworld.scenario.yaml_text import read_yaml

    with bars(DESCRIPTION, BAR, COUNT, LEFT) as progress:
        bar = progress.add_task("runs", total=None)
        found = check_scenarios(
            scenarios or None,
            counts=counts,
            seeds=n_seeds,
            first_seed=first_seed,
            lost_below=lost_below,
            held_above=held_above,
            set={key: read_yaml(text, source=f"--set {key}") for key, text in split_settings(settings).items()},
            executor=jobs,
            on_run=lambda n_done, n_all: progress.update(bar, completed=n_done, total=n_all),
        )
    if as_json:
        click.echo(json.dumps(found.to_dict(), indent=2))
    elif markdown:
        click.echo(found.markdown)
    else:
        print_blocks(found.describe())
    context.exit(1 if require is not None and any(one.verdict != require for one in found.checks) else 0)
