"""`fireworld conformance`: check the engine against traces of another fire simulator."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

if TYPE_CHECKING:
    from fireworld.conformance.check import FirstDifference, Pair, Report, Tally

_HEADINGS: Final = {
    "fieryness": "codes",
    "energy": "energy",
    "temperature": "temperature",
    "fuel": "fuel",
    "water": "water",
    "ever_watered": "watered",
    "air": "air",
    "requests": "requests",
    "tank": "tanks",
}
_PLAIN_WIDTH: Final = 200
"""Columns of the table where no terminal says how many there are."""


@click.command()
@click.argument("city", metavar="CITY.json", type=click.Path(path_type=Path))
@click.argument("traces", metavar="TRACE.npz...", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Write JSON.")
@click.pass_context
def command(context: click.Context, *, city: Path, traces: tuple[Path, ...], as_json: bool) -> None:
    """Run the engine on the inputs of each TRACE and compare everything that the trace has with the result.

    A trace passes if no fieryness code, fuel, water, request or tank differs at any step, energies, temperatures and
    air agree within 1e-9 relative, and fireworld derives the same tables from CITY. Else the first difference is
    shown. docs/traces.md describes both files.

    Exit code: 0 all pass, 1 one fails, 2 one could not be run.
    """
    from fireworld.cli.compiling import announce_compilation

    announce_compilation()
    from fireworld.conformance.check import check
    from fireworld.conformance.city_file import load_city_file
    from fireworld.errors import FireworldError

    city_file = load_city_file(city)
    reports: list[Report] = []
    complaints: dict[str, str] = {}
    for path in traces:
        try:
            reports.append(check(city_file, path))
        except FireworldError as error:
            complaints[str(path)] = str(error)
    if as_json:
        click.echo(json.dumps(_plain(str(city), reports, complaints), indent=2))
    elif reports:
        _show(reports)
    for message in complaints.values():
        click.echo(f"fireworld: {message}", err=True)
    passed = all(report.passed for report in reports)
    context.exit(2 if complaints else 0 if passed else 1)


def _show(reports: list[Report]) -> None:
    """Write a table of all traces, then what there is to say about single ones."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    shown = {name: heading for name, heading in _HEADINGS.items() if any(name in each.tallies for each in reports)}
    table = Table(box=box.SIMPLE, show_edge=False, pad_edge=False)
    table.add_column("trace", overflow="fold")
    for heading in ("steps", "buildings", *shown.values(), "tables"):
        table.add_column(heading, justify="right")
    table.add_column("")
    for report in reports:
        tallies = [report.tallies.get(name) for name in shown]
        verdict = "PASS" if report.passed else "FAIL"
        counts = (str(report.n_steps), str(report.n_buildings))
        table.add_row(report.trace, *counts, *map(_cell, tallies), str(len(report.tables)), verdict)
    console = Console(highlight=False, markup=False)
    console.width = console.width if console.is_terminal else max(console.width, _PLAIN_WIDTH)
    console.print(table)
    click.echo("\ncounts of values that differ; energy, temperature and air: the largest relative difference")
    for report in reports:
        for sentence in _remarks(report):
            click.echo(f"{report.trace}: {sentence}")


def _cell(tally: Tally | None) -> str:
    """Write how one output compares."""
    if tally is None:
        return "-"
    return str(tally.n_differing) if tally.largest is None else f"{tally.largest:.1e}"


def _remarks(report: Report) -> list[str]:
    """Say in sentences what a row of the table cannot."""
    remarks = list(report.notes)
    remarks += [f"FAIL: derived otherwise: {difference.sentence}" for difference in report.tables]
    if report.first_difference is not None:
        remarks.append(f"FAIL: first difference: {report.first_difference.sentence}")
    return remarks


def _plain(city: str, reports: list[Report], complaints: dict[str, str]) -> dict[str, Any]:
    """Turn the reports into what JSON can hold."""
    return {
        "city": city,
        "pass": not complaints and all(report.passed for report in reports),
        "traces": [_plain_report(report) for report in reports],
        "not_run": complaints,
    }


def _plain_report(report: Report) -> dict[str, Any]:
    """Turn one report into what JSON can hold."""
    return {
        "trace": report.trace,
        "pass": report.passed,
        "n_steps": report.n_steps,
        "n_buildings": report.n_buildings,
        "outputs": {
            name: {"n_compared": tally.n_compared, "n_differing": tally.n_differing}
            | ({"largest_relative_difference": _finite(tally.largest)} if tally.largest is not None else {})
            for name, tally in report.tallies.items()
        },
        "tables": {
            each.table: {"n_entries": each.n_entries, "n_differing": each.n_differing, "difference": each.sentence}
            for each in report.tables
        },
        "first_difference": _plain_difference(report.first_difference),
        "notes": list(report.notes),
    }


def _plain_difference(first: FirstDifference | None) -> dict[str, Any] | None:
    """Turn the first difference into what JSON can hold."""
    if first is None:
        return None
    return {
        "step": first.step,
        "entity": first.entity,
        "output": first.output,
        "values": _plain_pair(first.values),
        "code": _plain_pair(first.code),
        "energy": _plain_pair(first.energy),
    }


def _plain_pair(pair: Pair | None) -> dict[str, float | None] | None:
    """Name both sides."""
    return None if pair is None else {"fireworld": _finite(pair.ours), "trace": _finite(pair.theirs)}


def _finite(number: float | None) -> float | None:
    """Return a number, null for one that JSON does not have."""
    return number if number is not None and math.isfinite(number) else None
