"""A figure of two policies compared: every paired difference, and the interval of their mean."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from fireworld.evaluation.paired import Pairing
from fireworld.kernels.arrays import Array
from fireworld.outcome import METRICS, Metric

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BETTER: Final = "#0072b2"
WORSE: Final = "#d55e00"
EQUAL: Final = "#8a8a8a"
"""Blue, vermilion and grey: told apart by every eye; side and mark say the same."""
_INK: Final = "#222222"
_GOLDEN: Final = 0.6180339887498949
_SPREAD: Final = 0.3
"""Points lie that far above and below their line."""


def draw_differences(pairings: Sequence[Pairing], *, title: str) -> Figure:
    """Draw one panel a metric, one line a scenario: a point for every seed, and the mean with its 95 % interval.

    Args:
        pairings: all metrics of all scenarios, and over all.
        title: what is compared.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    n_lines = len(pairings) // len(METRICS)
    figure = Figure(figsize=(11.0, 2.8 + 1.0 * n_lines), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(2, 2, squeeze=False).ravel()
    for panel, metric in zip(panels, METRICS, strict=True):
        _draw_panel(panel, metric, [pairing for pairing in pairings if pairing.metric == metric])
    figure.suptitle(title, fontsize=12, x=0.01, ha="left")
    figure.supxlabel(
        "a point is a seed: B less A. Blue, upward: B is better; orange, downward: A is; grey: equal. "
        "Black: mean and 95 % interval.",
        fontsize=9,
    )
    return figure


def _draw_panel(panel: Axes, metric: Metric, lines: Sequence[Pairing]) -> None:
    panel.axvline(0.0, color=_INK, linewidth=0.8)
    for place, line in enumerate(lines):
        _draw_points(panel, metric, line.differences, height=place)
        low, high, middle = line.difference.low, line.difference.high, line.difference.mean
        panel.plot([low, high], [place, place], color=_INK, linewidth=2.4, solid_capstyle="butt", zorder=4)
        panel.plot([middle], [place], marker="o", color="white", markeredgecolor=_INK, markersize=7, zorder=5)
    if len(lines) > 1:
        panel.axhline(len(lines) - 1.5, color="#cccccc", linewidth=0.8)
    panel.set_yticks(range(len(lines)), [line.scenario or "over all" for line in lines], fontsize=9)
    panel.set_ylim(len(lines) - 0.4, -0.6)
    widest = max(float(np.abs(line.differences).max()) for line in lines)
    panel.set_xlim(-1.08 * (widest or 1.0), 1.08 * (widest or 1.0))
    wanted = "more is better" if metric.higher_is_better else "less is better"
    panel.set_title(f"{metric.label} ({wanted})", fontsize=10, loc="left")
    panel.set_xlabel(metric.unit, fontsize=8)
    panel.spines[["top", "right"]].set_visible(False)
    panel.tick_params(axis="x", labelsize=8)


def _draw_points(panel: Axes, metric: Metric, differences: Array, *, height: int) -> None:
    """Draw one point a seed, spread evenly over the height of the line in the order of the seeds."""
    heights = height + _SPREAD * (2.0 * (np.arange(len(differences)) * _GOLDEN % 1.0) - 1.0)
    gain = metric.gain(differences)
    for chosen, color, mark in ((gain > 0, BETTER, "^"), (gain < 0, WORSE, "v"), (gain == 0, EQUAL, "o")):
        panel.scatter(differences[chosen], heights[chosen], s=14, color=color, marker=mark, linewidths=0, alpha=0.6)
