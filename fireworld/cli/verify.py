"""`fireworld verify`: replay a recording and compare every step."""

from __future__ import annotations

from pathlib import Path

import click


@click.command()
@click.argument("log", metavar="LOG", type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Write JSON.")
@click.pass_context
def command(context: click.Context, *, log: Path, as_json: bool) -> None:
    """Run the scenario, seed and decisions of LOG again and compare every step.

    Needs nothing but the recording. Names the first step, entity and field that this fireworld computes otherwise.

    Exit code: 0 the same, 1 different, 2 could not replay.
    """
    import json

    from fireworld_recorder.diff import compare
    from fireworld_recorder.reader import open_log

    from fireworld.cli.diff import show, write_json
    from fireworld.recording.replay import Replay

    recording = open_log(log)
    difference = compare(recording, Replay(recording))
    if not difference.same:
        if as_json:
            write_json(difference, digests=[recording.digest])
        else:
            show(difference, names=(str(log), "replay"))
        context.exit(1)
    if as_json:
        click.echo(json.dumps({"same": True, "digests": [recording.digest], "n_steps_compared": len(recording)}))
    else:
        click.echo(f"{log}: the replay is the same, {len(recording)} steps, digest {recording.digest}")
