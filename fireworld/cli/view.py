"""`fireworld view`: open recordings in Rerun, or save them for it."""

from __future__ import annotations

from pathlib import Path

import click

from fireworld.cli.compiling import announce_compilation
from fireworld.cli.opening import open_one_or_two, open_trainings


def _building_ids(context: click.Context, parameter: click.Parameter, value: str | None) -> tuple[int, ...]:
    """Turn "369,42" into (369, 42), each id once."""
    if value is None:
        return ()
    try:
        return tuple(dict.fromkeys(int(part) for part in value.split(",")))
    except ValueError:
        raise click.BadParameter(f"expected building ids like 369,42, got {value!r}", context, parameter) from None


@click.command()
@click.argument("logs", metavar="LOG...", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--save", "output", metavar="F.rrd", type=click.Path(path_type=Path), help="Write a Rerun file instead.")
@click.option("--force", is_flag=True, help="Replace an existing file.")
@click.option("--web", is_flag=True, help="Serve the view to browsers on this machine.")
@click.option("--port", type=click.IntRange(1, 65535), help="Port of the page that --web serves.  [default: 9090]")
@click.option(
    "--focus",
    callback=_building_ids,
    metavar="IDS",
    help="Plot these buildings' temperatures.  [default: those that burn first]",
)
@click.option("--from", "first", type=click.IntRange(min=0), metavar="N", help="First step to show.")
@click.option("--to", "last", type=click.IntRange(min=0), metavar="N", help="Last step to show.")
@click.option("--every", type=click.IntRange(min=1), default=1, metavar="N", help="Show every N-th step.")
@click.option("--air", is_flag=True, help="Show the air of every step: it is computed by replaying the run.")
def command(
    *,
    logs: tuple[Path, ...],
    output: Path | None,
    force: bool,
    web: bool,
    port: int | None,
    focus: tuple[int, ...],
    first: int | None,
    last: int | None,
    every: int,
    air: bool,
) -> None:
    """Open one recording in Rerun, or two of the same city side by side.

    Shows the city and its fire, what the brigades do and why, curves, the outcome; of two recordings also where they
    first differ and which buildings then do. A recording that was cut off or damaged is shown as far as it is good.

    Of a training log, or two, it shows curves over the episodes, where scenarios end with the command that opens the
    episode, and the tables as a picture: the greedy action of each brigade in the states that matter.

    \b
    fireworld view out.mcap                        a window
    fireworld view golden.mcap out.mcap            two runs, one time cursor
    fireworld view out.mcap --focus 369,42         with the temperatures of two buildings
    fireworld view out.mcap --save out.rrd         no screen here: a file, for `rerun out.rrd`
    fireworld view long.mcap --from 100 --every 5  part of a long run
    fireworld view out.mcap --air                  the heat of the air at every step, not at every 50th

    Exit code: 0 shown or saved, 2 could not (no display, no Rerun, not a recording, two cities).
    """
    if web and output is not None:
        raise click.UsageError("--save and --web exclude each other.")
    if port is not None and not web:
        raise click.UsageError("--port goes with --web.")
    if force and output is None:
        raise click.UsageError("--force goes with --save.")
    trainings = open_trainings(logs, doing="showing")
    if trainings:
        if focus or first is not None or last is not None or every != 1 or air:
            raise click.UsageError("--focus, --from, --to, --every and --air go with runs, not with trainings.")
        from fireworld.training.log.pages.view import view_trainings

        view_trainings(trainings, save=output, force=force, web=web, port=port, announce=_announce)
        _say_written(output)
        return
    runs = open_one_or_two(logs, doing="showing")
    if air:
        from fireworld.recording.inputs import check_replayable

        for run in runs:
            check_replayable(run)
        announce_compilation()
    from fireworld.recording.pages.view import view

    view(
        runs,
        save=output,
        force=force,
        web=web,
        port=port,
        announce=_announce,
        focus=focus,
        first_step=first,
        last_step=last,
        every=every,
        air=air,
    )
    _say_written(output)


def _announce(address: str) -> None:
    click.echo(f"Open {address} in a browser; Ctrl-C ends it.")


def _say_written(output: Path | None) -> None:
    if output is not None:
        click.echo(f"wrote {output}; open it with `rerun {output}`")
