"""Figures of evaluations: the one module of this folder that reaches the viewer, and only when something is drawn."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from fireworld.evaluation.paired import Pairing
from fireworld.outcome import METRICS

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw_differences(pairings: Sequence[Pairing], *, title: str) -> Figure:
    """Draw a panel for each metric: every paired difference by scenario, and the mean with its 95 % interval.

    Args:
        pairings: all metrics of all scenarios, and over all.
        title: what is compared.

    Raises:
        ViewError: matplotlib is not installed.
    """
    from fireworld_viewer.pictures.policy_figures import DifferencePanel, draw_paired_differences

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


def save_figure(figure: Figure, path: Path, *, force: bool) -> None:
    """Write a figure as the kind of picture that the file's ending names.

    Raises:
        OutputError: the ending is of no such kind, or the file exists or cannot be written.
    """
    from fireworld_viewer.pictures import figure_files

    figure_files.save_figure(figure, path, force=force)
