"""Pictures and films of runs: as files, and what `Run.show` and notebooks show."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

from fireworld_viewer.pictures.figure_files import STILLS, plain_style, png_bytes, save_figure
from fireworld_viewer.pictures.film import FILMS, FPS, save_film
from fireworld_viewer.pictures.maps import draw_record, draw_steps
from fireworld_viewer.story.steps import LAST, read_steps_between, select_steps

from fireworld.errors import ViewError
from fireworld.files import check_output
from fireworld.picture import Picture
from fireworld.recording.inputs import AnyRecording, open_to_show
from fireworld.records import Recording, StepRecord

ENDINGS: Final = (*STILLS, *FILMS)  # of files that can be rendered


def map_of(run: Recording, record: StepRecord) -> Picture:
    """Return a map of the city after a step; ViewError if matplotlib is not installed."""
    title = f"{run.header.title}: step {record.step}"
    with plain_style():
        return Picture(title, png_bytes(draw_record(run.city, record, title=title)))


def map_png(run: Recording, record: StepRecord) -> bytes | None:
    """Return the map as a PNG file; None where matplotlib is not installed."""
    try:
        return map_of(run, record).png
    except ViewError:
        return None


def render_picture(
    logs: AnyRecording | Sequence[AnyRecording],
    output: Path | str,
    *,
    steps: Sequence[int] = (LAST,),
    whole: bool = False,
    force: bool = False,
) -> None:
    """Draw steps of one recording, or of two of one city side by side, as a .png, .svg or .pdf file.

    The part of the city in which it burns is drawn, or the `whole` of it. Recordings are paths or runs; those that were
    cut off or damaged are drawn as far as they are good. Errors: OutputError, LogError, or ViewError if there is no
    such step, the cities differ or matplotlib is missing.
    """
    check_output(Path(output), endings=STILLS, force=force)
    recordings = [select_steps(one) for one in open_to_show(logs)]  # each file is read once
    with plain_style():
        save_figure(draw_steps(recordings, steps, whole=whole), Path(output), force=force)


def render_film(
    logs: AnyRecording | Sequence[AnyRecording],
    output: Path | str,
    *,
    first_step: int | None = None,
    last_step: int | None = None,
    every: int = 1,
    fps: float = FPS,
    whole: bool = False,
    force: bool = False,
    on_frame: Callable[[int, int], object] = lambda _, __: None,
) -> list[int]:
    """Make a film, a .gif or .mp4 file; recordings and errors as for `render_picture`. Return the steps drawn.

    Every n-th step is drawn, and always the last; `fps` of them a second. `on_frame` is called after each frame with
    the number of frames done and of all.
    """
    check_output(Path(output), endings=FILMS, force=force)
    recordings = [select_steps(one) for one in open_to_show(logs)]
    shown = read_steps_between(recordings, first=first_step, last=last_step, every=every)
    frames = iter(range(1, len(shown) + 1))
    with plain_style():
        save_film(
            recordings, shown, Path(output), fps=fps, whole=whole,
            on_frame=lambda: on_frame(next(frames), len(shown)),
        )  # fmt: skip
    return [one.step for one in shown]
