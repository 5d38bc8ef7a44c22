"""Convergence graphs of a study: return and policy changes by episode, mean over repetitions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from fireworld.kernels.arrays import Array
from fireworld.reproduction import paper
from fireworld.reproduction.study import TOGETHER, TOGETHER_WITHOUT_FLAGS, LearningCurve, Study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLORS: Final = {TOGETHER: "#1f6feb", TOGETHER_WITHOUT_FLAGS: "#c2571a"}
_PANELS_ACROSS: Final = 4


def draw_returns(study: Study) -> Figure:
    """Draw the return of every episode of Table 1's scenarios."""
    return _draw(study, "return of the episode, in thousands", lambda curve: curve.total_reward / 1000.0)


def draw_policy_changes(study: Study) -> Figure:
    """Draw in how many states the greedy action changed, episode by episode of Table 1's scenarios."""
    return _draw(study, "states whose best action changed", lambda curve: curve.n_changed)


def _draw(study: Study, label: str, of: Callable[[LearningCurve], Array]) -> Figure:
    """One panel a scenario: the mean over the repetitions still in it, and each of them as a thin line."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 5.6), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    rows = -(-len(paper.TABLE_1) // _PANELS_ACROSS)
    panels = figure.subplots(rows, _PANELS_ACROSS, sharex=True, squeeze=False).ravel()
    for panel, row in zip(panels, paper.TABLE_1, strict=False):
        for team, color in COLORS.items():
            curves = [of(curve) for curve in study.curves_of(team, row.scenario)]
            for curve in curves:
                panel.plot(curve, color=color, linewidth=0.5, alpha=0.25)
            panel.plot(_mean_curve(curves), color=color, linewidth=1.8, label=team)
        panel.axvline(row.convergence_episode, color="#555555", linewidth=1.0, linestyle=":", label="paper converged")
        panel.set_title(row.scenario, fontsize=10, loc="left")
        panel.spines[["top", "right"]].set_visible(False)
        panel.tick_params(labelsize=8)
    panels[0].legend(fontsize=8, frameon=False)
    figure.supxlabel("episode", fontsize=10)
    figure.supylabel(label, fontsize=10)
    return figure


def _mean_curve(curves: Sequence[Array]) -> Array:
    """Return the mean over the repetitions that are still in the scenario: (longest,)."""
    longest = max(len(curve) for curve in curves)
    padded = np.full((len(curves), longest), np.nan)
    for row, curve in zip(padded, curves, strict=True):
        row[: len(curve)] = curve
    means: Array = np.nanmean(padded, axis=0)
    return means
