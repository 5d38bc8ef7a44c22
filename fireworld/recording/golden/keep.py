"""What is kept of a new run that differs from its golden: the recording, and pages and a picture to look at."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from fireworld_recorder.diff import RunComparison
from fireworld_recorder.reader import open_log

from fireworld.errors import ViewError
from fireworld.files import make_folder, write_file
from fireworld.recording.difference import diff
from fireworld.recording.golden.store import is_digest, recording_path, store_recording
from fireworld.recording.pages.pictures import map_png
from fireworld.recording.pages.play import play
from fireworld.recording.pages.summary import write_first_maps, write_played
from fireworld.recording.run import Run

if TYPE_CHECKING:
    from fireworld.recording.golden.check import GoldenResult


@dataclass(frozen=True, kw_only=True)
class Kept:
    """Files of a new run or training; None for what could not be made."""

    recording: Path
    page: Path | None = None
    """It plays the golden and the new run side by side; of a digest-only golden the new run alone."""
    difference: Path | None = None
    """The page of the difference; not of a digest-only golden, of runs that begin otherwise, nor without matplotlib."""
    picture: Path | None = None
    """A map of the step where they first differ, if there is one; not without matplotlib."""

    @property
    def links(self) -> dict[str, str]:
        """The files that can be opened, by what they are."""
        named = {"page that plays": self.page, "page of the difference": self.difference, "recording": self.recording}
        return {label: str(path) for label, path in named.items() if path is not None}


def kept_paths(golden: Path, folder: Path) -> tuple[Path, Path, Path, Path]:
    """Return where recording, page that plays, page of the difference and picture of a golden go."""
    recording, name = folder / recording_path(golden).name, golden.stem
    return recording, folder / f"{name}.html", folder / f"{name}-difference.html", folder / f"{name}.png"


def keep_new(result: GoldenResult, folder: Path) -> GoldenResult:
    """Keep the new run of a result that differs in a folder, replacing what is there; return the result with it.

    Raises:
        OutputError: it cannot be written.
    """
    if result.fresh is None or not result.differs:
        return result
    make_folder(folder)
    recording, page, difference, picture = kept_paths(result.path, folder)
    store_recording(recording, result.fresh)
    kept = Kept(recording=recording)
    if isinstance(result.fresh, Run):
        kept = _with_pages(kept, result, page, difference, picture)
    return replace(result, kept=kept)


def _with_pages(kept: Kept, result: GoldenResult, page: Path, difference: Path, picture: Path) -> Kept:
    new = open_log(kept.recording)
    first = result.difference.first if isinstance(result.difference, RunComparison) else None
    if is_digest(result.path):
        kept = replace(kept, page=play(new, output=page, force=True))
        last = int(new.steps[-1])
        png = map_png(new, new.step(last if first is None or first.step is None else min(first.step, last)))
        if png is None:
            return kept
        write_file(picture, png)
        return replace(kept, picture=picture)
    runs = (open_log(result.path), new)
    if not write_played(runs, page):  # of two cities
        return replace(kept, page=play(new, output=page, force=True))
    kept = replace(kept, page=page, picture=picture if write_first_maps(runs, first, picture) else None)
    if first is None or first.step is None:  # they begin otherwise: nothing of their steps can be compared
        return kept
    try:
        diff(*runs, any_scenario=True).save_html(difference, force=True)
    except ViewError:  # no matplotlib
        return kept
    return replace(kept, difference=difference)
