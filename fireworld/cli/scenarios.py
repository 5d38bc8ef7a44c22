"""`fireworld scenarios`: list the scenarios and suites that come with fireworld, draw, check and find some."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fireworld.cli.scenarios_check import check
from fireworld.cli.scenarios_new import new

if TYPE_CHECKING:
    from fireworld.evaluation.suites import Suite
    from fireworld.scenario import Scenario


@click.group(invoke_without_command=True)
@click.option("--json", "as_json", is_flag=True, help="Write JSON instead of a table.")
@click.pass_context
def command(context: click.Context, *, as_json: bool) -> None:
    """List the scenarios that come with fireworld, and the suites of them to measure policies in.

    `fireworld scenarios show NAME` draws one, `check` says whether its fire is contested, and `new` finds contested
    fires in a city.
    """
    if context.invoked_subcommand is not None:
        if as_json:
            raise click.UsageError("--json goes with the list of scenarios, not with a command below it.")
        return
    from fireworld.evaluation.suites import suites
    from fireworld.scenario import load_scenario, scenario_names

    scenarios = [load_scenario(name) for name in scenario_names()]
    if as_json:
        click.echo(json.dumps([*map(_summary, scenarios), *map(_suite_summary, suites())], indent=2))
    else:
        _print_table(scenarios, suites())


command.add_command(check)
command.add_command(new)


@command.command()
@click.argument("scenario", metavar="SCENARIO")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="PNG to write.  [default: NAME.png]")
@click.option("--force", is_flag=True, help="Replace an existing file.")
@click.option("--yaml", "as_yaml", is_flag=True, help="Write the scenario with every value, instead of a map.")
@click.option("--set", "settings", multiple=True, metavar="KEY=VALUE", help="Change a value, as in brigades.n=7.")
def show(*, scenario: str, output: Path | None, force: bool, as_yaml: bool, settings: Sequence[str]) -> None:
    """Draw SCENARIO: its city, fires, civilians, refuges and brigades.

    SCENARIO is the name of one that comes with fireworld, or a YAML file.
    """
    from fireworld.scenario import load_scenario, split_settings

    if as_yaml and output is not None:
        raise click.UsageError("--yaml writes to the terminal; -o goes with the map.")
    chosen = load_scenario(scenario).with_settings(split_settings(settings))
    if as_yaml:
        click.echo(chosen.to_yaml(), nl=False)
        return
    _draw(chosen, output or Path(Path(f"{chosen.name}.png").name), force=force)


def _draw(scenario: Scenario, path: Path, *, force: bool) -> None:
    """Draw the map of a scenario at its start."""
    import numpy as np
    from fireworld_viewer.pictures.figure_files import save_figure
    from fireworld_viewer.pictures.maps import draw_map

    from fireworld.simulation.built import build_scenario
    from fireworld.simulation.state import brigade_places

    built = build_scenario(scenario)
    fieryness = np.zeros(built.city.n_buildings, dtype=np.uint8)
    fieryness[built.placement.ignited] = 1
    placement = built.placement
    brigades_xy = brigade_places(built.city, placement.brigade_refuge, placement.brigade_node)[2] / 1000.0
    title = ": ".join(part for part in (scenario.name, scenario.description) if part)
    figure = draw_map(built.city_record(), fieryness=fieryness, brigades_xy=brigades_xy, title=title)
    save_figure(figure, path, force=force)
    click.echo(f"{path}: {built.city.n_buildings} buildings, {len(built.placement.ignited)} burning")


def _summary(scenario: Scenario) -> dict[str, Any]:
    """Return what the list says of a scenario."""
    return {
        "name": scenario.name,
        "description": scenario.description,
        "city": scenario.city.summary,
        "n_brigades": scenario.brigades.n,
        "n_civilians": scenario.civilians.count,
        "steps": scenario.steps,
        "digest": scenario.digest,
    }


def _suite_summary(suite: Suite) -> dict[str, Any]:
    """Return what the list says of a suite."""
    return {
        "name": suite.name,
        "description": suite.description,
        "n_scenarios": len(suite.scenarios),
        "digest": suite.digest,
    }


def _print_table(scenarios: Sequence[Scenario], suites: Sequence[Suite]) -> None:
    """Write the lists as two tables."""
    rows = []
    for scenario in scenarios:
        row = _summary(scenario)
        city = str(row["city"]).removesuffix(" lots")
        rows.append((row["name"], city, row["n_brigades"], row["n_civilians"], row["description"]))
    _print_columns(("name", "city", "brigades", "civilians", "description"), rows)
    click.echo()
    of_suites = [(suite.name, len(suite.scenarios), suite.description) for suite in suites]
    _print_columns(("suite", "scenarios", "description"), of_suites)


def _print_columns(heads: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Write a table: the first column and the last are text, those between them to the right."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, header_style="bold", pad_edge=False)
    first, *middle, last = heads
    table.add_column(first, no_wrap=True)
    for heading in middle:
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column(last)
    for row in rows:
        table.add_row(*(Text(str(cell)) for cell in row))
    Console(highlight=False).print(table)
