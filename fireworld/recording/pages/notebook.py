"""What a notebook shows of runs: the page that plays, or Rerun's widget."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from fireworld_viewer.play.page import frame

from fireworld.arguments import ArgumentError
from fireworld.errors import expected
from fireworld.files import write_file
from fireworld.recording.difference import Difference
from fireworld.recording.pages.difference_page import played_difference
from fireworld.recording.pages.play import page_of
from fireworld.records import StoredRun

PLAY: Final = "play"
RERUN: Final = "rerun"


@dataclass(frozen=True)
class PlayedPage:
    """A page that plays a run, or two: notebooks show it in a frame, `save` writes it."""

    title: str
    html: str

    def save(self, path: str | Path) -> Path:
        """Write it as an HTML file that needs no other, replacing what is there.

        Raises:
            OutputError: it cannot be written.
        """
        write_file(Path(path), self.html)
        return Path(path)

    def _repr_html_(self) -> str:
        return frame(self.html, label=f"{self.title}, which plays")

    def __repr__(self) -> str:
        return f"<PlayedPage {self.title}: {len(self.html)} characters of HTML; save(path) writes it>"


def show_run(run: StoredRun, what: object) -> Any:
    """Return what a notebook shows of a run: PLAY is a `PlayedPage`, RERUN the widget.

    Raises:
        ArgumentError: it is neither.
        ViewError: the run has no steps; for RERUN: Rerun or its widget is not installed.
    """
    if _is_rerun(what):
        return _widget([run])
    return PlayedPage(run.header.title, page_of([run]))


def show_difference(compared: Difference, what: object) -> Any:
    """Return what a notebook shows of two runs side by side, at their first difference; as `show_run`."""
    if _is_rerun(what):
        return _widget(compared.runs)
    return PlayedPage(" against ".join(run.header.title for run in compared.runs), played_difference(compared))


def _is_rerun(what: object) -> bool:
    if what not in (PLAY, RERUN):
        raise ArgumentError(expected("what", "", f"a step, {PLAY!r} or {RERUN!r}", what))
    return what == RERUN


def _widget(runs: Sequence[StoredRun]) -> Any:
    from fireworld.recording.pages.view import widget

    return widget(runs)
