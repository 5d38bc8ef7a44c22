"""Pictures of runs: what `Run.show` returns, and what notebooks show of a run."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from fireworld.files import write_file
from fireworld.records import Recording, StepRecord


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
