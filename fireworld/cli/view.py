"""`fireworld view`: open recordings in Rerun, or save them for it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fireworld.cli.opening import open_committed

if TYPE_CHECKING:
    from fireworld_viewer.rerun_view.outcome_page import OutcomePage

    from fireworld.records import MemoryRecording, Recording


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
@click.option("--air", is_flag=True, help="Show the air of every step: it is worked out by replaying the run.")
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

    \b
    fireworld view out.mcap                        a window
    fireworld view golden.mcap out.mcap            two runs, one time cursor
    fireworld view out.mcap --focus 369,42         with the temperatures of two buildings
    fireworld view out.mcap --save out.rrd         no screen here: a file, for `rerun out.rrd`
    fireworld view long.mcap --from 100 --every 5  part of a long run
    fireworld view out.mcap --air                  the heat of the air at every step, not at every 50th

    Exit code: 0 shown or saved, 2 could not (no display, no Rerun, not a recording, two cities).
    """
    if len(logs) > 2:
        raise click.UsageError(f"Expected one or two recordings, got {len(logs)}.")
    if web and output is not None:
        raise click.UsageError("--save and --web exclude each other.")
    if port is not None and not web:
        raise click.UsageError("--port goes with --web.")
    if force and output is None:
        raise click.UsageError("--force goes with --save.")
    from fireworld_viewer.rerun_view import app
    from fireworld_viewer.story.steps import select_steps

    held = [open_committed(path, doing="showing") for path in logs]
    read = [_with_air(recording, path) if air else recording for recording, path in zip(held, logs, strict=True)]
    recordings = [select_steps(recording, first=first, last=last, every=every) for recording in read]
    outcome = _outcome(logs, recordings)
    if output is not None:
        app.save(recordings, output, focus=focus, outcome=outcome, force=force)
        click.echo(f"wrote {output}; open it with `rerun {output}`")
    elif web:
        app.serve(recordings, focus=focus, outcome=outcome, port=port or app.WEB_PORT, announce=_announce)
    else:
        app.show(recordings, focus=focus, outcome=outcome)


def _with_air(recording: Recording, path: Path) -> MemoryRecording:
    """Replay a run to know the air of every step.

    Raises:
        LogError: this fireworld computes something else than what is recorded.
    """
    from fireworld.cli.compiling import announce_compilation
    from fireworld.cli.replays import check_replay
    from fireworld.recording.replay import Replay
    from fireworld.records import MemoryRecording

    announce_compilation()
    again = Replay(recording, with_air=True)
    replayed = MemoryRecording(recording.header, again.city, list(again))
    check_replay(recording, replayed, source=str(path), hint="try without --air")
    return replayed


def _outcome(logs: Sequence[Path], recordings: Sequence[Recording]) -> OutcomePage:
    """Work out what the runs came to, and where two first differ, in the steps that are shown."""
    from fireworld_recorder.diff import Difference, compare
    from fireworld_recorder.totals import totals_of
    from fireworld_viewer.rerun_view.outcome_page import OutcomePage
    from fireworld_viewer.story.two_runs import check_same_city

    from fireworld.cli.difference_text import totals_rows

    heads = [path.name for path in logs]
    if len(recordings) == 1:
        totals = totals_of(recordings[0])
        alone = Difference(None, (totals, totals), {}, totals.n_steps, {})
        return OutcomePage(heads=heads, rows=[(label, value) for label, value, _ in totals_rows(alone)])
    first_run, second_run = recordings
    check_same_city(first_run.city, second_run.city)
    difference = compare(first_run, second_run)
    rows, first = list(totals_rows(difference)), difference.first
    if first is None:
        return OutcomePage(heads=heads, rows=rows)
    step = int(first_run.steps[0]) if first.step is None else first.step
    return OutcomePage(heads=heads, rows=rows, first_step=step, first_sentence=first.sentence)


def _announce(address: str) -> None:
    click.echo(f"Open {address} in a browser; Ctrl-C ends it.")
