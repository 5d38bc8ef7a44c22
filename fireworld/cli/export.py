"""`fireworld export`: write a recording as tables for data tools."""

from __future__ import annotations

import json
from pathlib import Path

import click

from fireworld.cli.progress import bar


@click.command()
@click.argument("log", metavar="LOG", type=click.Path(path_type=Path))
@click.option(
    "--parquet",
    "folder",
    metavar="DIR",
    type=click.Path(path_type=Path),
    required=True,
    help="Write a Parquet file for each table into this folder.",
)
@click.option(
    "--tables",
    metavar="NAMES",
    help="Only these: city, buildings, brigades, decisions, civilians, sites, events, steps; of a training episodes, "
    "steps, tables; of a search generations, candidates, fights. Separated by commas.",
)
@click.option("--force", is_flag=True, help="Replace an earlier export.")
@click.option("--json", "as_json", is_flag=True, help="Write what was exported as JSON.")
def command(*, log: Path, folder: Path, tables: str | None, force: bool, as_json: bool) -> None:
    """Write LOG, a recording, as tables that pandas, polars and DuckDB open.

    \b
    fireworld export run.mcap --parquet run
    fireworld export run.mcap --parquet run --tables buildings,steps --force

    There is a row for each step and building, brigade and so on. Columns are named after the fields of the recording,
    with unit and meaning in the metadata of the column; the header of the run is the metadata of each file.
    A recording that was cut off or damaged is exported as far as it is good.

    Exit code: 0 exported, 2 could not export, 130 interrupted (nothing is left of it).
    """
    from fireworld.recording.export import export
    from fireworld.recording.inputs import is_training, open_run
    from fireworld.records import StoredRun
    from fireworld.training.log.reader import open_training

    chosen = None if tables is None else [name.strip() for name in tables.split(",")]
    recording = open_training(log, partial=True) if is_training(log) else open_run(log, partial=True)
    with bar("export", len(recording), quiet=as_json) as advance:
        n_rows = export(recording, folder, tables=chosen, force=force, on_step=lambda _: advance())
    if recording.damage is not None:
        unit = "step" if isinstance(recording, StoredRun) else recording.header.unit
        click.echo(f"{log}: {recording.damage}; exported {len(recording)} committed {unit}s", err=True)
    if as_json:
        known = {key: getattr(recording, key) for key in ("state", "damage", "digest")}
        known = {"folder": str(folder), **known, "n_steps": len(recording), "n_rows": n_rows}
        click.echo(json.dumps(known, indent=2))
        return
    for name, n in n_rows.items():
        click.echo(f"{folder / name}.parquet: {n:,} rows")
