"""Run the benchmarks and print them: `python -m benchmarks.bench [--quick] [--json] [--only SECTION]`."""

from __future__ import annotations

import importlib
import json
import sys
from collections.abc import Iterator
from dataclasses import asdict
from typing import Final

import click

from benchmarks.machine import describe
from benchmarks.timing import Row, duration

SECTIONS: Final = {
    "fire": "fire_rows",
    "world": "world_rows",
    "decision": "decision_rows",
    "city": "city_rows",
    "log": "log_rows",
    "view": "view_rows",
    "pictures": "render_rows",
    "training": "training_rows",
    "compare": "compare_rows",
    "envs": "envs_rows",
    "start-up": "start_rows",
}
"""Module of each section; each has `rows(*, quick) -> Iterator[Row]`."""
WIDTH: Final = 150
"""Of the table in a file."""
CAPTION: Final = (
    "Medians. The ratio is baseline / ours, the median of rounds in turn, with its quartiles; "
    "below 1 where ours does more than the baseline, and shows what that costs."
)


def times(ratio: float | None, low: float | None, high: float | None) -> str:
    """Write a ratio with its quartiles."""
    return "" if ratio is None else f"{ratio:.3g} ({low:.3g} - {high:.3g})"


def rows(sections: tuple[str, ...], *, quick: bool) -> Iterator[Row]:
    """Run the sections, one after another."""
    for section in sections:
        yield from importlib.import_module(f"benchmarks.{SECTIONS[section]}").rows(quick=quick)


def print_table(found: list[Row], machine: dict[str, str], *, caption: str = CAPTION) -> None:
    """Print a table for people."""
    from rich.console import Console
    from rich.table import Table

    console = Console(width=None if sys.stdout.isatty() else WIDTH)
    console.print(", ".join(f"{name} {value}" for name, value in machine.items()), highlight=False)
    table = Table(caption=caption)
    for name in ("", "what", "size"):
        table.add_column(name)
    for name in ("ours", "baseline", "ratio"):
        table.add_column(name, justify="right")
    group = ""
    for row in found:
        if row.group != group:
            table.add_section()
        ours = f"{row.ours} {duration(row.seconds)}"
        baseline = f"{row.baseline} {duration(row.baseline_seconds)}" if row.baseline else row.note
        ratio = times(row.ratio, row.ratio_low, row.ratio_high)
        table.add_row(row.group if row.group != group else "", row.what, row.size, ours, baseline, ratio)
        group = row.group
    console.print(table)


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--quick", is_flag=True, help="Small cities and few rounds: to see that everything runs.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON instead of a table.")
@click.option("--only", type=click.Choice(list(SECTIONS)), multiple=True, help="Run this section; may be repeated.")
def main(*, quick: bool, as_json: bool, only: tuple[str, ...]) -> None:
    """Measure fireworld. Ratios are taken within one run, ours and the baseline in turns."""
    machine = describe()
    found = []
    for row in rows(only or tuple(SECTIONS), quick=quick):
        click.echo(f"{row.group}: {row.what} {row.size}", err=True)
        found.append(row)
    if as_json:
        click.echo(json.dumps({"machine": machine, "quick": quick, "rows": [asdict(row) for row in found]}, indent=1))
    else:
        print_table(found, machine)


if __name__ == "__main__":
    main()
