"""`fireworld verify`: replay a recording and compare every step."""

from __future__ import annotations

import json
from pathlib import Path

import click


@click.command()
@click.argument("log", metavar="LOG", type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Write JSON.")
@click.pass_context
def command(context: click.Context, *, log: Path, as_json: bool) -> None:
    """Run the scenario, seed and decisions of LOG again and compare every step.

    Needs nothing but the recording. Names the first step, entity and field that this fireworld computes differently.

    Exit code: 0 the same, 1 different, 2 could not replay.
    """
    from fireworld.recording.verify import verify

    verified = verify(log)
    if as_json:
        click.echo(json.dumps(verified.to_dict(), indent=None if verified else 2))
    elif verified.difference is None:
        click.echo(repr(verified))
    else:
        from fireworld.cli.diff import show_difference

        show_difference(verified.difference, names=(str(log), "replay"))
    context.exit(0 if verified else 1)
