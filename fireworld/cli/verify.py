"""`fireworld verify`: replay a recording and compare every step."""

from __future__ import annotations

import json
from pathlib import Path
from typing import NoReturn

import click

from fireworld.cli.compiling import announce_compilation
from fireworld.cli.progress import bar
from fireworld.cli.tables import print_blocks


@click.command()
@click.argument("log", metavar="LOG", type=click.Path(path_type=Path))
@click.option("--team", type=click.Path(path_type=Path), help="The team file that came of a training; compared too.")
@click.option("--json", "as_json", is_flag=True, help="Write JSON.")
@click.pass_context
def command(context: click.Context, *, log: Path, team: Path | None, as_json: bool) -> None:
    """Run the scenario, seed and decisions of LOG again and compare every step.

    Needs nothing but the recording. Names the first step, entity and field that this fireworld computes differently.
    A training log is learned again from its first episode to its last; the first episode, step, brigade and state that
    come out otherwise are named.

    Exit code: 0 the same, 1 different, 2 could not replay.
    """
    from fireworld.recording.inputs import is_training
    from fireworld.recording.verify import verify

    if is_training(log):
        _verify_training(context, log, team, as_json=as_json)
    if team is not None:
        raise click.UsageError("--team goes with a training log.")
    verified = verify(log)
    if as_json:
        click.echo(json.dumps(verified.to_dict(), indent=None if verified else 2))
    elif verified.difference is None:
        click.echo(repr(verified))
    else:
        from fireworld.cli.diff import show_difference

        show_difference(verified.difference, names=(str(log), "replay"))
    context.exit(0 if verified else 1)


def _verify_training(context: click.Context, log: Path, team: Path | None, *, as_json: bool) -> NoReturn:
    """Verify a training log."""
    announce_compilation()
    from fireworld.training.log.reader import open_training
    from fireworld.training.log.verify import verify_training

    opened = open_training(log)
    with bar("verify", len(opened), quiet=as_json) as advance:
        verified = verify_training(opened, team=team, on_part=advance)
    if as_json:
        click.echo(json.dumps(verified.to_dict(), indent=None if verified else 2))
    elif verified.difference is None:
        click.echo(repr(verified))
    else:
        print_blocks(verified.difference.describe())
    context.exit(0 if verified else 1)
