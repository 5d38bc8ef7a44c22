"""Recordings in Rerun: its window, a browser, or a file for it."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from fireworld_recorder.totals import totals_of
from fireworld_viewer.rerun_view import app
from fireworld_viewer.rerun_view.pages import OutcomePage
from fireworld_viewer.story.steps import select_steps

from fireworld.files import text_of
from fireworld.recording.difference_text import totals_rows
from fireworld.recording.inputs import AnyRecording, open_to_show, run_name
from fireworld.recording.pages.shown import compare_shown, first_shown
from fireworld.records import Recording


def view(
    logs: AnyRecording | Sequence[AnyRecording],
    *,
    save: Path | str | None = None,
    force: bool = False,
    web: bool = False,
    port: int | None = None,
    announce: Callable[[str], None] = print,
    focus: Sequence[int] = (),
    first_step: int | None = None,
    last_step: int | None = None,
    every: int = 1,
    air: bool = False,
) -> None:
    """Show one recording, or two of one city side by side, in Rerun; return when its window is closed.

    Recordings are paths or runs; those that were cut off or damaged are shown as far as they are good. With `save` a
    Rerun file is written instead; with `web` the view is served to browsers on this machine until Ctrl-C, and
    `announce` called with its address. `focus`: ids of buildings whose temperatures are plotted, by default those that
    burn first. `air`: show its heat at every step, which is computed by a replay. Errors: OutputError, LogError, or
    ViewError if there is no Rerun, no display, no such step or building, or if the cities differ.
    """
    held = open_to_show(logs)
    names = [run_name(recording) for recording in held]
    with ExitStack() as stack:
        if air:
            folder = Path(stack.enter_context(TemporaryDirectory(prefix="fireworld-")))
            held = [_with_air(one, folder / f"{k}.mcap", source=names[k]) for k, one in enumerate(held)]
        shown = [select_steps(one, first=first_step, last=last_step, every=every) for one in held]
        outcome = _outcome([text_of(Path(name).name) for name in names], shown)
        write = functools.partial(app.save, shown, focus=focus, outcome=outcome)
        if save is not None:
            write(Path(save), force=force)
        elif web:
            app.serve(write, port=port or app.WEB_PORT, announce=announce)
        else:
            app.show(write)


def widget(logs: Sequence[AnyRecording]) -> Any:
    """Return Rerun's widget of one recording, or of two of one city, which notebooks show.

    ViewError if Rerun or its widget is not installed, or if the cities differ.
    """
    held = open_to_show(logs)
    shown = [select_steps(one) for one in held]
    return app.widget(shown, outcome=_outcome([text_of(Path(run_name(one)).name) for one in held], shown))


def _with_air(recording: Recording, path: Path, *, source: str) -> Recording:
    """Replay a run for the air of every step; only this needs a simulator."""
    from fireworld.recording.replay import replay_with_air

    return replay_with_air(recording, path, source=source)


def _outcome(heads: Sequence[str], recordings: Sequence[Recording]) -> OutcomePage:
    """Return how the runs came out, and where two first differ, in the steps that are shown."""
    if len(recordings) == 1:
        return OutcomePage(heads=heads, rows=list(totals_rows(totals_of(recordings[0]))))
    first_run, second_run = recordings
    difference = compare_shown(first_run, second_run)
    rows, first = list(totals_rows(*difference.totals)), first_shown(difference, first_run)
    if first is None:
        return OutcomePage(heads=heads, rows=rows)
    return OutcomePage(heads=heads, rows=rows, first_step=first[0], first_sentence=first[1])
