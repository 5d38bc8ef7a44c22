"""`fireworld info`: what a recording holds and how far it is good, or what a city file holds."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from fireworld.cli.tables import print_blocks

if TYPE_CHECKING:
    from fireworld_recorder.reader import Log

    from fireworld.training.log.reader import TrainingLog


@click.command()
@click.argument("log", metavar="[LOG|CITY]", required=False, type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Write JSON.")
@click.option("--schema", is_flag=True, help="List its topics and fields: types, shapes, units, meaning.")
@click.option("--proto", is_flag=True, help="Write the messages of this version's logs as a .proto file.")
@click.pass_context
def command(context: click.Context, *, log: Path | None, as_json: bool, schema: bool, proto: bool) -> None:
    """Show what LOG recorded, what it holds and how far it is good.

    LOG is the recording of a run or of a training. Of a city file it shows how large the city is, where it comes from
    and what is odd about it.

    \b
    fireworld info run.mcap             header, outcome, size of each topic
    fireworld info city.json            buildings, streets, source
    fireworld info run.mcap --schema    its topics and fields, those of a later version too
    fireworld info --schema             those that this version writes

    Exit code: 0 good, 1 cut off or damaged but good up to a step, 2 not readable.
    """
    from fireworld_recorder.reader import open_log
    from fireworld_recorder.schema import PROTO
    from fireworld_recorder.source import noun_of

    from fireworld.recording.summary import summary

    if schema and proto:
        raise click.UsageError("--schema and --proto exclude each other.")
    if log is None and not (schema or proto):
        raise click.UsageError("Missing argument 'LOG'; only --schema and --proto do without.")
    if log is not None and _is_city(log):
        if schema or proto:
            raise click.UsageError("--schema and --proto go with logs, not with a city file.")
        _show_city(log, as_json=as_json)
        return
    if log is not None and noun_of(log) == "training":
        _show_training(context, log, as_json=as_json, schema=schema or proto)
    recording = None if log is None else open_log(log, partial=True)
    if proto:
        click.echo(PROTO.read_text(encoding="utf-8"), nl=False)
    elif schema:
        _show_schema(recording, as_json=as_json)
    elif recording is not None:
        if as_json:
            click.echo(json.dumps(summary(recording), indent=2))
        else:
            _show(recording, summary(recording))
    context.exit(0 if recording is None or recording.damage is None else 1)


def _is_city(path: Path) -> bool:
    """Return whether the ending of a file's name is that of a map format."""
    from fireworld.city.formats import FORMATS

    return path.suffix.lower() in FORMATS


def _show_city(path: Path, *, as_json: bool) -> None:
    """Print what a city file holds."""
    from fireworld.city.summary import describe_plan, load_plan, plan_summary
    from fireworld.errors import one_line

    plan = load_plan(path)
    if as_json:
        click.echo(json.dumps(plan_summary(plan), indent=2))
        return
    for label, text in describe_plan(plan):
        click.echo(f"{label:<12} {one_line(text)}")


def _show_training(context: click.Context, path: Path, *, as_json: bool, schema: bool) -> NoReturn:
    """Print what a training log holds."""
    from fireworld.training.log.reader import open_training
    from fireworld.training.log.summary import describe_training, training_summary

    log = open_training(path, partial=True)
    if schema:
        _show_schema(log, as_json=as_json)
    elif as_json:
        click.echo(json.dumps(training_summary(log), indent=2))
    else:
        print_blocks(describe_training(log))
    context.exit(0 if log.damage is None else 1)


def _show_schema(log: Log | TrainingLog | None, *, as_json: bool) -> None:
    """Print the messages of a log, or those that this version writes."""
    from fireworld_recorder.describe import describe
    from fireworld_recorder.recover import channels_of
    from fireworld_recorder.schema import TOPICS
    from fireworld_recorder.totals import plain
    from fireworld_recorder.writer import own_channels

    from fireworld.errors import LogError, one_line
    from fireworld.records import FORMAT

    known = TOPICS if log is None else log.found.kind.topics
    try:
        topics = describe(own_channels() if log is None else channels_of(log.found), known)
    except LogError as error:
        raise LogError(f"{log.path}: {error}" if log is not None else str(error)) from None
    name = FORMAT if log is None else log.found.kind.format
    if as_json:
        click.echo(json.dumps({"format": name, "topics": plain(topics)}, indent=2))
        return
    click.echo(name)
    for topic in topics:
        phase = f" Phase: {topic.phase}." if topic.phase else ""
        click.echo(f"\n{one_line(topic.topic)}  {topic.doc or 'Not known to this version; skipped.'}{phase}")
        rows = [("no.", "field", "type", "shape", "unit", "meaning")]
        rows += [
            (str(item.number), item.name, item.type, item.shape and f"({item.shape},)", item.unit, item.doc)
            for item in topic.fields
        ]
        widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]) - 1)]
        for row in rows:
            cells = [cell.ljust(width) for cell, width in zip(row[:-1], widths, strict=True)]
            click.echo(one_line("  ".join(["", *cells, row[-1]]).rstrip()))


def _show(log: Log, summary: dict[str, Any]) -> None:
    """Print a summary; names in a recording are anybody's, so what cannot be printed is escaped."""
    from fireworld_recorder.totals import final_outcome

    from fireworld.errors import one_line
    from fireworld.outcome import QUANTITIES
    from fireworld.version import simulator_version

    header, steps = summary["header"], summary["steps"]
    span = f"{steps['n']}, from {steps['first']} to {steps['last']}" if steps["n"] else "none"
    seed = "" if log.header.lacks("seed") else f", seed {header['seed']}"
    most = f", of at most {header['n_steps_max']}" if log.header.n_steps_max else ""
    lines = {
        "recording": f"{log.path}, {summary['n_bytes']:,} bytes, {summary['format']}",
        "state": summary["damage"] or "complete",
        "scenario": f"{header['scenario']} ({header['scenario_digest'][:12]}){seed}",
        "policy": header["policy"] + (f" ({header['policy_digest'][:12]})" if header["policy_digest"] else ""),
        "origin": header.get("origin", ""),
        "fireworld": simulator_version(header["fireworld_version"], header["simulator_digest"]),
        "forked from": header["forked_from"],
        "digest": summary["digest"],
        "steps": f"{span}{most}; {summary['ending']}",
        "city": f"{log.city.name}: {summary['n_buildings']} buildings, {summary['n_brigades']} brigades,"
        f" {summary['n_civilians']} civilians",
        "map by": log.city.attribution,
    }
    if steps["n"]:
        outcome = final_outcome(log)
        lines["outcome"] = ", ".join(f"{quantity.label} {quantity.text(outcome)}" for quantity in QUANTITIES)
    lines["not recorded"] = header.get("not_recorded", "")
    at = summary["snapshots"]
    lines["snapshots"] = f"{len(at)}, at step {', '.join(map(str, at))}" if at else "none"
    lines["attachments"] = ", ".join(f"{name} ({n} bytes)" for name, n in summary["attachments"].items()) or "none"
    for label, text in lines.items():
        if text:
            click.echo(f"{label:<12} {one_line(text)}")
    click.echo(f"\n{'topic':<14} {'messages':>9} {'bytes':>13}")
    for topic, size in summary["topics"].items():
        click.echo(f"{one_line(topic):<14} {size['n_messages']:>9} {size['n_bytes']:>13,}")
