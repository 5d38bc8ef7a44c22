"""`fireworld fork`: branch off from a step of a recording with another decision or policy."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path

import click

from fireworld.cli import INTERRUPTED
from fireworld.cli.opening import open_to_replay
from fireworld.cli.options import record_options


@click.command()
@click.argument("log", metavar="LOG", type=click.Path(path_type=Path))
@click.option("--at", required=True, metavar="STEP", type=click.IntRange(min=0), help="Branch off after this step.")
@click.option(
    "--policy",
    metavar="POLICY",
    help="The policy that takes over: one as for `fireworld run`, which starts afresh here, or `recorded`: the "
    "decisions recorded in LOG, whatever happens.  [default: LOG's policy, which remembers what it saw]",
)
@click.option(
    "--decide",
    "decided",
    metavar="BRIGADE=ACTION",
    multiple=True,
    help="What a brigade does in step STEP+1, unasked: one of the four actions, or own-target:BUILDING, a burning "
    "building that it may name; repeatable.",
)
@click.option(
    "--swap",
    "swapped",
    metavar="OTHER:BRIGADE",
    multiple=True,
    help="From step STEP+1 on that brigade does what it did in the recording OTHER, of the same scenario and seed; "
    "repeatable.",
)
@record_options
@click.option("--json", "as_json", is_flag=True, help="Write the outcome as JSON.")
@click.pass_context
def command(
    context: click.Context,
    *,
    log: Path,
    at: int,
    policy: str | None,
    decided: tuple[str, ...],
    swapped: tuple[str, ...],
    output: Path | None,
    force: bool,
    as_json: bool,
) -> None:
    """Branch off from the recorded run LOG after STEP, with something changed, and show how it ends then.

    \b
    fireworld fork a.mcap --at 14 --decide 2=nearest-to-me --record b.mcap
    fireworld fork a.mcap --at 14 --decide 2=own-target:301 --record b.mcap
    fireworld fork a.mcap --at 14 --policy planner --record b.mcap
    fireworld fork a.mcap --at 14 --swap other.mcap:2 --record b.mcap
    fireworld diff a.mcap b.mcap

    The steps up to STEP are copied, and those from the last snapshot before it are computed again and compared. What
    comes after is decided anew: once a decision is another, so is the world, and what is recorded no longer answers
    it. So the policy is asked; the random draws stay the same. If nothing is changed the fork is the same as LOG, to
    the bit.

    A swapped brigade that may choose where it had no choice in OTHER (it refilled there, or OTHER has ended) repeats
    what it last did there.

    Exit code: 0 forked, 2 could not fork (among others: LOG does not replay to what is recorded), 130 interrupted (the
    recording keeps every step done).
    """
    if force and output is None:
        raise click.UsageError("--force goes with --record.")
    recorded = open_to_replay(log)
    from fireworld.cli.run import play_and_watch
    from fireworld.recording.fork import prepare_fork

    run = prepare_fork(
        recorded,
        at=at,
        policy=policy,
        decide=_by_brigade(
            "--decide", "BRIGADE=ACTION as in 2=nearest-to-me", decided, lambda text: text.partition("=")[::2]
        ),
        swap=_by_brigade(
            "--swap", "OTHER:BRIGADE as in other.mcap:2", swapped, lambda text: text.rpartition(":")[::-2]
        ),
    )
    if run.note:
        click.echo(run.note, err=True)
    found = play_and_watch(run, output=output, force=force, quiet=as_json)
    if as_json:
        known = {"forked_from": run.header.forked_from, "score_of_original": run.score_of_original}
        click.echo(json.dumps(found.as_json() | known, indent=2))
    else:
        found.show()
        original, _, _ = run.header.forked_from.partition(":")
        ended = f", which ended with the score {run.score_of_original:.3f}"
        same = "; the same run" if found.digest == original else ended
        click.echo(f"forked after step {at} from {log}{same}")
    context.exit(INTERRUPTED if found.interrupted else 0)


def _by_brigade(
    option: str, form: str, texts: Sequence[str], split: Callable[[str], tuple[str, ...]]
) -> dict[int, str]:
    """Return what is given for each brigade; `split` returns its number and that."""
    given: dict[int, str] = {}
    for text in texts:
        number, value = split(text)
        if not (number.isascii() and number.isdecimal() and value):
            raise click.UsageError(f"{option}: expected {form}, got {text!r}")
        if int(number) in given:
            raise click.UsageError(f"{option}: expected one for brigade {int(number)}, got two")
        given[int(number)] = value
    return given
