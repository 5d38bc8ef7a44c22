"""`fireworld export`: write recordings as tables for data tools, or as datasets for learners."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import click

from fireworld.cli.compiling import announce_compilation
from fireworld.cli.progress import bar


@click.command()
@click.argument("logs", metavar="LOG...", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "--parquet",
    metavar="DIR",
    type=click.Path(path_type=Path),
    help="Write a Parquet file for each table into this folder.",
)
@click.option(
    "--csv", metavar="DIR", type=click.Path(path_type=Path), help="Write a CSV file for each table into this folder."
)
@click.option(
    "--jsonl",
    metavar="FILE",
    type=click.Path(path_type=Path),
    help="Write a line of JSON for each row of all tables into this file.",
)
@click.option("--rlds", metavar="DIR", type=click.Path(path_type=Path), help="Write a dataset as Parquet files.")
@click.option("--minari", metavar="ID", help="Write a dataset of Minari, as in fireworld/quick/random-v0.")
@click.option(
    "--tables",
    metavar="NAMES",
    help="Of --parquet, --csv and --jsonl, only these: city, buildings, brigades, decisions, civilians, sites, events, "
    "steps; of a training episodes, steps, tables; of a search generations, candidates, fights; of an evolution "
    "evolved, evolved_fights; of rollouts and imitation improved, improved_fights; of what a learner played played, "
    "actions. Separated by commas.",
)
@click.option(
    "--observation",
    type=click.Choice(("features", "targets")),
    help="Of a dataset: what brigades see.  [default: as learners did, else features]",
)
@click.option(
    "--reward",
    type=click.Choice(("score", "scenario")),
    help="Of a dataset: the change of the score, or the scenario's own.  [default: as learners got it, else scenario]",
)
@click.option(
    "--own-targets",
    type=click.IntRange(min=0),
    metavar="N",
    help="Of a dataset: how many targets a brigade may name itself.  [default: as many as are needed]",
)
@click.option("--force", is_flag=True, help="Replace an earlier export.")
@click.option("--json", "as_json", is_flag=True, help="Write what was exported as JSON.")
def command(
    *,
    logs: tuple[Path, ...],
    parquet: Path | None,
    csv: Path | None,
    jsonl: Path | None,
    rlds: Path | None,
    minari: str | None,
    tables: str | None,
    force: bool,
    as_json: bool,
    **dataset: Any,
) -> None:
    """Write LOG, a recording, as tables that pandas, polars and DuckDB open; or several as a dataset for learners.

    \b
    fireworld export run.mcap --parquet run
    fireworld export run.mcap --parquet run --tables buildings,steps --force
    fireworld export run.mcap --csv run-csv
    fireworld export run.mcap --jsonl run.jsonl --tables steps,events
    fireworld export runs/episodes-1.mcap run.mcap --rlds dataset
    fireworld export runs/episodes-1.mcap --minari fireworld/quick/mine-v0

    Of tables there is a row for each step and building, brigade and so on. Columns are named after the fields of the
    recording, with unit and meaning in the metadata of the column; the header of the run is the metadata of each file.
    With --csv columns.csv says what each column is and in which unit, with --jsonl the first line. Both need no
    library, and hold one step in memory at a time. A recording that was cut off or damaged is exported as far as it is
    good.

    A dataset has what brigades saw, could do, did and got, from logs of runs and of what learners played in
    environments. Every episode is played again for it, and docs/datasets.md explains how it is loaded back.

    Exit code: 0 exported, 2 could not export, 130 interrupted (nothing is left of it).
    """
    if sum(one is not None for one in (parquet, csv, jsonl, rlds, minari)) != 1:
        raise click.UsageError("Give one of --parquet, --csv, --jsonl, --rlds and --minari.")
    given = {name: value for name, value in dataset.items() if value is not None}
    for form, place in {"parquet": parquet, "csv": csv, "jsonl": jsonl}.items():
        if place is not None:
            if given or len(logs) > 1:
                raise click.UsageError(f"--{form} takes one LOG, and no --observation, --reward or --own-targets.")
            _export_tables(logs[0], place, form, tables, force=force, as_json=as_json)
            return
    if tables is not None:
        raise click.UsageError("--tables goes with --parquet, --csv and --jsonl.")
    _export_dataset(logs, rlds, minari, given, force=force, as_json=as_json)


def _export_tables(log: Path, folder: Path, form: str, tables: str | None, *, force: bool, as_json: bool) -> None:
    from fireworld.recording.export import export
    from fireworld.recording.inputs import is_training, open_run
    from fireworld.records import StoredRun
    from fireworld.training.log.reader import open_training

    chosen = None if tables is None else [name.strip() for name in tables.split(",")]
    recording = open_training(log, partial=True) if is_training(log) else open_run(log, partial=True)
    with bar("export", len(recording), quiet=as_json) as advance:
        n_rows = export(recording, folder, form=form, tables=chosen, force=force, on_step=lambda _: advance())
    if recording.damage is not None:
        unit = "step" if isinstance(recording, StoredRun) else recording.header.unit
        click.echo(f"{log}: {recording.damage}; exported {len(recording)} committed {unit}s", err=True)
    if as_json:
        known = {key: getattr(recording, key) for key in ("state", "damage", "digest")}
        known = {"folder": str(folder), **known, "n_steps": len(recording), "n_rows": n_rows}
        click.echo(json.dumps(known, indent=2))
        return
    for name, n in n_rows.items():
        place = f"{folder}: {name}" if form == "jsonl" else f"{folder / name}.{form}"
        click.echo(f"{place}: {n:,} rows")


def _export_dataset(
    logs: Sequence[Path], rlds: Path | None, minari: str | None, given: Mapping[str, Any], *, force: bool, as_json: bool
) -> None:
    from fireworld.envs.datasets.loading import load_dataset
    from fireworld.envs.datasets.minari_form import export_minari
    from fireworld.envs.datasets.recorded import recorded
    from fireworld.envs.datasets.rlds import export_rlds

    episodes = recorded(logs)
    announce_compilation()
    for log in episodes.logs:
        if log.damage is not None:
            click.echo(f"{getattr(log, 'path', '')}: {log.damage}; exported as far as it is good", err=True)
    if episodes.n_unknown:
        click.echo(f"{episodes.n_unknown} episodes began in states that nobody knows, and are left out", err=True)
    with bar("export", len(episodes), quiet=as_json) as advance:
        if rlds is not None:
            export_rlds(episodes, rlds, force=force, on_episode=advance, **given)
        elif minari is not None:
            export_minari(episodes, minari, force=force, on_episode=advance, **given)
    dataset = load_dataset(rlds if rlds is not None else minari or "")
    n_steps = sum(one.n_steps for one in dataset.facts)
    if as_json:
        known = {"dataset": dataset.name, **dataset.shape, "n_unknown": episodes.n_unknown}
        click.echo(json.dumps({**known, "n_episodes": len(dataset), "n_steps": n_steps}, indent=2))
        return
    click.echo(f"{dataset.name}: {len(dataset):,} episodes, {n_steps:,} steps")
