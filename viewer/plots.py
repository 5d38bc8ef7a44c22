"""Curves and lanes: score, reward terms, counts, tanks, chosen temperatures, and what each brigade does."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fireworld.records import ACTIVITIES, Recording
from viewer import colors
from viewer.stage import Stage

SCORES: Final = ("score", "score_now")
COUNTS: Final = ("n_burning", "n_water_damaged", "n_burnt_out")
REWARDS: Final = ("water_damaged", "burning", "burnt_out", "civilians", "total")

_FIERYNESS = colors.FIERYNESS_RGB
_COUNT_RGB: Final = (_FIERYNESS[2], _FIERYNESS[5], (120, 116, 112))
_REWARD_RGB: Final = (_FIERYNESS[5], _FIERYNESS[2], (120, 116, 112), colors.HEALTHY_RGB, (240, 240, 240))
_SCORE_RGB: Final = ((250, 250, 250), (150, 150, 150))


def log_plots(stage: Stage, recording: Recording, focus_index: Sequence[int]) -> None:
    """Send every curve; each plot is one entity with a value per curve.

    Args:
        stage: where to.
        recording: what to plot.
        focus_index: indices of buildings whose temperatures are plotted.
    """
    score, counts, rewards = (
        np.column_stack([np.asarray(recording.column(topic, name), dtype=np.float64) for name in names])
        for topic, names in (("/score", SCORES), ("/score", COUNTS), ("/rewards", REWARDS))
    )
    log_plot(stage, "plots/score", score, ("score", "score by today's rule"), _SCORE_RGB)
    log_plot(stage, "plots/buildings", counts, ("burning", "extinguished", "burnt out"), _COUNT_RGB)
    terms = ("extinguished", "burning", "burnt out", "civilians", "total")
    log_plot(stage, "plots/reward", rewards, terms, _REWARD_RGB)
    tanks = np.asarray(recording.column("/brigades", "tank_litres"), dtype=np.float64)
    names = tuple(f"brigade {index}" for index in range(tanks.shape[1]))
    log_plot(stage, "plots/tanks", tanks, names, _cycle(len(names)))
    if focus_index:
        temperature = recording.column("/buildings", "temperature")[:, list(focus_index)].astype(np.float64)
        names = tuple(f"building {recording.city.building_id[index]}" for index in focus_index)
        log_plot(stage, "plots/focus", temperature, names, _cycle(len(names)))


def log_activities(stage: Stage, recording: Recording) -> None:
    """Send what each brigade does as a lane of colored bands: a row wherever it changes."""
    import rerun

    activity = recording.column("/brigades", "activity")
    style = rerun.StateConfiguration(values=list(ACTIVITIES), colors=colors.packed_table(colors.ACTIVITY_RGB))
    for brigade in range(activity.shape[1]):
        lane = activity[:, brigade]
        changed = np.flatnonzero(np.concatenate([[True], lane[1:] != lane[:-1]]))
        path = f"activity/brigade_{brigade}"
        stage.static(path, style)
        states = rerun.StateChange.columns(state=[ACTIVITIES[code] for code in lane[changed]])
        stage.rows(path, states, steps=stage.steps[changed])


def log_plot(
    stage: Stage, path: str, numbers: NDArray[np.float64], names: tuple[str, ...], rgb: Sequence[colors.Rgb]
) -> None:
    """Send (k, curves) numbers with the curves' names and colors; nothing if there are no curves."""
    import rerun

    rows, width = numbers.shape
    if width == 0:
        return
    stage.static(path, rerun.SeriesLines(names=list(names), colors=colors.packed_table(rgb), widths=[2.0] * width))
    stage.rows(path, rerun.Scalars.columns(scalars=numbers.reshape(-1)).partition(np.full(rows, width)))


def _cycle(n: int) -> list[colors.Rgb]:
    return [colors.BRIGADE_RGB[index % len(colors.BRIGADE_RGB)] for index in range(n)]
