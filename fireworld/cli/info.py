"""`fireworld info`: say what a recording holds and how far it is good."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from recorder.reader import Log


@click.command()
@click.argument("log", metavar="LOG", type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Write JSON.")
@click.option("--schema", is_flag=True, help="Write the messages of the log format as a .proto file instead.")
@click.pass_context
def command(context: click.Context, *, log: Path, as_json: bool, schema: bool) -> None:
    """Say what LOG recorded, what it holds and how far it is good.

    Exit code: 0 good, 1 cut off or damaged but good up to a step, 2 not readable.
    """
    from recorder.reader import open_log
    from recorder.schema import PROTO

    recording = open_log(log, partial=True)
    if schema:
        click.echo(PROTO.read_text(encoding="utf-8"), nl=False)
    elif as_json:
        click.echo(json.dumps(_summary(recording), indent=2))
    else:
        _show(recording)
    context.exit(0 if recording.damage is None else 1)


def _summary(log: Log) -> dict[str, Any]:
    """Collect what there is to say."""
    from fireworld.records import FORMAT
    from recorder.header import to_metadata
    from recorder.plain import plain
    from recorder.totals import totals_of

    steps = log.steps
    metadata = to_metadata(log.header).items()
    return {
        "path": str(log.path),
        "format": FORMAT,
        "state": log.state,
        "damage": log.damage,
        "digest": log.digest,
        "header": {key: value for key, value in metadata if ":" not in key and key not in {"format", "checksum"}},
        "steps": {"n": len(log), "first": int(steps[0]), "last": int(steps[-1])} if len(log) else {"n": 0},
        "ending": _ending(log),
        "totals": plain(totals_of(log)),
        "n_buildings": len(log.city.building_id),
        "n_brigades": len(log.city.brigade_tank_litres),
        "n_civilians": len(log.city.civilian_hp),
        "snapshots": log.snapshots,
        "attachments": {name: len(data) for name, data in log.header.attachments.items()},
        "n_bytes": log.found.n_bytes,
        "topics": plain(log.topics),
    }


def _ending(log: Log) -> str:
    """Say how the run ended."""
    if not len(log):
        return "no step"
    last = log.step(int(log.steps[-1]))
    if last.terminated:
        return "terminated: nothing burned any more"
    return "truncated: the last step of the scenario" if last.truncated else "stopped before its end"


def _show(log: Log) -> None:
    summary = _summary(log)
    header, totals, steps = summary["header"], summary["totals"], summary["steps"]
    span = f"{steps['n']}, from {steps['first']} to {steps['last']}" if steps["n"] else "none"
    lines = {
        "recording": f"{log.path}, {summary['n_bytes']:,} bytes, {summary['format']}",
        "state": summary["damage"] or "complete",
        "scenario": f"{header['scenario']} ({header['scenario_digest'][:12]}), seed {header['seed']}",
        "policy": f"{header['policy']} ({header['policy_digest'][:12]})",
        "fireworld": header["fireworld_version"],
        "forked from": header["forked_from"],
        "digest": summary["digest"],
        "steps": f"{span}, of at most {header['n_steps_max']}; {summary['ending']}",
        "city": f"{log.city.name}: {summary['n_buildings']} buildings, {summary['n_brigades']} brigades,"
        f" {summary['n_civilians']} civilians",
    }
    if steps["n"]:
        lines["outcome"] = (
            f"score {totals['score']:.6g} of {totals['score_max']:g}, {totals['n_burnt_out']} burnt out,"
            f" {totals['n_civilians_alive']} civilians alive, return {totals['sum_of_rewards']:.6g},"
            f" {totals['water_used_litres']:g} litres used"
        )
    lines["snapshots"] = ", ".join(map(str, summary["snapshots"])) or "none"
    lines["attachments"] = ", ".join(f"{name} ({n} bytes)" for name, n in summary["attachments"].items()) or "none"
    for label, text in lines.items():
        if text:
            click.echo(f"{label:<12} {text}")
    click.echo(f"\n{'topic':<14} {'messages':>9} {'bytes':>13}")
    for topic, size in summary["topics"].items():
        click.echo(f"{topic:<14} {size['n_messages']:>9} {size['n_bytes']:>13,}")
