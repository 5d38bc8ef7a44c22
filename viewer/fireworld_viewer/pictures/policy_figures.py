"""Figures of policies: two compared seed by seed, and how teams learned."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import TYPE_CHECKING, Final

import numpy as np

from fireworld.records import Array
from fireworld_viewer.pictures.figure_files import PAIR_COLORS, new_figure, open_frame

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BETTER: Final = "#0072b2"
WORSE: Final = "#d55e00"
EQUAL: Final = "#8a8a8a"
"""Blue, vermilion and grey: every eye can distinguish them; side and mark say the same."""
_INK: Final = "#222222"
_GOLDEN: Final = 0.6180339887498949
_SPREAD: Final = 0.3  # points lie that far above and below their line
_PANELS_ACROSS: Final = 4  # of learning curves
_DIRECTIONS: Final = {True: (1, " (more is better)"), False: (-1, " (less is better)"), None: (0, "")}


@dataclass(frozen=True, kw_only=True)
class DifferencePanel:
    """One quantity."""

    label: str
    unit: str
    higher_is_better: bool | None  # None: neither is better
    lines: Mapping[str, tuple[Array, Sequence[float]]]
    """By scenario, the last over all if there are several: (seeds,) B - A; its mean, and the ends of its interval."""


def draw_paired_differences(panels: Sequence[DifferencePanel], *, title: str) -> Figure:
    """Draw a panel for each quantity, two in a row: a point for every seed, and the mean with its 95 % interval."""
    n_rows = -(-len(panels) // 2)
    height = n_rows * (1.4 + 0.5 * len(panels[0].lines))
    figure = new_figure(11.0, height, paper="white", layout="constrained")
    grid = figure.subplots(n_rows, 2, squeeze=False).ravel()
    for axes, panel in zip(grid, panels, strict=False):
        _draw_panel(axes, panel)
    for axes in grid[len(panels) :]:
        axes.remove()
    figure.suptitle(title, fontsize=12, x=0.01, ha="left")
    figure.supxlabel(
        "a point is a seed: B - A. Blue, upward: B is better; orange, downward: A is; grey: equal. "
        "Black: mean and 95 % interval.",
        fontsize=9,
    )
    return figure


def _draw_panel(axes: Axes, panel: DifferencePanel) -> None:
    sign, direction = _DIRECTIONS[panel.higher_is_better]
    axes.axvline(0.0, color=_INK, linewidth=0.8)
    for place, (differences, (mean, low, high)) in enumerate(panel.lines.values()):
        # One point a seed, spread evenly over the height of the line in the order of the seeds.
        heights = place + _SPREAD * (2.0 * (np.arange(len(differences)) * _GOLDEN % 1.0) - 1.0)
        gain = sign * differences
        for chosen, color, mark in ((gain > 0, BETTER, "^"), (gain < 0, WORSE, "v"), (gain == 0, EQUAL, "o")):
            x, y = differences[chosen], heights[chosen]
            axes.scatter(x, y, s=14, color=color, marker=mark, linewidths=0, alpha=0.6)
        axes.plot([low, high], [place, place], color=_INK, linewidth=2.4, solid_capstyle="butt", zorder=4)
        axes.plot([mean], [place], marker="o", color="white", markeredgecolor=_INK, markersize=7, zorder=5)
    n = len(panel.lines)
    if n > 1:
        axes.axhline(n - 1.5, color="#cccccc", linewidth=0.8)
    axes.set_yticks(range(n), list(panel.lines), fontsize=9)
    axes.set_ylim(n - 0.4, -0.6)
    widest = max(float(np.abs(differences).max()) for differences, _ in panel.lines.values())
    axes.set_xlim(-1.08 * (widest or 1.0), 1.08 * (widest or 1.0))
    axes.set_title(f"{panel.label}{direction}", fontsize=10, loc="left")
    axes.set_xlabel(panel.unit, fontsize=8)
    open_frame(axes)
    axes.tick_params(axis="x", labelsize=8)


@dataclass(frozen=True, kw_only=True)
class LearningPanel:
    """What one panel shows."""

    title: str
    curves: Mapping[str, Sequence[Array]]
    """By team, one or two: (episodes,) numbers of each repetition; repetitions may differ in length."""
    marked_episode: float  # where a dotted line stands


def draw_learning_curves(panels: Sequence[LearningPanel], *, label: str, mark: str) -> Figure:
    """Draw the panels in rows of four; the label is that of the numbers, the mark that of the dotted lines."""
    figure = new_figure(12.0, 5.6, dpi=110, paper="white", layout="constrained")
    grid = figure.subplots(-(-len(panels) // _PANELS_ACROSS), _PANELS_ACROSS, sharex=True, squeeze=False).ravel()
    for axes, panel in zip(grid, panels, strict=False):
        for (team, repetitions), color in zip(panel.curves.items(), PAIR_COLORS, strict=False):
            for curve in repetitions:
                axes.plot(curve, color=color, linewidth=0.5, alpha=0.25)
            axes.plot(_mean_curve(repetitions), color=color, linewidth=1.8, label=team)
        axes.axvline(panel.marked_episode, color="#555555", linewidth=1.0, linestyle=":", label=mark)
        axes.set_title(panel.title, fontsize=10, loc="left")
        open_frame(axes)
        axes.tick_params(labelsize=8)
    grid[0].legend(fontsize=8, frameon=False)
    figure.supxlabel("episode", fontsize=10)
    figure.supylabel(label, fontsize=10)
    return figure


def _mean_curve(repetitions: Sequence[Array]) -> Array:
    """Return the mean over the repetitions that last as long: (longest,)."""
    longest = np.array([*zip_longest(*repetitions, fillvalue=np.nan)], order="F").T
    means: Array = np.nanmean(longest, axis=0)
    return means
