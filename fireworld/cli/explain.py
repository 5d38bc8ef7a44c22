"""`fireworld explain`: find the decisions that make the difference between two recordings."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Final

import click

from fireworld.cli import INTERRUPTED
from fireworld.cli.opening import open_to_replay
from fireworld.cli.options import executor_of, on_option
from fireworld.cli.progress import BAR, ELAPSED, bar
from fireworld.cli.tables import print_table

BUDGET: Final = 200
SHOWN_MAX: Final = 20
REPLAYS: Final = "replay {task.completed:.0f} of at most {task.total:.0f}"


@click.command()
@click.argument("first", metavar="A", type=click.Path(path_type=Path))
@click.argument("second", metavar="B", type=click.Path(path_type=Path))
@click.option(
    "--budget", default=BUDGET, show_default=True, metavar="N", type=click.IntRange(min=2), help="Replays at most."
)
@click.option(
    "--limit",
    default=SHOWN_MAX,
    show_default=True,
    metavar="N",
    type=click.IntRange(min=1),
    help="List N spans at most.",
)
@click.option("--jobs", metavar="N", type=click.IntRange(1, 1000), help="Replays at a time.  [default: 2]")
@on_option
@click.option("--json", "as_json", is_flag=True, help="Write JSON, with all spans.")
@click.pass_context
def command(
    context: click.Context,
    *,
    first: Path,
    second: Path,
    budget: int,
    limit: int,
    jobs: int | None,
    on: str | None,
    as_json: bool,
) -> None:
    """Find out which decisions make up how much of the difference between the scores of recordings A and B.

    \b
    fireworld explain a.mcap b.mcap
    fireworld explain a.mcap b.mcap --budget 1000 --json

    A and B are runs of one scenario and seed. The run with the lower score is replayed, each time with one span of the
    other's decisions in it: steps in which one brigade took one action there and others here. After the span the
    brigades' own policy continues, in a world that is another by then. Then all spans are tried at once, then all but
    one, and those that explain most are narrowed down to the part that matters. The earliest spans come first where
    the budget does not suffice for all.

    If the policy cannot be loaded again, the recorded decisions continue instead; the answer names which.

    Exit code: 0 explained, or the scores are equal; 2 could not explain (another scenario or seed, a run that has not
    ended, a recording that does not replay); 130 interrupted (what is known so far is shown).
    """
    runs = [open_to_replay(path) for path in (first, second)]
    from fireworld.recording.explain import explain
    from fireworld.recording.explanation.text import HEADS, closing_lines, opening_lines, rows

    with bar("explain", budget, REPLAYS, BAR, ELAPSED) as advance:
        explanation = explain(*runs, budget=budget, executor=executor_of(on, jobs), on_replay=advance)
    if as_json:
        click.echo(json.dumps(explanation.to_dict(), indent=2))
    else:
        click.echo("\n".join(opening_lines(explanation)))
        listed = rows(explanation, limit=limit)
        if listed:
            click.echo()
            print_table(HEADS, listed, left=(HEADS.index("decision"),))
        if explanation.n_spans:
            click.echo()
        for line in closing_lines(explanation, limit=limit):
            click.echo(line)
    if explanation.interrupted:
        click.echo(f"interrupted after {explanation.result.n_replays} replays; more may be found", err=True)
        context.exit(INTERRUPTED)
