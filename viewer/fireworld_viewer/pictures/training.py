"""Pictures of trainings: curves over the episodes with their scenarios as bands, and the tables over the training."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from fireworld.records import ACTIONS
from fireworld_viewer import colors
from fireworld_viewer.colors import hexadecimal
from fireworld_viewer.pictures.figure_files import INK, PAIR_COLORS, label_text, new_figure, open_frame
from fireworld_viewer.table_pixels import UNSEEN_RGB, table_pixels

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[Any]
_ACROSS: Final = 3
_WIDTH_INCHES: Final = 14.0
_PANEL_INCHES: Final = 2.3
_BAND: Final = "#efece5"


@dataclass(frozen=True)
class CoursePanel:
    """One panel: curves over the parts of one training, or of two.

    Attributes:
        title: above it.
        curves: by training, then by curve: (k,) values, nan where there is none.
        marks: (m,) parts of each training at which a scenario ended with a settled policy, drawn on the first curve.
        logarithmic: both ways from zero.
        by_curve: curves have a color each, those of a second training dashed; else every training has a color.
    """

    title: str
    curves: Mapping[str, Mapping[str, Array]]
    marks: Mapping[str, Array] = field(default_factory=dict)
    logarithmic: bool = False
    by_curve: bool = False


def draw_course(
    panels: Sequence[CoursePanel],
    bands: Sequence[tuple[int, int]],
    labels: Sequence[tuple[int, int, str]],
    *,
    unit: str,
) -> Figure:
    """Draw the panels three abreast.

    `bands` are first and last part of each scenario of the first training, of which every second is shaded; `labels`
    are first and last part of what is named above the panels.
    """
    n_rows = -(-len(panels) // _ACROSS)
    figure = new_figure(_WIDTH_INCHES, n_rows * _PANEL_INCHES + 0.4, dpi=110, paper="white", layout="constrained")
    grid = figure.subplots(n_rows, _ACROSS, sharex=True, squeeze=False).ravel()
    for axes, panel in zip(grid, panels, strict=False):
        _draw_bands(axes, bands, labels)
        for k, (name, curves) in enumerate(panel.curves.items()):
            for j, (curve, values) in enumerate(curves.items()):
                look = _look(panel, k, j, name=name if axes is grid[0] else "", curve=curve)
                axes.plot(np.arange(len(values)), values, alpha=0.85, **look)
                if j == 0 and name in panel.marks:
                    places = panel.marks[name]
                    axes.plot(places, values[places], "D", color=look["color"], markersize=3.5,
                              markeredgecolor="white", markeredgewidth=0.4)  # fmt: skip
        _dress(axes, panel)
    for axes in grid[len(panels) :]:
        axes.set_visible(False)
    for axes in grid[max(0, len(panels) - _ACROSS) : len(panels)]:
        axes.tick_params(labelbottom=True)
    figure.supxlabel(unit, fontsize=9, color=INK)
    return figure


def _look(panel: CoursePanel, k: int, j: int, *, name: str, curve: str) -> dict[str, Any]:
    """Return how the j-th curve of the k-th training is drawn, and what the legend calls it."""
    several, single = len(panel.curves) > 1, all(len(curves) == 1 for curves in panel.curves.values())
    look: dict[str, Any] = {"color": hexadecimal(_COLORS[j % len(_COLORS)]), "linewidth": 1.2 if single else 0.9}
    if panel.by_curve:
        return {**look, "linestyle": "--" if k else "-", "label": None if k else label_text(curve)}
    if several:
        return {
            **look,
            "color": PAIR_COLORS[k % len(PAIR_COLORS)],
            "label": None if j or not name else label_text(name),
        }
    return {**look, "label": label_text(curve) or None}


_COLORS: Final = (
    (31, 111, 235), (194, 87, 26), (30, 143, 69), (176, 60, 150), (120, 120, 120), (150, 120, 10), (10, 150, 165),
)  # fmt: skip


def _draw_bands(axes: Axes, bands: Sequence[tuple[int, int]], labels: Sequence[tuple[int, int, str]]) -> None:
    """Shade every second band, and write the labels above."""
    for first, last in bands[::2]:
        axes.axvspan(first - 0.5, last + 0.5, color=_BAND, linewidth=0, zorder=0)
    for first, last, name in labels:
        axes.text(
            (first + last) / 2, 1.0, label_text(name), fontsize=6.5, color="#777777", ha="center", va="bottom",
            transform=axes.get_xaxis_transform(), clip_on=False,
        )  # fmt: skip


def _dress(axes: Axes, panel: CoursePanel) -> None:
    if panel.logarithmic:
        axes.set_yscale("symlog", linthresh=10.0)
    from matplotlib.ticker import MaxNLocator

    axes.set_title(label_text(panel.title), fontsize=9.5, loc="left", color=INK, pad=12)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=7.5, framealpha=0.6, edgecolor="none", labelcolor=INK, loc="best")
    open_frame(axes)
    axes.margins(x=0.01)
    axes.xaxis.set_major_locator(MaxNLocator(nbins=6, integer=True))
    axes.tick_params(labelsize=8, colors=INK)
    if not panel.logarithmic:
        axes.yaxis.set_major_formatter(lambda number, _: f"{number:,.6g}")


def draw_tables(action: Array, value: Array, labels: Sequence[str], moments: Array, *, unit: str) -> Figure:
    """Draw the tables over a training.

    `action` and `value` are (s, b, m) as for `table_pixels`; `labels` say what the s states are, `moments` (m,) after
    which parts the tables are known.
    """
    from matplotlib.patches import Patch

    n_states, n_tables, n_moments = action.shape
    figure = new_figure(_WIDTH_INCHES, 0.9 + 0.21 * n_states, dpi=110, paper="white", layout="constrained")
    axes = figure.subplots()
    axes.imshow(table_pixels(action, value), aspect="auto", interpolation="nearest", extent=(0, n_moments, n_states, 0))
    for row in range(1, n_states):
        axes.axhline(row, color="white", linewidth=0.8)
    axes.set_yticks(np.arange(n_states) + 0.5, list(labels), fontsize=6.5)
    places = np.unique(np.linspace(0, n_moments - 1, min(n_moments, 12)).round().astype(int))
    axes.set_xticks(places + 0.5, [f"{moments[k] + 1:,}" for k in places], fontsize=8)
    axes.set_xlabel(f"after so many {unit}s", fontsize=9, color=INK)
    axes.tick_params(colors=INK, length=2)
    axes.spines[:].set_visible(False)
    handles = [Patch(facecolor=hexadecimal(colors.ACTION_RGB[k]), label=name) for k, name in enumerate(ACTIONS)]
    handles.append(Patch(facecolor=hexadecimal(UNSEEN_RGB), label="never visited"))
    title = f"greedy action; {n_tables} brigades a state, from above; darker: costs more" if n_tables > 1 else None
    figure.legend(handles=handles, loc="outside upper left", ncols=5, fontsize=8, frameon=False, labelcolor=INK,
                  title=title, title_fontsize=8)  # fmt: skip
    return figure
