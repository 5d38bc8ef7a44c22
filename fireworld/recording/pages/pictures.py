"""Pictures, films and views of runs: what `Run.show`, `Run.film` and `Run.view` return or write."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from fireworld.files import write_file
from fireworld.records import Recording, StepRecord

if TYPE_CHECKING:
    from fireworld.recording.run import Run


@dataclass(frozen=True)
class Picture:
    """A picture: notebooks show it, `save` writes it."""

    title: str
    png: bytes

    def save(self, path: str | Path) -> Path:
        """Write it as a PNG file, replacing what is there.

        Raises:
            OutputError: it cannot be written.
        """
        write_file(Path(path), self.png)
        return Path(path)

    def _repr_png_(self) -> bytes:
        return self.png

    def __repr__(self) -> str:
        return f"<Picture {self.title}: {len(self.png)} bytes of PNG; save(path) writes it>"


def map_of(run: Recording, record: StepRecord) -> Picture:
    """Return a map of the city after a step.

    Raises:
        ViewError: matplotlib is not installed.
    """
    from fireworld_viewer.pictures.figure_files import plain_style, png_bytes
    from fireworld_viewer.pictures.maps import draw_record

    title = f"{run.header.scenario}, {run.header.policy}, seed {run.header.seed}: step {record.step}"
    with plain_style():
        return Picture(title, png_bytes(draw_record(run.city, record, title=title)))


def map_png(run: Recording, record: StepRecord) -> bytes | None:
    """Return the map as a PNG file; None where matplotlib is not installed."""
    from fireworld.errors import ViewError

    try:
        return map_of(run, record).png
    except ViewError:
        return None


def film_of(run: Run, path: Path, *, fps: float, every: int, force: bool) -> Path:
    """Write a film of a run; arguments and errors as for `Run.film`."""
    from fireworld_viewer.pictures.figure_files import plain_style
    from fireworld_viewer.pictures.film import FILMS, save_film
    from fireworld_viewer.story.steps import read_steps_between

    from fireworld.files import check_output

    check_output(path, force=force, endings=[*FILMS])
    runs: list[Recording] = [run]
    shown = read_steps_between(runs, first=None, last=None, every=every)
    with plain_style():
        save_film(runs, shown, path, fps=fps)
    return path


def view_runs(runs: Sequence[Run], *, save: Path | None, force: bool) -> None:
    """Open one or two runs in Rerun, or save them for it; errors as for `Run.view`."""
    raise NotImplementedError
