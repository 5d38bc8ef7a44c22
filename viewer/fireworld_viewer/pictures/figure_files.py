"""Figures as files: the same figure gives the same bytes, and no half-written file bears a name."""

from __future__ import annotations

import io
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fireworld.errors import OutputError, ViewError, expected

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DPI: Final = 120
PAPER: Final = "#f4f2ee"
STILLS: Final[Mapping[str, Mapping[str, Any]]] = {
    ".png": {"Software": "fireworld"},
    ".svg": {"Creator": "fireworld", "Date": None},
    ".pdf": {"Creator": "fireworld", "CreationDate": None},
}
"""Endings of still pictures, and what is written into such a file besides the picture: no time, no version."""


def new_figure(width_inches: float, height_inches: float, *, dpi: int = DPI) -> Figure:
    """Return an empty figure that needs no screen.

    Raises:
        ViewError: matplotlib is not installed.
    """
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError:
        raise ViewError("pictures: matplotlib is not installed; try pip install 'fireworld[figures]'") from None
    figure = Figure(figsize=(width_inches, height_inches), dpi=dpi, facecolor=PAPER)
    FigureCanvasAgg(figure)
    return figure


@contextmanager
def plain_style() -> Iterator[None]:
    """Draw in matplotlib's own style within, whatever the user's settings are: they would change the bytes.

    Raises:
        ViewError: matplotlib is not installed.
    """
    try:
        import matplotlib as mpl
        from matplotlib import style
    except ImportError:
        raise ViewError("pictures: matplotlib is not installed; try pip install 'fireworld[figures]'") from None
    with style.context("default"), mpl.rc_context({"svg.hashsalt": "fireworld"}):
        yield


def save_figure(figure: Figure, path: Path, *, force: bool = False) -> None:
    """Write a figure as the kind of picture that the file's ending names.

    Raises:
        OutputError: the ending is of no such kind, or the file exists or cannot be written.
    """
    check_output(path, endings=STILLS, force=force)
    ending = path.suffix.lower()
    with written_beside(path) as partial:
        figure.savefig(partial, format=ending[1:], metadata=dict(STILLS[ending]))


def png_bytes(figure: Figure) -> bytes:
    """Return a figure as a PNG file."""
    data = io.BytesIO()
    figure.savefig(data, format="png", metadata=dict(STILLS[".png"]))
    return data.getvalue()


def check_output(path: Path, *, endings: Collection[str], force: bool) -> None:
    """See that a file may be written, before there is any work in it.

    Raises:
        OutputError: its ending is none of these, its folder is missing, or it exists and shall not be replaced.
    """
    if path.suffix.lower() not in endings:
        raise OutputError(expected(str(path), "", f"a file ending in {', '.join(endings)}", path.suffix or "no ending"))
    if not path.parent.is_dir():
        raise OutputError(f"{path}: cannot be written: No such file or directory")
    if path.exists() and not force:
        raise OutputError(f"{path}: exists already; try --force")


@contextmanager
def written_beside(path: Path) -> Iterator[Path]:
    """Yield where to write what gets the name `path` once it is whole; nothing is left of it after an error or Ctrl-C.

    Raises:
        OutputError: it cannot be written.
    """
    partial = path.with_name(path.name + ".partial")
    try:
        yield partial
        partial.replace(path)
    except OSError as error:
        raise OutputError(f"{path}: cannot be written: {error.strerror or error}") from None
    finally:
        partial.unlink(missing_ok=True)
