"""A picture that notebooks show."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from fireworld.files import write_file


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
