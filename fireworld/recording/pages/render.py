"""Pictures and films of recordings, as files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

from fireworld_viewer.pictures.figure_files import STILLS, plain_style, save_figure
from fireworld_viewer.pictures.film import FILMS, FPS, save_film
from fireworld_viewer.pictures.maps import draw_steps
from fireworld_viewer.story.steps import LAST, read_steps_between

from fireworld.files import check_output
from fireworld.recording.inputs import AnyRecording, open_to_show

ENDINGS: Final = (*STILLS, *FILMS)
"""Of files that can be rendered."""


def render_picture(
    logs: AnyRecording | Sequence[AnyRecording],
    output: Path | str,
    *,
    steps: Sequence[int] = (LAST,),
    force: bool = False,
) -> None:
    """Draw steps of one recording, or of two of one city side by side, as a picture.

    Args:
        logs: paths of recordings, or runs; those that were cut off or damaged are drawn as far as they are good.
        output: a .png, .svg or .pdf file.
        steps: the steps to draw; -1 is the last one.
        force: replace an existing file.

    Raises:
        OutputError: the file cannot be written.
        ViewError: there is no such step, the cities differ, or matplotlib is not installed.
        LogError: a recording cannot be read.
    """
    check_output(Path(output), endings=STILLS, force=force)
    recordings = open_to_show(logs)
    with plain_style():
        save_figure(draw_steps(recordings, steps), Path(output), force=force)


def render_film(
    logs: AnyRecording | Sequence[AnyRecording],
    output: Path | str,
    *,
    first_step: int | None = None,
    last_step: int | None = None,
    every: int = 1,
    fps: float = FPS,
    force: bool = False,
    on_frame: Callable[[int, int], object] = lambda _, __: None,
) -> list[int]:
    """Make a film of one recording, or of two of one city side by side.

    Args:
        logs: paths of recordings, or runs; those that were cut off or damaged are drawn as far as they are good.
        output: a .gif or .mp4 file.
        first_step: first step to draw.
        last_step: last step to draw.
        every: draw every n-th of these steps, and always the last.
        fps: steps a second.
        force: replace an existing file.
        on_frame: called after each frame with the number of frames done and of all.

    Returns:
        The steps drawn.

    Raises:
        OutputError: the file cannot be written.
        ViewError: there is no such step, the cities differ, or a library is not installed.
        LogError: a recording cannot be read.
    """
    check_output(Path(output), endings=FILMS, force=force)
    recordings = open_to_show(logs)
    shown = read_steps_between(recordings, first=first_step, last=last_step, every=every)
    frames = iter(range(1, len(shown) + 1))
    with plain_style():
        save_film(recordings, shown, Path(output), fps=fps, on_frame=lambda: on_frame(next(frames), len(shown)))
    return [one.step for one in shown]
