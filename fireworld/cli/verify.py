"""`fireworld verify`: replay a recording and compare every step."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import click

from fireworld.cli.compiling import announce_compilation
from fireworld.cli.progress import bar
from fireworld.cli.tables import print_blocks
from fireworld.errors import one_line

if TYPE_CHECKING:
    from fireworld.verified import Verified


@click.command()
@click.argument("log", metavar="LOG", type=click.Path(path_type=Path))
@click.option("--team", type=click.Path(path_type=Path), help="The team file that came of a training; compared too.")
@click.option(
    "--trust", metavar="DIGEST", help="The digest it should have, or 12 digits of it, from where you trust it."
)
@click.option("--json", "as_json", is_flag=True, help="Write JSON.")
@click.pass_context
def command(context: click.Context, *, log: Path, team: Path | None, trust: str | None, as_json: bool) -> None:
    """Run the scenario, seed and decisions of LOG again and compare every step.

    Needs nothing but the recording. Names the first step, entity and field that this fireworld computes differently.
    A training log is learned again from its first episode to its last; the first episode, step, brigade and state that
    come out otherwise are named.

    That the recording is as it was when you last saw it, and not made anew with all its hashes, only its digest
    shows: keep it elsewhere, and give it with --trust.

    Exit code: 0 the same, 1 different, or not the recording you trust, 2 could not replay.
    """
    from fireworld.recording.inputs import is_training
    from fireworld.recording.verify import verify

    if is_training(log):
        _verify_training(context, log, team, trust, as_json=as_json)
    if team is not None:
        raise click.UsageError("--team goes with a training log.")
    verified = verify(log, trust=trust)
    if as_json:
        click.echo(json.dumps(verified.to_dict(), indent=None if verified else 2))
    elif verified.difference is None:
        click.echo(repr(verified))
    else:
        from fireworld.cli.diff import show_difference

        show_difference(verified.difference, names=(str(log), "replay"))
    if not as_json:
        _show_notes(verified)
    context.exit(0 if verified else 1)


def _show_notes(verified: Verified) -> None:
    for line in verified.notes:
        click.echo(one_line(line))


def _verify_training(
    context: click.Context, log: Path, team: Path | None, trust: str | None, *, as_json: bool
) -> NoReturn:
    """Verify a training log."""
    announce_compilation()
    from fireworld.training.log.reader import open_training
    from fireworld.training.log.verify import verify_training

    opened = open_training(log)
    with bar("verify", len(opened), quiet=as_json) as advance:
        verified = verify_training(opened, team=team, trust=trust, on_part=advance)
    if as_json:
        click.echo(json.dumps(verified.to_dict(), indent=None if verified else 2))
    elif verified.difference is None:
        click.echo(repr(verified))
    else:
        print_blocks(verified.difference.describe())
    if not as_json:
        _show_notes(verified)
    context.exit(0 if verified else 1)
