"""`fireworld diff`: compare two recordings step by step."""

from __future__ import annotations

import json
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import click

from fireworld.cli.installed import check_matplotlib
from fireworld.cli.reporting import check_reporting, print_annotations, reporting_options
from fireworld.cli.tables import print_blocks

if TYPE_CHECKING:
    from fireworld_recorder.diff import RunComparison

    from fireworld.cause import Cause
    from fireworld.recording.difference import Difference


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
@click.option(
    "--ignore",
    multiple=True,
    metavar="NAME",
    help="Leave out a topic (draws), a field of one (brigades.damage) or of all (damage). May be repeated.",
)
@click.option("--from", "first_step", type=click.IntRange(min=0), metavar="STEP", help="First step to compare.")
@click.option("--to", "last_step", type=click.IntRange(min=0), metavar="STEP", help="Last step to compare.")
@click.option("--any-scenario", is_flag=True, help="Compare runs of two scenarios too, if their cities are the same.")
@click.option("--partial", is_flag=True, help="Compare a cut-off or damaged recording too, as far as it is good.")
@click.option("--json", "as_json", is_flag=True, help="Write JSON.")
@click.option("--junit", metavar="FILE", type=click.Path(path_type=Path), help="Write JUnit XML for a CI server.")
@click.option("--html", metavar="FILE", type=click.Path(path_type=Path), help="Write a page with maps and curves.")
@reporting_options
@click.option("--force", is_flag=True, help="Replace existing files.")
@click.pass_context
def command(
    context: click.Context,
    *,
    first: Path,
    second: Path,
    tolerances: Sequence[str],
    ignore: Sequence[str],
    first_step: int | None,
    last_step: int | None,
    any_scenario: bool,
    partial: bool,
    as_json: bool,
    junit: Path | None,
    html: Path | None,
    summary: Path | None,
    annotate: str | None,
    force: bool,
) -> None:
    """Compare recording B with recording A, step by step.

    Names the first difference by step, phase, entity and field, then how both runs came out, when each topic came to
    differ, and how the difference spread: how many buildings, brigades and civilians it had reached at which step.
    Everything is compared exactly, unless there is a tolerance for it.

    Of two training logs the first episode, step, brigade and state are named in which they differ, then how that spread
    from scenario to scenario: returns, scores, and how often the final tables prefer the same action.

    \b
    fireworld diff golden.mcap new.mcap
    fireworld diff golden.mcap new.mcap --tolerance buildings.temperature=1e-6 --ignore draws
    fireworld diff golden.mcap new.mcap --from 10 --to 20
    fireworld diff golden.mcap new.mcap --html diff.html --junit diff.xml
    fireworld diff golden.mcap new.mcap --summary diff.md --annotate github

    Exit code: 0 the same, 1 different, 2 could not compare (no file is written).
    """
    from fireworld.files import check_outputs
    from fireworld.recording.difference import diff
    from fireworld.recording.inputs import is_training

    check_reporting(annotate=annotate, as_json=as_json)
    outputs = [path for path in (junit, html, summary) if path is not None]
    if force and not outputs:
        raise click.UsageError("--force goes with --junit, --html or --summary.")
    check_outputs(outputs, force=force, inputs=(first, second))
    if html is not None:
        check_matplotlib("diff --html")
    if is_training(first) and is_training(second):
        asked = any(
            (tolerances, ignore, first_step is not None, last_step is not None, any_scenario, outputs, annotate)
        )
        _diff_trainings(context, first, second, asked=asked, partial=partial, as_json=as_json)
    difference = diff(
        first,
        second,
        tolerances=dict(map(_parse_tolerance, tolerances)),
        ignore=ignore,
        first_step=first_step,
        last_step=last_step,
        any_scenario=any_scenario,
        partial=partial,
    )
    for run, name in zip(difference.runs, difference.names, strict=True):
        if run.damage is not None:
            click.echo(f"{name}: {run.damage}; nothing is compared beyond", err=True)
    _write(difference, junit=junit, html=html, summary=summary, force=force)
    if as_json:
        click.echo(json.dumps(difference.to_dict(), indent=2))
    elif difference.known_same and not outputs:
        click.echo(str(difference))
    else:
        show_difference(difference.found, names=difference.names, cause=difference.cause)
    if annotate:
        print_annotations([difference.finding()])
    context.exit(0 if difference.same else 1)


def _write(difference: Difference, *, junit: Path | None, html: Path | None, summary: Path | None, force: bool) -> None:
    """Write the outputs that were asked for, all or none, before anything is printed: a reader may leave early."""
    from fireworld.files import written_beside

    with ExitStack() as both:
        if junit is not None:
            both.enter_context(written_beside(junit)).write_bytes(difference.junit())
        if html is not None:
            difference.save_html(html, force=force)
        if summary is not None:
            difference.save_summary(summary, force=force)
    if junit is not None:
        click.echo(f"wrote {junit}", err=True)
    if html is not None:
        click.echo(f"wrote {html}; open it in a browser", err=True)
    if summary is not None:
        click.echo(f"wrote {summary}", err=True)


def _diff_trainings(
    context: click.Context, first: Path, second: Path, *, asked: bool, partial: bool, as_json: bool
) -> NoReturn:
    """Compare two training logs; `asked`: for something that is for runs alone."""
    if asked:
        raise click.UsageError("Of two trainings --partial and --json are all there is to ask for.")
    from fireworld.training.log.difference import diff_trainings

    difference = diff_trainings(first, second, partial=partial)
    if as_json:
        click.echo(json.dumps(difference.to_dict(), indent=2))
    else:
        print_blocks(difference.describe())
    context.exit(0 if difference.same else 1)


def show_difference(found: RunComparison, *, names: tuple[str, str], cause: Cause | None = None) -> None:
    """Print what changed, the first difference, how both runs came out, and how it spread by topic and step."""
    from fireworld.cli.tables import print_lines, print_table
    from fireworld.recording import difference_text as text

    lines = [text.verdict(found)] if cause is None else text.head_lines(found, cause)
    print_lines([*lines, ""])
    print_table(("", *names), list(text.totals_rows(*found.totals)))
    topics = list(text.topic_rows(found))
    if topics:
        click.echo()
        print_table(("topic", "first at step", f"steps that differ, of {found.n_steps_compared}"), topics)
    if found.spread.rows:
        click.echo()
        print_table(text.SPREAD_HEADS, list(map(text.spread_cells, found.spread.rows)), left=(), narrow=True)
        print_lines(["", text.SPREAD_NOTE, *text.spread_sentences(found)])


def _parse_tolerance(text: str) -> tuple[str, float]:
    name, _, number = text.partition("=")
    try:
        tolerance = float(number)
    except ValueError:
        tolerance = -1.0
    if not 0 <= tolerance < float("inf"):
        raise click.UsageError(f"--tolerance: expected FIELD=X with a number X >= 0, got {text!r}")
    return name, tolerance
