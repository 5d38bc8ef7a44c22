"""`fireworld city`: cities of maps, to and from other formats, and pictures of them."""

from __future__ import annotations

import json
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from fireworld.cli.city_osm import osm

if TYPE_CHECKING:
    from fireworld_viewer.pictures.city_plan import CityPlan

    from fireworld.city.city import Plan
    from fireworld.maps.importing import ImportedCity

WIDTH: Final = 80
force_option = click.option("--force", is_flag=True, help="Replace existing files.")
json_option = click.option("--json", "as_json", is_flag=True, help="Write JSON.")


@click.group()
def command() -> None:
    """Make cities of real maps, write cities as official maps, draw them.

    From a folder with map.gml to a film of a fire in it:

    \b
    fireworld city import maps/sakae -o sakae.json --write-scenario sakae.yaml
    fireworld city show sakae.json -o sakae.png
    fireworld run sakae.yaml --record sakae.mcap
    fireworld render sakae.mcap -o sakae.gif

    `fireworld city osm` does the same for an extract of OpenStreetMap.
    """


command.add_command(osm)


@command.command("import")
@click.argument("map_", metavar="MAP", type=click.Path(path_type=Path))
@click.option(
    "--config", metavar="DIR", type=click.Path(path_type=Path), help="Folder with *.cfg.  [default: the map's]"
)
@click.option(
    "--scenario", metavar="F.xml", type=click.Path(path_type=Path), help="A scenario.xml.  [default: the map's]"
)
@click.option("--fires", metavar="ID,...", help="Buildings that burn, instead of those of scenario.xml.")
@click.option(
    "--links", metavar="F.npz", type=click.Path(path_type=Path), help="Radiation links, as a trace holds them."
)
@click.option("--attribution", metavar="TEXT", help="Who made the map: goes wherever it is shown.")
@click.option(
    "-o", "--output", metavar="F.json", required=True, type=click.Path(path_type=Path), help="City file to write."
)
@click.option(
    "--write-scenario", metavar="F.yaml", type=click.Path(path_type=Path), help="Scenario file to write, too."
)
@force_option
@json_option
def import_(
    *,
    map_: Path,
    config: Path | None,
    scenario: Path | None,
    fires: str | None,
    links: Path | None,
    attribution: str | None,
    output: Path,
    write_scenario: Path | None,
    force: bool,
    as_json: bool,
) -> None:
    """Read MAP, of the RoboCup Rescue simulation, exactly as the official reader does.

    MAP is a folder with map.gml, scenario.xml and *.cfg, or a map.gml; packed by gzip, too. Whatever was repaired,
    inferred or left out is listed.

    \b
    fireworld city import maps/kobe -o kobe.json
    fireworld city import map.gml.gz --config config -o town.json
    fireworld city import maps/kobe --fires 12299,24587 -o kobe.json \\
        --write-scenario kobe.yaml

    A scenario may name the folder itself, too: `city: {official: maps/kobe}`.

    Exit code: 0 imported, 2 could not import (nothing is written).
    """
    from fireworld.maps.importing import import_city

    if fires is not None and write_scenario is None:
        raise click.UsageError("--fires goes with --write-scenario.")
    made = import_city(
        map_,
        config=config,
        scenario=scenario,
        fires=None if fires is None else _ids(fires),
        links=links,
        attribution=attribution,
        output=output,
        write_scenario=write_scenario,
        force=force,
    )
    if as_json:
        found = {**made.summary, "report": made.report.as_json(), "files": [str(path) for path in made.files]}
        click.echo(json.dumps(found, indent=2))
    else:
        _print_import(made)


def _ids(text: str) -> list[int]:
    """Read ids separated by commas."""
    from fireworld.errors import ScenarioError, expected

    parts = [part.strip() for part in text.split(",")]
    for part in parts:
        if not (part.isdecimal() and part.isascii()) or len(part) > 10:
            raise ScenarioError(expected("--fires", "", "ids of buildings, separated by commas", part or "nothing"))
    return [int(part) for part in parts]


