"""`fireworld diff`: compare two recordings step by step."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

if TYPE_CHECKING:
    from recorder.diff import Difference

DIGEST_SHOWN: Final = 12
_TOTALS = {
    "n_steps": "steps",
    "time_to_complete": "fire out at step",
    "score": "score",
    "score_max": "score, at most",
    "n_burnt_out": "burnt out",
    "n_civilians_alive": "civilians alive",
    "sum_of_rewards": "return",
    "water_used_litres": "water used, litres",
}


@click.command()
@click.argument("first", metavar="A", type=click.Path(path_type=Path))
@click.argument("second", metavar="B", type=click.Path(path_type=Path))
@click.option(
    "--tolerance",
    "tolerances",
    multiple=True,
    metavar="FIELD=X",
    help="Let a field differ by X, as in buildings.temperature=1e-6 or hp=1. May be repeated.",
)
@click.option("--json", "as_json", is_flag=True, help="Write JSON.")
@click.pass_context
def command(context: click.Context, *, first: Path, second: Path, tolerances: Sequence[str], as_json: bool) -> None:
    """Compare recording B with recording A, step by step.

    Names the first difference by step, phase, entity and field, then the totals of both. Everything is compared
    exactly, unless there is a tolerance for it.

    Exit code: 0 the same, 1 different, 2 could not compare.
    """
    from recorder.diff import compare
    from recorder.reader import open_log

    parsed = dict(_parse_tolerance(text) for text in tolerances)
    log_a, log_b = open_log(first), open_log(second)
    difference = compare(log_a, log_b, tolerances=parsed)
    if as_json:
        write_json(difference, digests=[log_a.digest, log_b.digest])
    else:
        show(difference, names=(str(first), str(second)))
    context.exit(0 if difference.same else 1)


def _parse_tolerance(text: str) -> tuple[str, float]:
    from fireworld.errors import LogError
    from recorder.match import check_field_name

    name, _, number = text.partition("=")
    try:
        check_field_name("--tolerance", name)
        tolerance = float(number)
    except LogError as error:
        raise click.UsageError(str(error)) from error
    except ValueError:
        tolerance = -1.0
    if not 0 <= tolerance < float("inf"):
        raise click.UsageError(f"--tolerance: expected FIELD=X with a number X >= 0, got {text!r}")
    return name, tolerance


def write_json(difference: Difference, *, digests: Sequence[str]) -> None:
    """Write a comparison as JSON."""
    from recorder.plain import plain

    click.echo(json.dumps({"same": difference.same, "digests": list(digests)} | plain(difference), indent=2))


def show(difference: Difference, *, names: tuple[str, str]) -> None:
    """Write a comparison for people: first difference, totals, and how many steps differ."""
    if difference.first is None:
        click.echo(f"the same: {difference.n_steps_compared} steps")
    else:
        click.echo(difference.first.sentence)
    for key, (a, b) in difference.header.items():
        click.echo(f"{key.replace('_', ' ')}: {_shortened(key, b)}, was {_shortened(key, a)}")
    rows = [
        (label, _number(getattr(difference.totals[0], key)), _number(getattr(difference.totals[1], key)))
        for key, label in _TOTALS.items()
    ]
    _print_table(("", *names), rows)
    if difference.n_steps_differing:
        counts = [(topic, str(n), "") for topic, n in difference.n_steps_differing.items()]
        _print_table(("topic", f"steps that differ, of {difference.n_steps_compared}", ""), counts)


def _shortened(key: str, value: str | int) -> str:
    """Show a value of a header; of a digest as much as tells it from others."""
    return str(value)[:DIGEST_SHOWN] if key.endswith("digest") else str(value)


def _number(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _print_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table

    table = Table(box=box.SIMPLE, show_edge=False, pad_edge=False)
    for index, name in enumerate(head):
        table.add_column(name, justify="right" if index else "left", overflow="fold")
    for row in rows:
        table.add_row(*row)
    click.echo()
    Console(highlight=False, markup=False).print(table)
