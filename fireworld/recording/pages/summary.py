"""A difference as Markdown with files beside it: a page that plays both runs, and maps of where they first differ."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from fireworld.errors import ViewError
from fireworld.files import check_output, make_folder, write_file
from fireworld.markdown import files_beside, markdown_page
from fireworld.recording.pages.pictures import render_picture
from fireworld.recording.pages.play import play
from fireworld.records import StoredRun

if TYPE_CHECKING:
    from fireworld_recorder.diff import FirstDifference

    from fireworld.recording.difference import Difference


def save_summary(difference: Difference, path: Path, *, force: bool) -> None:
    """Write the Markdown of a difference, and the files that it shows; errors as `Difference.save_summary`."""
    page, picture = (files_beside(path) / name for name in ("play.html", "first.png"))
    for output in (path, page, picture):
        check_output_if_there(output, force=force)
    links, shown = {}, ""
    if not difference.same:
        make_folder(page.parent)
        if write_played(difference.runs, page):
            links["page that plays"] = str(page)
        shown = str(picture) if write_first_maps(difference.runs, difference.first, picture) else ""
    finding = difference.finding(links=links, picture=shown)
    write_file(path, markdown_page("diff", [finding], beside=path.parent))


def write_played(runs: Sequence[StoredRun], page: Path) -> bool:
    """Write the page that plays two runs, replacing what is there; return whether it can be made."""
    try:
        play(*runs, output=page, force=True)
    except ViewError:  # of two cities, or a run without steps
        return False
    return True


def write_first_maps(runs: Sequence[StoredRun], first: FirstDifference | None, picture: Path) -> bool:
    """Draw two runs at the step where they first differ, replacing what is there; return whether it can be drawn."""
    if first is None or first.step is None:
        return False
    try:
        render_picture(runs, picture, steps=(first.step,), force=True)
    except ViewError:  # no matplotlib, or one of them has no such step
        return False
    return True


def check_output_if_there(path: Path, *, force: bool) -> None:
    """Check that a file can be written, in a folder that may be missing yet."""
    if path.parent.is_dir():
        check_output(path, force=force)
