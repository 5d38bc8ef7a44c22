"""`fireworld report`: a recording, or two, as one HTML page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from fireworld.cli.opening import open_committed

if TYPE_CHECKING:
    from fireworld_recorder.reader import Log

_MAPS: Final = 4
"""Maps in the strip."""


@click.command()
@click.argument("logs", metavar="LOG [LOG_B]", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("-o", "--output", metavar="FILE.html", required=True, type=click.Path(path_type=Path), help="The page.")
@click.option("--force", is_flag=True, help="Replace an existing file.")
def command(*, logs: tuple[Path, ...], output: Path, force: bool) -> None:
    """Write LOG, a recording, or two of one city, as an HTML page that needs no other file.

    \b
    fireworld report run.mcap -o report.html
    fireworld report alone.mcap together.mcap -o report.html

    The page has the outcome, maps, curves, what each brigade chose and did, the events of note and how to get the same
    run again. The same recording gives the same page, to the byte. A recording that was cut off or damaged is told of
    as far as it is good.

    Exit code: 0 written, 2 could not write, 130 interrupted (nothing is left of it).
    """
    if len(logs) > 2:
        raise click.UsageError(f"Expected one or two recordings, got {len(logs)}.")
    from fireworld.files import check_output, write_file
    from fireworld.recording.pages.run_page import run_page

    check_output(output, endings=(".html", ".htm"), force=force)
    recordings = [open_committed(path, doing="telling of") for path in logs]
    images = _draw_all(recordings)
    write_file(output, run_page(recordings, images).encode())
    click.echo(f"wrote {output}; open it in a browser")


def _draw_all(recordings: Sequence[Log]) -> Mapping[str, bytes]:
    """Draw the pictures of the page, PNG files by name.

    Raises:
        ViewError: matplotlib is not installed, a recording has no steps, or the cities differ.
    """
    from fireworld_viewer.pictures.curves import draw_curves
    from fireworld_viewer.pictures.decision_timeline import draw_timeline
    from fireworld_viewer.pictures.figure_files import plain_style, png_bytes
    from fireworld_viewer.pictures.maps import draw_steps
    from fireworld_viewer.story.steps import evenly_spaced

    with plain_style():
        return {
            "maps": png_bytes(draw_steps(recordings, evenly_spaced(recordings, _MAPS))),
            "curves": png_bytes(draw_curves(recordings)),
            "timeline": png_bytes(draw_timeline(recordings)),
        }
