"""A run, or two side by side, as a page that plays."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from fireworld_recorder.diff import RunComparison
from fireworld_viewer.play.page import FirstDifference, play_page
from fireworld_viewer.story.steps import select_steps

from fireworld.arguments import path_of
from fireworld.files import check_output, text_of, write_file
from fireworld.recording.inputs import AnyRecording, open_to_show, run_name
from fireworld.recording.pages.shown import compare_shown, first_shown
from fireworld.records import Recording

ENDINGS: Final = (".html", ".htm")  # of the page's file


def play(
    log: AnyRecording,
    other: AnyRecording | None = None,
    *,
    output: str | os.PathLike[str],
    first_step: int | None = None,
    last_step: int | None = None,
    every: int = 1,
    force: bool = False,
) -> Path:
    """Write a recording, or two of one city side by side, as an HTML page that plays and needs no other file.

    Args:
        log: a run, or the path of one; one that was cut off or damaged is shown as far as it is good.
        other: a second one.
        output: the page, an .html file.
        first_step: the first step to show; all from the start if left out.
        last_step: the last step to show.
        every: only each n-th step.
        force: replace an existing file.

    Returns:
        The path of the page.

    Raises:
        OutputError: it cannot be written.
        LogError: a recording is none, or cannot be read.
        ViewError: there is no such step, or the cities differ.
    """
    path = path_of("output", output)
    check_output(path, endings=ENDINGS, force=force)
    page = page_of([log] if other is None else [log, other], first_step=first_step, last_step=last_step, every=every)
    write_file(path, page)
    return path


def page_of(
    logs: Sequence[AnyRecording],
    *,
    first_step: int | None = None,
    last_step: int | None = None,
    every: int = 1,
) -> str:
    """Return the page of one recording, or of two of one city; arguments and errors as for `play`.

    `fireworld_viewer.play.page.frame` makes it a part of another page.
    """
    held = open_to_show(logs)
    shown: list[Recording] = [select_steps(one, first=first_step, last=last_step, every=every) for one in held]
    return page_of_steps(shown, held)


def page_of_steps(shown: Sequence[Recording], logs: Sequence[Recording]) -> str:
    """Return the page of recordings of which the steps to show were read before; arguments and errors as for `play`."""
    return play_page(shown, names=_names(logs), damages=_damages(logs), first=_first_difference(shown))


def page_of_difference(logs: Sequence[AnyRecording], difference: RunComparison | None) -> str:
    """Return the page of two recordings, which opens at their first difference; None: they are the same.

    Errors as for `play`.
    """
    held = open_to_show(logs)
    shown = [select_steps(one) for one in held]
    first = None if difference is None else _marked(difference, shown[0])
    return play_page(
        shown, names=_names(held), damages=_damages(held), first=first, start=None if first is None else first.step
    )


def _names(logs: Sequence[Recording]) -> list[str]:
    return [text_of(Path(run_name(one)).name) for one in logs]


def _damages(logs: Sequence[Recording]) -> list[str | None]:
    return [getattr(one, "damage", None) for one in logs]


def _first_difference(shown: Sequence[Recording]) -> FirstDifference | None:
    """Return where two recordings first differ, in the steps that are shown."""
    if len(shown) < 2:
        return None
    a, b = shown
    return _marked(compare_shown(a, b), a)


def _marked(difference: RunComparison, first: Recording) -> FirstDifference | None:
    found = first_shown(difference, first)
    return None if found is None else FirstDifference(step=found[0], sentence=found[1])
