"""Curves: score, reward terms, counts, tanks, values of choices and temperatures of chosen buildings."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fireworld.records import Recording
from fireworld_viewer import colors
from fireworld_viewer.rerun_view.layers import Stage
from fireworld_viewer.story.choices import choices_of

SCORES: Final = ("score", "score_now")
COUNTS: Final = ("n_burning", "n_water_damaged", "n_burnt_out")
REWARDS: Final = ("water_damaged", "burning", "burnt_out", "civilians", "total")
BURNING: Final = (1, 2, 3)
N_FOCUS: Final = 4
_TERMS: Final = ("water-damaged", "burning", "burnt out", "civilians")

_FIERYNESS = colors.FIERYNESS_RGB
_COUNT_RGB: Final = (_FIERYNESS[2], _FIERYNESS[5], colors.GREY_RGB)
_REWARD_RGB: Final = (_FIERYNESS[5], _FIERYNESS[2], colors.GREY_RGB, colors.REFUGE_RGB, colors.TOTAL_RGB)
_SCORE_RGB: Final = {
    "": (colors.BRIGADE_RGB[0], colors.GREY_RGB),
    "A": (colors.BRIGADE_RGB[0], colors.paler(colors.BRIGADE_RGB[0])),
    "B": (colors.BRIGADE_RGB[1], colors.paler(colors.BRIGADE_RGB[1])),
}
"""By the name of the run."""


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
    log_plot(stage, "plots/score", score, ("score", "score by today's rule"), _SCORE_RGB[stage.name])
    count_rgb, reward_rgb = _of_run(stage, _COUNT_RGB), _of_run(stage, _REWARD_RGB)
    log_plot(stage, "plots/buildings", counts, ("burning", "water-damaged", "burnt out"), count_rgb)
    log_plot(stage, "plots/reward", rewards, (*_TERMS, "total"), reward_rgb)
    stacked = np.cumsum(rewards[:, : len(_TERMS)], axis=1)
    sums = (_TERMS[0], *(f"and {term}" for term in _TERMS[1:]))
    log_plot(stage, "plots/reward_stacked", stacked, sums, reward_rgb[: len(_TERMS)])
    tanks = np.asarray(recording.column("/brigades", "tank_litres"), dtype=np.float64)
    names = tuple(f"brigade {index}" for index in range(tanks.shape[1]))
    log_plot(stage, "plots/tanks", tanks, names, _of_run(stage, _cycle(len(names))))
    log_choice_values(stage, recording)
    if focus_index:
        temperature = recording.column("/buildings", "temperature")[:, list(focus_index)].astype(np.float64)
        names = tuple(f"building {recording.city.building_id[index]}" for index in focus_index)
        log_plot(stage, "plots/focus", temperature, names, _of_run(stage, _cycle(len(names))))


def log_choice_values(stage: Stage, recording: Recording) -> None:
    """Plot for each brigade the value of what it chose and, as a thin line, that of the best of the paper's actions.

    There is nothing at steps without a choice, and no plot of a policy that has no values.
    """
    chosen = choices_of(recording)
    best = np.max(chosen.values, axis=2)
    for brigade, rgb in enumerate(_of_run(stage, _cycle(best.shape[1]))):
        name = f"brigade {brigade}"
        log_curve(stage, f"plots/values/brigade_{brigade}", chosen.chosen[:, brigade], name, rgb, width=2.5)
        path, name = f"plots/values_best/brigade_{brigade}", f"{name}, best action"
        log_curve(stage, path, best[:, brigade], name, colors.paler(rgb), width=1.0)


def has_choice_values(recording: Recording) -> bool:
    """Whether there is a plot of the values of choices."""
    return not bool(np.all(np.isnan(choices_of(recording).chosen)))


def first_burning(recording: Recording, n: int = N_FOCUS) -> list[int]:
    """Return the ids of the `n` buildings that burn first: what to plot where nobody says."""
    burning = np.isin(recording.column("/buildings", "fieryness"), BURNING)
    touched = np.flatnonzero(burning.any(axis=0))
    order = touched[np.argsort(burning[:, touched].argmax(axis=0), kind="stable")][:n]
    return [int(identifier) for identifier in np.asarray(recording.city.building_id)[np.sort(order)]]


def log_plot(
    stage: Stage, path: str, numbers: NDArray[np.float64], names: Sequence[str], rgb: Sequence[colors.Rgb]
) -> None:
    """Send (k, curves) numbers with the curves' names and colors; nothing if there are no curves.

    Beside another run the curves bear the run's name, and those of B are thinner.
    """
    import rerun

    rows, width = numbers.shape
    if width == 0:
        return
    widths = [1.3 if stage.name == "B" else 2.0] * width
    named = [f"{stage.name} {name}".strip() for name in names]
    stage.static(path, rerun.SeriesLines(names=named, colors=colors.packed_table(rgb), widths=widths))
    if rows:
        stage.rows(path, rerun.Scalars.columns(scalars=numbers.reshape(-1)).partition(np.full(rows, width)))


def log_curve(
    stage: Stage, path: str, numbers: NDArray[np.float64], name: str, rgb: colors.Rgb, *, width: float
) -> None:
    """Send one curve, (k,), with a gap where it is not a number; nothing if there never was one."""
    import rerun

    known = ~np.isnan(numbers)
    if not known.any() and not stage.has(path):
        return
    named = [f"{stage.name} {name}".strip()]
    stage.static(path, rerun.SeriesLines(names=named, colors=colors.single(rgb), widths=[width]))
    stage.rows(path, rerun.Scalars.columns(scalars=numbers[known]).partition(known.astype(np.int64)))


def _of_run(stage: Stage, rgb: Sequence[colors.Rgb]) -> list[colors.Rgb]:
    """Make the colors of the second of two runs paler."""
    return [colors.paler(one) if stage.name == "B" else one for one in rgb]


def _cycle(n: int) -> list[colors.Rgb]:
    return [colors.BRIGADE_RGB[index % len(colors.BRIGADE_RGB)] for index in range(n)]
