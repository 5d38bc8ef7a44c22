"""`fireworld city osm`: a city of an extract of OpenStreetMap."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from fireworld.maps.osm import ImportedOsm

WIDTH = 80
_COUNT_WIDTH = 5


@click.command("osm")
@click.argument("extract", metavar="FILE", type=click.Path(path_type=Path))
@click.option("--around", metavar="LAT,LON", help="Middle of the city.  [default: the middle of the extract]")
@click.option("--radius", metavar="M", type=float, help="Take the buildings so near to the middle.")
@click.option("--box", metavar="S,W,N,E", help="Take the buildings between these degrees instead.")
@click.option("--seed", type=int, default=1, show_default=True, help="Of materials that no tag names.")
@click.option("--name", help="Name of the city.  [default: the file's]")
@click.option(
    "--refuge", "refuges", metavar="ID", multiple=True, help="A building that is a refuge.  [default: fire stations]"
)
@click.option("--attribution", metavar="TEXT", help="Whom the data is by.  [default: OpenStreetMap contributors]")
@click.option(
    "-o", "--output", metavar="F.json", required=True, type=click.Path(path_type=Path), help="City file to write."
)
@click.option(
    "--write-scenario", metavar="F.yaml", type=click.Path(path_type=Path), help="Scenario file to write, too."
)
@click.option("--fires", metavar="ID,...", help="Buildings that burn in it.  [default: two in the middle]")
@click.option("--force", is_flag=True, help="Replace existing files.")
@click.option("--json", "as_json", is_flag=True, help="Write JSON.")
def osm(
    *,
    extract: Path,
    around: str | None,
    radius: float | None,
    box: str | None,
    seed: int,
    name: str | None,
    refuges: Sequence[str],
    attribution: str | None,
    output: Path,
    write_scenario: Path | None,
    fires: str | None,
    force: bool,
    as_json: bool,
) -> None:
    """Make a city of FILE, an extract of OpenStreetMap (.osm, .osm.gz, .pbf).

    Whatever was repaired, inferred or left out is listed. Buildings are numbered
    from 1; each keeps its id in OpenStreetMap, which --refuge and --fires take, too
    (w123 is a way, r45 a relation). Without --radius and --box all of FILE is taken.

    \b
    fireworld city osm town.osm.pbf --radius 500 -o town.json
    fireworld city osm town.osm.pbf --around 60.1699,24.9384 --radius 300 -o town.json
    fireworld city osm town.osm --box 60.16,24.93,60.17,24.95 -o town.json
    fireworld city osm town.osm.pbf --radius 500 --refuge w123 -o town.json \\
        --write-scenario town.yaml --fires w456,r78

    Reading needs pyosmium: pip install 'fireworld[osm]'.

    Exit code: 0 imported, 2 could not import (nothing is written).
    """
    from fireworld.cli.progress import bars
    from fireworld.maps.osm import ATTRIBUTION, import_osm

    if fires is not None and write_scenario is None:
        raise click.UsageError("--fires goes with --write-scenario.")
    middle = None if around is None else _degrees("--around", around, 2)
    edges = None if box is None else _degrees("--box", box, 4)
    with bars("{task.description}") as progress:
        task = progress.add_task("reading", total=None)
        made = import_osm(
            extract,
            around=None if middle is None else (middle[0], middle[1]),
            radius_m=radius,
            box=None if edges is None else (edges[0], edges[1], edges[2], edges[3]),
            seed=seed,
            name=name,
            refuges=refuges,
            attribution=ATTRIBUTION if attribution is None else attribution,
            output=output,
            write_scenario=write_scenario,
            fires=None if fires is None else fires.split(","),
            force=force,
            on_progress=lambda what: progress.update(task, description=what),
        )
    if as_json:
        found = {**made.summary, "report": made.report.as_json(), "files": [str(path) for path in made.files]}
        click.echo(json.dumps(found, indent=2))
    else:
        _print_import(made)


def _degrees(option: str, text: str, n: int) -> list[float]:
    """Read numbers separated by commas."""
    parts = text.split(",")
    try:
        found = [float(part) for part in parts]
    except ValueError:
        found = []
    if len(found) != n:
        raise click.BadParameter(
            f"expected {n} numbers of degrees, separated by commas, got {text!r}.", param_hint=option
        )
    return found


def _print_import(made: ImportedOsm) -> None:
    """Write what an import made, and its report as a table."""
    import textwrap

    found = made.summary
    wide, high = found["extent_m"]
    click.echo(f"{found['name']}: {found['n_buildings']} buildings, {wide:.0f} m by {high:.0f} m")
    rest = f"{found['n_refuges']} refuges, {found['n_hydrants']} hydrants"
    click.echo(f"{found['n_streets']} streets between {found['n_nodes']} nodes, {rest}")
    for finding in made.report.findings:
        count = "" if finding.n is None else str(finding.n)
        text = str(finding).removeprefix(f"{count} ")
        indent = " " * (_COUNT_WIDTH + 2)
        lines = textwrap.wrap(text, WIDTH, initial_indent=indent, subsequent_indent=indent, break_on_hyphens=False)
        click.echo("\n".join([f"{count:>{_COUNT_WIDTH}}  {lines[0].strip()}", *lines[1:]]))
    for path in made.files:
        click.echo(f"wrote {path}")
