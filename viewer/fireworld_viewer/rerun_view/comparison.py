"""Two runs in one city, side by side: /a, /b and, in /diff, which buildings fare worse or better in the second."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from fireworld.errors import ViewError, expected
from fireworld.records import CityRecord, Recording
from fireworld_viewer import colors
from fireworld_viewer.city_mesh import SHADES_PERCENT, build_mesh
from fireworld_viewer.rerun_view import mapping
from fireworld_viewer.rerun_view.activity_lanes import log_lane
from fireworld_viewer.rerun_view.layers import Stage, values
from fireworld_viewer.rerun_view.outcome_panel import Outcome
from fireworld_viewer.rerun_view.plots import log_plot

if TYPE_CHECKING:
    import rerun

DAMAGE_ORDER: Final = (0, 4, 5, 1, 6, 2, 7, 3, 8)
"""Fieryness codes from the least damage to the most: by the official score's factors; 8 comes after 3, both count 0."""

MARK_PATH: Final = "/diff/plots/first_difference"
AGREEMENT: Final = ("the same", "buildings the same, something else not", "buildings differ")
"""What the lane of two runs says of a step."""

_AGREEMENT_RGB: Final = (colors.HEALTHY_RGB, colors.MARK_RGB, colors.WORSE_RGB)
_DAMAGE: Final = np.argsort(np.array(DAMAGE_ORDER)).astype(np.int8)  # code to its place in the order
_DIFFERENCE_COLORS: Final = colors.shaded_table(colors.DIFFERENCE_RGB, SHADES_PERCENT)


def log_comparison(
    stream: rerun.RecordingStream,
    first: Recording,
    second: Recording,
    *,
    focus: Sequence[int] = (),
    outcome: Outcome | None = None,
) -> None:
    """Send two runs and their difference to one Rerun stream, on one `step` timeline.

    Args:
        stream: where to.
        first: shown below /a.
        second: shown below /b.
        focus: ids of buildings whose temperatures are plotted.
        outcome: where they first differ is marked, if it is told.

    Raises:
        ViewError: the runs are of different cities, or have no steps in common.
    """
    check_same_city(first.city, second.city)
    steps, rows_a, rows_b = common_steps(first.steps, second.steps)
    mapping.log_recording(stream, first, prefix="/a", name="A", focus=focus)
    mapping.log_recording(stream, second, prefix="/b", name="B", focus=focus)

    stage = Stage(stream, "/diff", steps)
    mesh = build_mesh(first.city)
    mapping.log_city(stage, first.city)
    fieryness_a = first.column("/buildings", "fieryness")[rows_a]
    fieryness_b = second.column("/buildings", "fieryness")[rows_b]
    change = difference(fieryness_a, fieryness_b)
    mapping.log_mesh(stage, mesh, (change + 1).astype(np.uint8), _DIFFERENCE_COLORS)
    mapping.log_handles(stage, first.city, mesh)
    codes = {"difference": change, "fieryness_a": fieryness_a, "fieryness_b": fieryness_b}
    for block in stage.blocks(3 * change.shape[1]):
        part = {name: numbers[block] for name, numbers in codes.items()}
        stage.rows("city/handles", values("Difference", part), steps=stage.steps[block])

    counts = np.column_stack([np.count_nonzero(change == sign, axis=1) for sign in (1, -1)]).astype(np.float64)
    log_plot(stage, "plots/buildings", counts, ("worse in B", "better in B"), (colors.WORSE_RGB, colors.BETTER_RGB))
    if outcome is not None:
        _mark_first_difference(stage, outcome, np.any(change != 0, axis=1))


def _mark_first_difference(stage: Stage, outcome: Outcome, buildings_differ: NDArray[np.bool_]) -> None:
    """Send a lane that says from where the runs differ, a mark in the plots and a line in the log."""
    import rerun

    differs = np.zeros(len(stage.steps), dtype=np.int64)
    if outcome.first_step is not None:
        differs[stage.steps >= outcome.first_step] = 1
        differs[buildings_differ] = 2
    log_lane(stage, "agreement", differs, AGREEMENT, _AGREEMENT_RGB)
    if outcome.first_step is None:
        return
    at = np.array([outcome.first_step], dtype=np.int64)
    style = rerun.SeriesPoints(
        names=[f"first difference, step {outcome.first_step}"],
        colors=colors.single(colors.MARK_RGB),
        markers="diamond",
        marker_sizes=[6.0],
    )
    stage.static("plots/first_difference", style)
    stage.rows("plots/first_difference", rerun.Scalars.columns(scalars=[0.0]), steps=at)
    said = f"first difference: {outcome.first_sentence}"
    line = rerun.TextLog.columns(text=[said], level=["ERROR"], color=colors.single(colors.MARK_RGB))
    stage.rows("log/first_difference", line, steps=at)


def difference(fieryness_a: NDArray[np.uint8], fieryness_b: NDArray[np.uint8]) -> NDArray[np.int8]:
    """Compare codes: -1 where the second run has less damage, 1 where it has more, 0 where the codes are equal."""
    signs: NDArray[np.int8] = np.sign(_DAMAGE[fieryness_b] - _DAMAGE[fieryness_a])
    return signs


def common_steps(
    steps_a: NDArray[np.int64], steps_b: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.intp], NDArray[np.intp]]:
    """Align two runs: every step of either from where both have begun; a run that has ended keeps its last state.

    Returns:
        steps, (k,), and the row of each run that holds the state of that step.

    Raises:
        ViewError: a run has no steps.
    """
    if len(steps_a) == 0 or len(steps_b) == 0:
        raise ViewError(expected("view", "", "two recordings with steps", f"{len(steps_a)} and {len(steps_b)} steps"))
    steps = np.union1d(steps_a, steps_b)
    steps = steps[steps >= max(steps_a[0], steps_b[0])]
    rows_a, rows_b = (np.searchsorted(own, steps, side="right") - 1 for own in (steps_a, steps_b))
    return steps, rows_a, rows_b


def check_same_city(first: CityRecord, second: CityRecord) -> None:
    """Refuse to compare runs of cities that differ in any building.

    Raises:
        ViewError: names the cities and what differs.
    """
    for name in ("building_id", "outline_ptr", "outline_x_m", "outline_y_m", "floors"):
        if not np.array_equal(getattr(first, name), getattr(second, name)):
            cities = f"{first.name!r} with {len(first.building_id)} buildings"
            others = f"{second.name!r} with {len(second.building_id)}"
            hint = f"{name} differs; try to view them one by one"
            raise ViewError(expected("view", "", "two recordings of one city", f"{cities} and {others}", hint))
