"""Still maps of a city with matplotlib, in the same colors as the Rerun view."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from fireworld.errors import OutputError, ViewError
from fireworld.records import FIERYNESS, CityRecord
from viewer import colors

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH_INCHES: Final = 10.0
DPI: Final = 120
_LEGEND_INCHES: Final = 2.2
_MARGIN_M: Final = 12.0
_PAPER: Final = "#f4f2ee"
_INK: Final = "#333333"
_STREET: Final = "#ffffff"
_GROUND: Final = "#dedad2"


def draw_map(
    city: CityRecord,
    *,
    fieryness: NDArray[Any] | None = None,
    brigades_xy: NDArray[Any] | None = None,
    civilian_hp: NDArray[Any] | None = None,
    title: str = "",
) -> Figure:
    """Draw a city from above: buildings, streets, refuges, hydrants, civilians and brigades.

    Args:
        city: what to draw; civilians stand where it has them.
        fieryness: (n,) official codes 0..8; none burns if left out.
        brigades_xy: (n_brigades, 2) positions in metres; none are drawn if left out.
        civilian_hp: (n_civilians,) health points; those of the start if left out.
        title: heading; the city's name if left out.

    Raises:
        ViewError: matplotlib is not installed.
    """
    figure, axes = _paper(city)
    codes = np.zeros(len(city.building_id), dtype=np.uint8) if fieryness is None else np.asarray(fieryness)
    hp = np.asarray(city.civilian_hp) if civilian_hp is None else np.asarray(civilian_hp)
    _draw_streets(axes, city)
    _draw_buildings(axes, city, codes)
    _draw_civilians(axes, city, hp)
    if brigades_xy is not None:
        _draw_brigades(axes, np.asarray(brigades_xy, dtype=np.float64).reshape(-1, 2))
    _draw_scale(axes)
    axes.set_title(title or city.name, loc="left", color=_INK, fontsize=13)
    _draw_legend(axes, codes, n_civilians=len(hp), n_brigades=0 if brigades_xy is None else len(brigades_xy), city=city)
    return figure


def save_figure(figure: Figure, path: Path, *, force: bool = False) -> None:
    """Write a figure as PNG: the same figure gives the same bytes, and no half-written file bears the name.

    Raises:
        OutputError: the file exists or cannot be written.
    """
    if path.exists() and not force:
        raise OutputError(f"{path}: exists already; try --force")
    partial = path.with_name(path.name + ".partial")
    try:
        figure.savefig(partial, format="png", metadata={"Software": "fireworld"})
        partial.replace(path)
    except OSError as error:
        raise OutputError(f"{path}: cannot be written: {error.strerror or error}") from None
    finally:
        partial.unlink(missing_ok=True)


def _paper(city: CityRecord) -> tuple[Figure, Axes]:
    """A figure as wide as told and as high as the city asks for, with one axes in metres."""
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError:
        raise ViewError("map: matplotlib is not installed; try pip install 'fireworld[figures]'") from None
    x, y = np.asarray(city.outline_x_m), np.asarray(city.outline_y_m)
    west, east, south, north = x.min() - _MARGIN_M, x.max() + _MARGIN_M, y.min() - 2 * _MARGIN_M, y.max() + _MARGIN_M
    map_inches = WIDTH_INCHES - _LEGEND_INCHES - 0.2
    high = float(np.clip(map_inches * (north - south) / (east - west), 3.5, 16.0))
    figure = Figure(figsize=(WIDTH_INCHES, high + 0.6), dpi=DPI, facecolor=_PAPER)
    FigureCanvasAgg(figure)
    size = high + 0.6
    axes = figure.add_axes((0.1 / WIDTH_INCHES, 0.1 / size, map_inches / WIDTH_INCHES, high / size))
    axes.set(xlim=(west, east), ylim=(south, north), aspect="equal", xticks=[], yticks=[], facecolor=_GROUND)
    axes.spines[:].set_visible(False)
    return figure, axes


def _draw_streets(axes: Axes, city: CityRecord) -> None:
    from matplotlib.collections import LineCollection

    node = np.column_stack([city.node_x_m, city.node_y_m])
    lines = list(zip(node[city.street_from], node[city.street_to], strict=True))
    axes.add_collection(LineCollection(lines, colors=_STREET, linewidths=3.0, capstyle="round", zorder=1))
    axes.scatter(city.hydrant_x_m, city.hydrant_y_m, s=14, color=_hex(colors.HYDRANT_RGB), marker="s", zorder=4)


def _draw_buildings(axes: Axes, city: CityRecord, codes: NDArray[Any]) -> None:
    from matplotlib.collections import PolyCollection

    ptr = np.asarray(city.outline_ptr)
    corners = np.column_stack([city.outline_x_m, city.outline_y_m])
    outlines = [corners[ptr[index] : ptr[index + 1]] for index in range(len(ptr) - 1)]
    faces = [_hex(colors.FIERYNESS_RGB[code]) for code in codes.tolist()]
    for refuge in np.asarray(city.refuge_building).tolist():
        faces[refuge] = _hex(colors.REFUGE_RGB)
    axes.add_collection(PolyCollection(outlines, facecolors=faces, edgecolors=_INK, linewidths=0.35, zorder=2))
    for refuge in np.asarray(city.refuge_building).tolist():
        at = (city.center_x_m[refuge], city.center_y_m[refuge])
        axes.annotate("R", at, ha="center", va="center", color="white", fontsize=8, weight="bold", zorder=5)


def _draw_civilians(axes: Axes, city: CityRecord, hp: NDArray[Any]) -> None:
    rgb = colors.health_rgb(hp, np.asarray(city.civilian_hp)) / 255.0
    axes.scatter(city.civilian_x_m, city.civilian_y_m, s=30, c=rgb, edgecolors=_INK, linewidths=0.8, zorder=6)


def _draw_brigades(axes: Axes, xy: NDArray[np.float64]) -> None:
    """Draw numbered balls; brigades on one spot side by side."""
    drawn: dict[tuple[float, float], int] = {}
    for brigade, (x, y) in enumerate(xy.tolist()):
        place = drawn.get((x, y), 0)
        drawn[x, y] = place + 1
        axes.annotate(
            str(brigade),
            (x, y),
            xytext=(13 * place, 0),
            textcoords="offset points",
            ha="center",
            va="center",
            color="white",
            fontsize=7,
            weight="bold",
            bbox={"boxstyle": "circle,pad=0.25", "facecolor": _hex(colors.ACTIVITY_RGB[2]), "edgecolor": "white"},
            zorder=7,
        )


def _draw_scale(axes: Axes) -> None:
    """Draw a bar of a round length, about a fifth of the map, at the lower left."""
    (west, east), south = axes.get_xlim(), axes.get_ylim()[0]
    length = max(step for step in (10, 20, 50, 100, 200, 500, 1000, 2000) if step <= max(10, (east - west) / 4))
    x, y = west + 0.6 * _MARGIN_M, south + 0.6 * _MARGIN_M
    axes.plot([x, x + length], [y, y], color=_INK, linewidth=2.5, solid_capstyle="butt", zorder=8)
    axes.annotate(f"{length} m", (x + length, y), xytext=(4, 0), textcoords="offset points", va="center", color=_INK)


def _draw_legend(axes: Axes, codes: NDArray[Any], *, n_civilians: int, n_brigades: int, city: CityRecord) -> None:
    """Name what is on this map, and how many of it there are."""
    from matplotlib.lines import Line2D

    def mark(label: str, rgb: colors.Rgb, shape: str = "s") -> Line2D:
        style: dict[str, Any] = {"markerfacecolor": _hex(rgb), "markeredgecolor": _INK, "markersize": 9}
        return Line2D([], [], linestyle="", marker=shape, label=label, **style)

    refuges = np.asarray(city.refuge_building).tolist()
    counts = np.bincount(np.delete(codes, refuges), minlength=len(FIERYNESS)).tolist()
    entries: list[Line2D] = [
        mark(f"{name} ({count})", rgb)
        for name, count, rgb in zip(FIERYNESS, counts, colors.FIERYNESS_RGB, strict=True)
        if count
    ]
    for label, count, rgb, shape in (
        ("refuge", len(refuges), colors.REFUGE_RGB, "s"),
        ("hydrant", len(city.hydrant_x_m), colors.HYDRANT_RGB, "s"),
        ("civilian", n_civilians, colors.HEALTHY_RGB, "o"),
        ("brigade", n_brigades, colors.ACTIVITY_RGB[2], "o"),
    ):
        entries += [mark(f"{label} ({count})", rgb, shape)] if count else []
    axes.legend(
        handles=entries, loc="upper left", bbox_to_anchor=(1.01, 1.0), frameon=False, labelcolor=_INK, borderaxespad=0
    )


def _hex(rgb: Sequence[int]) -> str:
    return "#" + "".join(f"{part:02x}" for part in rgb)
