"""Figures and their files: drawn without a screen, and the same figure gives the same bytes."""

from __future__ import annotations

import importlib
import io
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fireworld.errors import ViewError, described
from fireworld.files import check_output, written_beside
from fireworld.interrupt import postponed
from fireworld_viewer import colors
from fireworld_viewer.colors import hexadecimal

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DPI: Final = 120
PAPER: Final = "#f4f2ee"
INK: Final = "#333333"
PAIR_COLORS: Final = tuple(map(hexadecimal, colors.RUN_RGB))
"""Of curves of two runs or teams."""
STILLS: Final[Mapping[str, Mapping[str, Any]]] = {
    ".png": {"Software": "fireworld"},
    ".svg": {"Creator": "fireworld", "Date": None},
    ".pdf": {"Creator": "fireworld", "CreationDate": None},
}
"""Endings of still pictures, and what is written into such a file besides the picture: no time, no version."""
_BACKEND: Final = "MPLBACKEND"
_MISSING: Final = "pictures: matplotlib is not installed; try pip install 'fireworld[figures]'"


def import_library(name: str, hint: str) -> Any:
    """Import a library that need not be installed; ViewError with the hint if it is not."""
    backend = os.environ.pop(_BACKEND, None)  # of a notebook, say, which only its own environment has
    try:
        return importlib.import_module(name)
    except ImportError:
        raise ViewError(hint) from None
    finally:
        if backend is not None:
            os.environ[_BACKEND] = backend


def new_figure(
    width_inches: float, height_inches: float, *, dpi: int = DPI, paper: str = PAPER, layout: Any = None
) -> Figure:
    """Return an empty figure that needs no screen, on colored paper; a "constrained" layout makes room for labels."""
    import_library("matplotlib", _MISSING)
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width_inches, height_inches), dpi=dpi, facecolor=paper, layout=layout)
    FigureCanvasAgg(figure)
    return figure


def label_text(name: str) -> str:
    """Return a user's name as matplotlib writes it: it takes $ for formulas, and leaves out what begins with _."""
    plain = name.replace("$", r"\$")
    return f" {plain}" if plain.startswith("_") else plain


def open_frame(axes: Axes) -> None:
    """Leave out the lines above and to the right of a panel."""
    axes.spines[["top", "right"]].set_visible(False)


@contextmanager
def plain_style() -> Iterator[None]:
    """Draw in matplotlib's own style within, whatever the user's settings are: they would change the bytes.

    Raises:
        ViewError: matplotlib is not installed.
    """
    mpl = import_library("matplotlib", _MISSING)
    from matplotlib import style

    with style.context("default"), mpl.rc_context({"svg.hashsalt": "fireworld"}):
        yield


@contextmanager
def drawing() -> Iterator[None]:
    """Turn what matplotlib raises while it draws, of numbers that no picture can hold, into a line (ViewError).

    Ctrl-C waits meanwhile: matplotlib's compiled code makes errors of its own of it.
    """
    with postponed():
        try:
            yield
        except (ArithmeticError, RuntimeError, ValueError) as error:
            raise ViewError(f"pictures: these values cannot be drawn: {described(error)}") from error


def save_figure(figure: Figure, path: Path, *, force: bool = False) -> None:
    """Write a figure as the kind of picture that the file's ending names.

    Raises:
        OutputError: the ending is of no such kind, or the file exists or cannot be written.
    """
    check_output(path, endings=STILLS, force=force)
    ending = path.suffix.lower()
    with written_beside(path) as partial, drawing():
        figure.savefig(partial, format=ending[1:], metadata=dict(STILLS[ending]))


def png_bytes(figure: Figure) -> bytes:
    """Return a figure as a PNG file."""
    data = io.BytesIO()
    with drawing():
        figure.savefig(data, format="png", metadata=dict(STILLS[".png"]))
    return data.getvalue()
