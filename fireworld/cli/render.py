"""`fireworld render`: pictures and films of recordings, without a viewer."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import click

from fireworld.cli.opening import open_one_or_two, open_trainings
from fireworld.cli.progress import bars

_LAST: Final = "last"
_STEPS_MAX: Final = 24


@click.command()
@click.argument("logs", metavar="LOG...", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    required=True,
    type=click.Path(path_type=Path),
    help="What to write: a picture (.png, .svg, .pdf) or a film (.gif, .mp4).",
)
@click.option("--step", metavar="N", help="Draw this step, or `last`.  [default: last]")
@click.option("--steps", metavar="N,N,...", help="Draw these steps in a strip, as in 0,60,last.")
@click.option("--from", "first", type=click.IntRange(min=0), metavar="N", help="First step of a film.")
@click.option("--to", "last", type=click.IntRange(min=0), metavar="N", help="Last step of a film.")
@click.option("--every", type=click.IntRange(min=1), metavar="N", help="Only each N-th step of a film.  [default: 1]")
@click.option("--fps", type=click.FloatRange(0.1, 50.0), metavar="X", help="Steps a second of a film.  [default: 10]")
@click.option("--whole", is_flag=True, help="Show the whole city, not only the part in which it burns.")
@click.option("--force", is_flag=True, help="Replace an existing file.")
def command(
    *,
    logs: tuple[Path, ...],
    output: Path,
    step: str | None,
    steps: str | None,
    first: int | None,
    last: int | None,
    every: int | None,
    fps: float | None,
    whole: bool,
    force: bool,
) -> None:
    """Draw LOG, a recording, or two of one city side by side: a picture, a strip of pictures or a film.

    \b
    fireworld render run.mcap -o still.png --step 120
    fireworld render run.mcap -o strip.png --steps 0,60,120,last
    fireworld render training.mcap -o curves.png
    fireworld render run.mcap -o film.gif --every 2 --fps 15
    fireworld render alone.mcap together.mcap -o film.mp4 --from 10 --to 90

    The ending of the file decides what it becomes. A run that ended before the other stays in its last state. A
    recording that was cut off or damaged is drawn as far as it is good. docs/pictures.md explains what is drawn.

    Exit code: 0 drawn, 2 could not draw, 130 interrupted (no half file is left).
    """
    from fireworld_viewer.pictures.film import FILMS

    from fireworld.files import check_output
    from fireworld.recording.pages.pictures import ENDINGS

    check_output(output, endings=ENDINGS, force=force)
    trainings = open_trainings(logs, doing="drawing")
    if trainings:
        if whole or any(option is not None for option in (step, steps, first, last, every, fps)):
            raise click.UsageError("A training is drawn whole: no steps, ranges or frames.")
        from fireworld.training.log.pages.page import render_training

        render_training(trainings, output, force=force)
        click.echo(f"{output}: {sum(map(len, trainings)):,} {trainings[0].header.unit}s, {_size(output)}")
        return
    if output.suffix.lower() in FILMS:
        if step is not None or steps is not None:
            raise click.UsageError(f"--step and --steps go with pictures, not with films ({output.suffix}).")
        _render_film(logs, output, first=first, last=last, every=every or 1, fps=fps, whole=whole, force=force)
        return
    if not (first is last is every is fps is None):
        raise click.UsageError(f"--from, --to, --every and --fps go with films, not with pictures ({output.suffix}).")
    if step is not None and steps is not None:
        raise click.UsageError("--step and --steps exclude each other.")
    chosen = _step_numbers("--steps", steps) if steps is not None else _step_numbers("--step", step or _LAST)
    if steps is None and len(chosen) > 1:
        raise click.UsageError(f"--step: expected one step, got {step!r}; several go with --steps.")
    _render_picture(logs, output, chosen, whole=whole, force=force)


def _step_numbers(option: str, text: str) -> list[int]:
    """Turn "0,60,last" into steps."""
    words = [word.strip() for word in text.split(",")]
    if len(words) > _STEPS_MAX:
        raise click.UsageError(f"{option}: expected at most {_STEPS_MAX} steps, got {len(words)}; a film shows more.")
    if not all(word == _LAST or (word.isascii() and word.isdigit()) for word in words):
        raise click.UsageError(f"{option}: expected steps like 0,60,last, got {text!r}.")
    return [-1 if word == _LAST else int(word) for word in words]


def _render_picture(paths: Sequence[Path], output: Path, steps: Sequence[int], *, whole: bool, force: bool) -> None:
    from fireworld.recording.pages.pictures import render_picture

    render_picture(open_one_or_two(paths, doing="drawing"), output, steps=steps, whole=whole, force=force)
    click.echo(f"{output}: {len(steps)} step{'s' if len(steps) > 1 else ''}, {_size(output)}")


def _render_film(
    paths: Sequence[Path],
    output: Path,
    *,
    first: int | None,
    last: int | None,
    every: int,
    fps: float | None,
    whole: bool,
    force: bool,
) -> None:
    from fireworld_viewer.pictures.film import FPS

    from fireworld.recording.pages.pictures import render_film

    recordings = open_one_or_two(paths, doing="drawing")
    with bars() as progress:
        task = progress.add_task("film", total=None)
        steps = render_film(
            recordings,
            output,
            first_step=first,
            last_step=last,
            every=every,
            fps=fps or FPS,
            whole=whole,
            force=force,
            on_frame=lambda done, total: progress.update(task, completed=done, total=total),
        )
    click.echo(f"{output}: {len(steps)} frames, steps {steps[0]} to {steps[-1]}, {_size(output)}")


def _size(path: Path) -> str:
    n_bytes = path.stat().st_size
    return f"{n_bytes / 1e6:.1f} MB" if n_bytes >= 1_000_000 else f"{n_bytes / 1e3:.0f} kB"
