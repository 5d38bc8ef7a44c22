"""Figures of evaluations: the one module of this folder that reaches the viewer, and only when something is drawn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from fireworld_viewer.pictures.figure_files import save_figure
from fireworld_viewer.pictures.policy_figures import DifferencePanel, draw_paired_differences

from fireworld.evaluation.paired import Pairing
from fireworld.outcome import METRICS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw_differences", "save_figure"]


def draw_differences(pairings: Sequence[Pairing], *, title: str) -> Figure:
    """Draw a panel for each metric: every paired difference by scenario, and the mean with its 95 % interval.

    Args:
        pairings: all metrics of all scenarios, and over all.
        title: what is compared.

    Raises:
        ViewError: matplotlib is not installed.
    """
    panels = [
        DifferencePanel(
            label=metric.label,
            unit=metric.unit,
            higher_is_better=metric.higher_is_better,
            lines={
                one.scenario or "over all": (one.differences, (found.mean, found.low, found.high))
                for one in pairings
                if one.metric == metric
                for found in [one.difference]
            },
        )
        for metric in METRICS
    ]
    return draw_paired_differences(panels, title=title)
