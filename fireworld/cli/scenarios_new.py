"""`fireworld scenarios new`: contested fires in a city, as scenario files."""

from __future__ import annotations

import json
from pathlib import Path

import click

from fireworld.cli.compiling import announce_compilation
from fireworld.cli.options import SEED_MAX, counts_option, held_option, jobs_option, lost_option
from fireworld.cli.progress import BAR, COUNT, DESCRIPTION, ELAPSED, bars
from fireworld.cli.tables import print_blocks
from fireworld.evaluation.contested import N_SEEDS


@click.command()
@click.option(
    "-o", "--output", metavar="F.yaml", required=True, type=click.Path(path_type=Path),
    help="Scenario file to write; of several fires the curriculum, with F-1.yaml, F-2.yaml ... beside it.",
)  # fmt: skip
@click.option("--city", metavar="CITY", help="A city file, the folder of a map, or a scenario.  [default: a new city]")
@click.option(
    "--seed", metavar="N", default=1, show_default=True, type=click.IntRange(0, SEED_MAX),
    help="Of the places, the people drawn around them, and a new city.",
)  # fmt: skip
@click.option("--n", metavar="N", default=1, show_default=True, type=click.IntRange(1, 1000), help="Scenarios to find.")
@click.option(
    "--n-fires", metavar="N", default=1, show_default=True, type=click.IntRange(1, 100),
    help="Fires at a time, in each scenario.",
)  # fmt: skip
@click.option(
    "--brigades", metavar="N", type=click.IntRange(1, 1000), help="How many.  [default: the scenario's or map's, or 4]"
)
@click.option(
    "--civilians", metavar="N", type=click.IntRange(0, 100_000),
    help="How many around each fire.  [default: the scenario's or map's, or 8 to 11]",
)  # fmt: skip
@counts_option
@click.option(
    "--places",
    metavar="N",
    type=click.IntRange(1, 100_000),
    help="Places to try.  [default: 4 a scenario, at least 32]",
)
@click.option(
    "--seeds", "n_seeds", metavar="N", default=N_SEEDS, show_default=True, type=click.IntRange(1, 10_000),
    help="Runs of each rule.",
)  # fmt: skip
@lost_option
@held_option
@click.option("--set", "settings", metavar="KEY=VALUE", multiple=True, help="Set a key of the scenario; repeatable.")
@jobs_option
@click.option("--force", is_flag=True, help="Replace existing files.")
@click.option("--json", "as_json", is_flag=True, help="Write JSON: also the places where no fire is contested.")
@click.pass_context
def new(
    context: click.Context,
    *,
    output: Path,
    city: str | None,
    seed: int,
    n: int,
    n_fires: int,
    brigades: int | None,
    civilians: int | None,
    counts: list[int] | None,
    places: int | None,
    n_seeds: int,
    lost_below: float,
    held_above: float,
    settings: tuple[str, ...],
    jobs: int | None,
    force: bool,
    as_json: bool,
) -> None:
    """Find contested fires in CITY, and write them as scenarios.

    CITY is a city file; the folder of a map, whose brigades, people and configuration are taken, too; or a scenario (by
    name or file), of which everything stays but the fires. Without it, a city is made, from --seed.

    \b
    fireworld scenarios new -o fire.yaml --city town.json
    fireworld scenarios new -o fire.yaml --city town.yaml --brigades 6 --seed 2
    fireworld scenarios new -o fires.yaml --city maps/kobe --n 8
    fireworld scenarios new -o fire.yaml --set city.generated.columns=40

    Places are drawn, each a building that can burn. There the fire grows, until the rules of `fireworld scenarios
    check` do not hold it any more. If it is not lost then, and what brigades do makes a difference, it is contested.
    The same options find the same fires.

    Exit code: 0 found and written; 1 not as many found as asked for, nothing is written; 2 could not be done; 130
    interrupted, nothing is written.
    """
    announce_compilation()
    from fireworld.evaluation.new_scenarios import new_scenarios
    from fireworld.scenario import split_settings
    from fireworld.scenario.yaml_text import read_yaml

    example = "city.generated.columns=40"
    with bars(DESCRIPTION, BAR, COUNT, ELAPSED) as progress:
        bar = progress.add_task("places", total=None)
        found = new_scenarios(
            city,
            n=n,
            seed=seed,
            n_fires=n_fires,
            brigades=brigades,
            civilians=civilians,
            counts=counts,
            places=places,
            seeds=n_seeds,
            lost_below=lost_below,
            held_above=held_above,
            set={
                key: read_yaml(text, source=f"--set {key}")
                for key, text in split_settings(settings, example=example).items()
            },
            output=output,
            force=force,
            executor=jobs,
            on_place=lambda n_tried, n_all, n_found: progress.update(
                bar, completed=n_tried, total=n_all, description=f"{n_found} of {n} found, places"
            ),
        )
    if as_json:
        click.echo(json.dumps(found.to_dict(), indent=2))
    elif found.complete:
        print_blocks(found.describe())
        _print_files(found.files)
    if not found.complete:
        click.echo(f"{found.sentence}; nothing is written", err=True)
    context.exit(0 if found.complete else 1)


def _print_files(files: tuple[Path, ...]) -> None:
    """Say what was written, and what to do with it."""
    first, *scenarios = files
    if scenarios:
        click.echo(f"wrote {scenarios[0]} to {scenarios[-1]}, and {first}, the curriculum of them")
    else:
        click.echo(f"wrote {first}; run it with `fireworld run {first}`")
