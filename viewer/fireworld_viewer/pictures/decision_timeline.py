"""Timelines of the brigades: which action each chose, and below it what it did, step by step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fireworld.records import ACTION_NAMES, ACTIVITIES, Array, Recording
from fireworld_viewer import colors
from fireworld_viewer.pictures.city_map import hexadecimal
from fireworld_viewer.pictures.figure_files import INK, new_figure
from fireworld_viewer.story.series import per_brigade

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH_INCHES: Final = 12.0
_ROW_INCHES: Final = 0.42
_MARGIN_INCHES: Final = 0.75  # of a panel: its title above the rows and the steps below them
_LEGEND_INCHES: Final = 0.75
_LEFT: Final = 0.085
_BANDS: Final = ((-0.38, 0.44), (0.12, 0.22))
"""Top and height of the actions and of the activities in a row, which is 1 high."""


def draw_timeline(recordings: Sequence[Recording]) -> Figure:
    """Draw a panel for each recording, in it two bands for each brigade."""
    heights = [_MARGIN_INCHES + _ROW_INCHES * max(1, len(one.city.brigade_tank_litres)) for one in recordings]
    total = sum(heights) + _LEGEND_INCHES
    figure = new_figure(_WIDTH_INCHES, total)
    span = min(int(one.steps[0]) for one in recordings), max(int(one.steps[-1]) for one in recordings)
    bottom = total
    for one, height, letter in zip(recordings, heights, "AB", strict=False):
        bottom -= height
        axes = figure.add_axes((_LEFT, (bottom + 0.42) / total, 0.985 - _LEFT, (height - _MARGIN_INCHES) / total))
        _draw_panel(axes, one, span)
        name = "" if len(recordings) == 1 else f"{letter}: "
        axes.set_title(f"{name}above what a brigade chose, below what it did", loc="left", fontsize=10, color=INK)
    _draw_legend(figure, recordings, total)
    return figure


def _tables(recording: Recording) -> tuple[Array, Array]:
    """Return what was chosen and what was done, (k, n_brigades) each; -1 is no choice."""
    action = per_brigade(recording, "action", missing=-1)
    return action, np.asarray(recording.column("/brigades", "activity"), dtype=np.int64)


def _draw_panel(axes: Axes, recording: Recording, span: tuple[int, int]) -> None:
    n, steps = len(recording.city.brigade_tank_litres), np.asarray(recording.steps)
    palettes = colors.ACTION_RGB, colors.ACTIVITY_RGB
    for table, palette, (top, height) in zip(_tables(recording), palettes, _BANDS, strict=True):
        for brigade in range(n):
            for start, end, code in _bands(steps, table[:, brigade]):
                style: dict[str, Any] = {"facecolors": hexadecimal(palette[code]), "edgecolors": "none", "linewidth": 0}
                axes.broken_barh([(start, end - start)], (brigade + top, height), **style)
    axes.set_xlim(span[0] - 0.5, span[1] + 0.5)
    axes.set_ylim(max(n, 1) - 0.5, -0.5)
    axes.set_yticks(range(n), [f"brigade {index}" for index in range(n)], fontsize=9)
    axes.set_xlabel("step", fontsize=9, labelpad=1, color=INK)
    axes.tick_params(labelsize=9, colors=INK, length=3)
    axes.set_facecolor("white")
    axes.spines[["top", "right", "left"]].set_visible(False)


def _bands(steps: Array, codes: Array) -> list[tuple[float, float, int]]:
    """Join steps with one code: start, end and code of each band; a step reaches half a step to either side."""
    starts = np.flatnonzero(np.concatenate([[True], codes[1:] != codes[:-1]]))
    ends = np.concatenate([starts[1:], [len(codes)]]) - 1
    bounds = zip(steps[starts].tolist(), steps[ends].tolist(), codes[starts].tolist(), strict=True)
    return [(low - 0.5, high + 0.5, int(code)) for low, high, code in bounds if code >= 0]


def _draw_legend(figure: Figure, recordings: Sequence[Recording], total: float) -> None:
    """Name the actions and the activities that occur."""
    from matplotlib.patches import Patch

    kinds = (("chose:", ACTION_NAMES, colors.ACTION_RGB), ("did:", ACTIVITIES, colors.ACTIVITY_RGB))
    for row, (heading, names, palette) in enumerate(kinds):
        occurring = {int(code) for one in recordings for code in np.unique(_tables(one)[row]) if code >= 0}
        look: dict[str, Any] = {"edgecolor": INK, "linewidth": 0.4}
        handles = [
            Patch(facecolor=hexadecimal(palette[code]), label=names[code].replace("-", " "), **look)
            for code in sorted(occurring)
        ]
        height = (0.57 - 0.3 * row) / total
        figure.text(_LEFT, height, heading, fontsize=9, color=INK, va="center", weight="bold")
        figure.legend(
            handles=handles, loc="center left", bbox_to_anchor=(0.13, height), ncols=max(1, len(handles)),
            frameon=False, fontsize=9, labelcolor=INK, borderaxespad=0, columnspacing=1.4, handlelength=1.3,
        )  # fmt: skip