def _print_import(made: ImportedCity) -> None:
    """Write what an import made, and its report."""
    found = made.summary
    wide, high = found["extent_m"]
    click.echo(f"{found['name']}: {found['n_buildings']} buildings, {wide:.0f} m by {high:.0f} m")
    words = (("roads", "road"), ("refuges", "refuge"), ("hydrants", "hydrant"), ("entrances", "entrance"))
    counts = [(found[f"n_{plural}"], plural, single) for plural, single in words]
    click.echo(", ".join(f"{n} {single if n == 1 else plural}" for n, plural, single in counts))
    for line in made.report.lines:
        _print_item(line)
    for path in made.files:
        click.echo(f"wrote {path}")


@command.command()
@click.argument("city", metavar="CITY")
@click.option("-o", "--output", metavar="DIR", required=True, type=click.Path(path_type=Path), help="Folder to make.")
@force_option
@json_option
def export(*, city: str, output: Path, force: bool, as_json: bool) -> None:
    """Write CITY as a map of the RoboCup Rescue simulation: map.gml, scenario.xml, *.cfg.

    CITY is a city file, the folder of a map, or a scenario (by name or file): then its fires, civilians, brigades and
    parameters are written, too. A city without roads gets roads along its streets, with an entrance to every building.
    What was written is read again as the official reader does; what it reads otherwise is listed.

    \b
    fireworld city export default -o default-map
    fireworld city export kobe.json -o kobe

    Exit code: 0 exported, 2 could not export (nothing is written).
    """
    from fireworld.maps.exporting import export_city

    made = export_city(city, output, force=force)
    if as_json:
        n_buildings = len(made.plan.footprints.building_id)
        found = {"folder": str(output), "n_buildings": n_buildings, "differences": list(made.differences)}
        click.echo(json.dumps(found, indent=2))
        return
    for line in made.differences:
        _print_item(line)
    click.echo(f"wrote {output}: {len(made.plan.footprints.building_id)} buildings")


def _print_item(line: str) -> None:
    """Write a line of a list."""
    click.echo(textwrap.fill(line, WIDTH, initial_indent="- ", subsequent_indent="  ", break_on_hyphens=False))


@command.command()
@click.argument("city", metavar="CITY")
@click.option(
    "-o", "--output", metavar="F.png", type=click.Path(path_type=Path), help="PNG, SVG or PDF.  [default: NAME.png]"
)
@force_option
def show(*, city: str, output: Path | None, force: bool) -> None:
    """Draw CITY: buildings by material, refuges, other kinds of buildings, roads, hydrants.

    CITY is a city file, the folder of a map, or a scenario (by name or file). Where the map comes from is written into
    a corner.

    \b
    fireworld city show sakae.json -o sakae.png
    fireworld city show maps/kobe -o kobe.svg

    Exit code: 0 drawn, 2 could not draw.
    """
    from fireworld_viewer.pictures.city_plan import draw_plan
    from fireworld_viewer.pictures.figure_files import plain_style, save_figure

    from fireworld.maps.sources import city_of

    plan = city_of(city).plan
    path = output or Path(Path(f"{plan.name}.png").name)
    with plain_style():
        save_figure(draw_plan(_drawn(plan)), path, force=force)
    click.echo(f"{path}: {len(plan.footprints.building_id)} buildings")


def _drawn(plan: Plan) -> CityPlan:
    """Return what is drawn of a plan, in metres."""
    import numpy as np
    from fireworld_viewer.pictures.city_plan import CityPlan

    from fireworld.city.formats.json_plan import BUILDING_TYPES
    from fireworld.records import MATERIALS

    found, streets, roads = plan.footprints, plan.streets, plan.roads
    node = streets.node_mm / 1000.0
    kinds = found.refuge if plan.kind is None else plan.kind  # 0 building, 1 refuge in either
    wide, high = ((found.outline_mm.max(axis=0) - found.outline_mm.min(axis=0)) / 1000.0).tolist()
    outlines = np.split(found.outline_mm / 1000.0, found.outline_ptr[1:-1])
    entrances = streets.entrance_node[streets.entrance_node >= 0]
    return CityPlan(
        title=plan.name,
        subtitle=f"{len(outlines)} buildings, {wide:.0f} m by {high:.0f} m",
        attribution=plan.attribution,
        outlines=outlines,
        material=[MATERIALS[material] for material in found.material.tolist()],
        kind=[BUILDING_TYPES[kind] for kind in kinds.tolist()],
        roads=[] if roads is None else np.split(roads.outline_mm / 1000.0, roads.outline_ptr[1:-1]),
        streets=node[streets.street],
        hydrants=node[streets.hydrant_node],
        entrances=node[entrances],
    )
