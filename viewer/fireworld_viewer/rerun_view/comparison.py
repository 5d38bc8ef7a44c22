"""Two runs in one city, side by side: /a, /b and, in /diff, which buildings are worse or better off in the second."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import rerun
from numpy.typing import NDArray

from fireworld.records import Recording
from fireworld_viewer import colors
from fireworld_viewer.city_mesh import SHADES_PERCENT, build_mesh
from fireworld_viewer.rerun_view import city_layers
from fireworld_viewer.rerun_view.layers import Layers
from fireworld_viewer.rerun_view.pages import OutcomePage
from fireworld_viewer.rerun_view.plots import log_plot
from fireworld_viewer.rerun_view.run_layers import RunLayers
from fireworld_viewer.story.narration import LogLine
from fireworld_viewer.story.steps import check_same_city, common_steps, compare_damage

MARK_PATH: Final = "/diff/plots/first_difference"
AGREEMENT: Final = ("the same", "buildings the same, something else not", "buildings differ")
"""States of the timeline of two runs."""

_AGREEMENT_RGB: Final = (colors.HEALTHY_RGB, colors.MARK_RGB, colors.WORSE_RGB)
_DIFFERENCE_COLORS: Final = colors.shaded_table(colors.DIFFERENCE_RGB, SHADES_PERCENT)


def log_comparison(
    stream: rerun.RecordingStream,
    first: Recording,
    second: Recording,
    *,
    focus: Sequence[int] = (),
    outcome: OutcomePage | None = None,
) -> None:
    """Send two runs, below /a and /b, and their difference; where they first differ is marked if the outcome is given.

    Raises:
        ViewError: the runs are of different cities, one has no steps, or a building of the focus is unknown.
    """
    check_same_city(first.city, second.city)
    steps, rows_a, rows_b = common_steps(first.steps, second.steps)
    RunLayers(stream, first.city, prefix="/a", name="A", focus=focus).add(first)
    RunLayers(stream, second.city, prefix="/b", name="B", focus=focus).add(second)

    layers = Layers(stream, "/diff", steps)
    mesh = build_mesh(first.city)
    city_layers.log_city(layers, first.city)
    fieryness_a = first.column("/buildings", "fieryness")[rows_a]
    fieryness_b = second.column("/buildings", "fieryness")[rows_b]
    change = compare_damage(fieryness_a, fieryness_b)
    city_layers.log_mesh(layers, mesh, (change + 1).astype(np.uint8), _DIFFERENCE_COLORS)
    city_layers.log_handles(layers, first.city, mesh)
    codes = {"difference": change, "fieryness_a": fieryness_a, "fieryness_b": fieryness_b}
    layers.numbers("city/handles", "Difference", codes)

    counts = np.column_stack([np.count_nonzero(change == sign, axis=1) for sign in (1, -1)]).astype(np.float64)
    log_plot(layers, "plots/buildings", counts, ("worse in B", "better in B"), (colors.WORSE_RGB, colors.BETTER_RGB))
    if outcome is not None:
        _mark_first_difference(layers, outcome, np.any(change != 0, axis=1))


def _mark_first_difference(layers: Layers, outcome: OutcomePage, buildings_differ: NDArray[np.bool_]) -> None:
    """Send a timeline of whether the runs are the same, a mark in the plots and a line in the log."""
    first = outcome.first_step
    states = np.zeros(len(layers.steps), dtype=np.int64)
    if first is not None:
        states[layers.steps >= first] = 1
        states[buildings_differ] = 2
    layers.states("agreement", states, AGREEMENT, _AGREEMENT_RGB)
    if first is None:
        return
    style = rerun.SeriesPoints(
        names=[f"first difference, step {first}"],
        colors=colors.single(colors.MARK_RGB),
        markers="diamond",
        marker_sizes=[6.0],
    )
    layers.static("plots/first_difference", style)
    layers.rows("plots/first_difference", rerun.Scalars.columns(scalars=[0.0]), steps=[first])
    line = LogLine(first, "ERROR", f"first difference: {outcome.first_sentence}", colors.MARK_RGB)
    layers.text("log/first_difference", [line])
