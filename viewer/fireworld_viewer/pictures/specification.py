"""A specification curve: what comes out of each way to do a study, in rising order, and which way that is."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fireworld_viewer.pictures.figure_files import new_figure, open_frame

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw_specification(
    estimates: Sequence[tuple[float, float, float]],
    names: Sequence[str],
    others: Sequence[Sequence[bool]],
    *,
    label: str,
) -> Figure:
    """Draw the curve.

    Args:
        estimates: of each way the mean and the ends of its interval.
        names: of the choices.
        others: of each way, whether it takes the other level of each choice.
        label: what the numbers are.
    """
    order = sorted(range(len(estimates)), key=lambda n: estimates[n])
    mean, low, high = np.array([estimates[n] for n in order]).T
    marks = np.array([others[n] for n in order])
    figure = new_figure(10.0, 3.2 + 0.22 * len(names), dpi=110, paper="white", layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=[3.0, 0.22 * len(names)])
    place = np.arange(len(order))
    above.vlines(place, low, high, color="#8a8f98", linewidth=1.0)
    above.plot(place, mean, "o", color="#3b3f46", markersize=3.5)
    above.axhline(0.0, color="#555555", linewidth=0.8, linestyle=":")
    above.set_ylabel(label, fontsize=9)
    for row in range(len(names)):
        on = place[marks[:, row]]
        below.plot(on, np.full(len(on), row), "|", color="#3b3f46", markersize=6)
        below.axhline(row, color="#dddddd", linewidth=0.5, zorder=0)
    below.set_yticks(range(len(names)), names, fontsize=7)
    below.invert_yaxis()
    below.set_xlabel("readings, by what cooperation adds; marks: not read as fireworld does", fontsize=9)
    for axes in (above, below):
        open_frame(axes)
        axes.tick_params(labelsize=8)
    return figure
