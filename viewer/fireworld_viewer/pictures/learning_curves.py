"""Learning curves: a panel for each scenario, with the mean over repetitions, and each repetition as a thin line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fireworld.records import Array
from fireworld_viewer.pictures.figure_files import PAIR_COLORS, new_figure, open_frame

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_PANELS_ACROSS: Final = 4


@dataclass(frozen=True, kw_only=True)
class LearningPanel:
    """What one panel shows."""

    title: str
    curves: Mapping[str, Sequence[Array]]
    """By team, one or two: (episodes,) numbers of each repetition; repetitions may differ in length."""
    marked_episode: float  # where a dotted line stands


def draw_learning_curves(panels: Sequence[LearningPanel], *, label: str, mark: str) -> Figure:
    """Draw the panels in rows of four; the label is that of the numbers, the mark that of the dotted lines.

    Raises:
        ViewError: matplotlib is not installed.
    """
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
    padded = np.full((len(repetitions), max(map(len, repetitions))), np.nan)
    for row, curve in zip(padded, repetitions, strict=True):
        row[: len(curve)] = curve
    means: Array = np.nanmean(padded, axis=0)
    return means
