"""Curves in Rerun: score, reward terms, counts, tanks, values of choices, temperatures of chosen buildings."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import rerun
from numpy.typing import NDArray

from fireworld.records import Recording
from fireworld_viewer import colors
from fireworld_viewer.rerun_view.layers import Layers
from fireworld_viewer.story.series import LABELS, REWARD_TERMS, choices_of, recorded, series

SCORES: Final = {"score": "score.score", "score_now": "score.score_now"}
COUNTS: Final = {"burning": "score.n_burning", "burnt_out": "score.n_burnt_out", "watered": "score.n_water_damaged"}
"""Fields by the path of their plot: a curve each, so that two runs can be laid over each other curve by curve."""
REWARDS: Final = (*REWARD_TERMS, "rewards.total")
N_FOCUS: Final = 4

_FIERYNESS = colors.FIERYNESS_RGB
_COUNT_RGB: Final = (_FIERYNESS[2], colors.GREY_RGB, _FIERYNESS[5])
_REWARD_RGB: Final = (_FIERYNESS[5], _FIERYNESS[2], colors.GREY_RGB, colors.REFUGE_RGB, colors.TOTAL_RGB)
_SCORE_RGB: Final = (colors.TOTAL_RGB, colors.TOTAL_RGB)
_MARGIN_SHARE: Final = 0.08
_LEAST_SHARE: Final = 1e-3


def log_plots(layers: Layers, recording: Recording, focus_index: Sequence[int]) -> None:
    """Send every curve. Temperatures are those of the focus."""
    for fields, rgb in ((SCORES, _SCORE_RGB), (COUNTS, _COUNT_RGB)):
        for (path, field), own in zip(fields.items(), rgb, strict=True):
            if recorded(recording, field):
                shown = own if not layers.name else colors.RUN_RGB["AB".index(layers.name)]
                numbers = series(recording, field)[:, np.newaxis]
                log_plot(layers, f"plots/{path}", numbers, [layers.name or LABELS[field]], [shown])
    if recorded(recording, "rewards"):
        terms_rgb = _of_run(layers, _REWARD_RGB)
        numbers = np.column_stack([series(recording, field) for field in REWARDS])
        log_plot(layers, "plots/reward", numbers, [LABELS[field] for field in REWARDS], terms_rgb)
        _log_stacked_rewards(layers, recording, terms_rgb)
    tanks = series(recording, "brigades.tank_litres")
    names = [f"brigade {index}" for index in range(tanks.shape[1])]
    log_plot(layers, "plots/tanks", tanks, names, _of_run(layers, _cycle(len(names))))
    log_choice_values(layers, recording)
    temperature = series(recording, "buildings.temperature")[:, list(focus_index)]
    names = [f"building {recording.city.building_id[index]}" for index in focus_index]
    log_plot(layers, "plots/focus", temperature, names, _of_run(layers, _cycle(len(names))))


def scale_of(recordings: Sequence[Recording], field: str) -> tuple[float, float]:
    """Return the ends of the axis of a field: what it is in any of the runs, and a little more to either side."""
    every = np.concatenate([series(one, field) for one in recordings])
    low, high = float(every.min(initial=np.inf)), float(every.max(initial=-np.inf))
    margin = max(_MARGIN_SHARE * (high - low), _LEAST_SHARE * max(1.0, abs(high)))
    return low - margin, high + margin


def _log_stacked_rewards(layers: Layers, recording: Recording, rgb: Sequence[colors.Rgb]) -> None:
    """Send the terms of the reward one upon the other."""
    stacked = np.cumsum(np.column_stack([series(recording, term) for term in REWARD_TERMS]), axis=1)
    first, *others = (LABELS[term] for term in REWARD_TERMS)
    log_plot(layers, "plots/reward_stacked", stacked, [first, *(f"and {one}" for one in others)], rgb[:-1])


def log_choice_values(layers: Layers, recording: Recording) -> None:
    """Plot for each brigade the value of what it chose and, as a thin line, that of the best of the paper's actions.

    Both have one name: the legend has a row for what has one.
    There is nothing at steps without a choice, and no plot of a policy that has no values.
    """
    choices = choices_of(recording)
    best = np.max(choices.action_values, axis=2)
    for brigade, rgb in enumerate(_of_run(layers, _cycle(best.shape[1]))):
        name, path, pale = f"brigade {brigade}", f"brigade_{brigade}", colors.paler(rgb)
        log_curve(layers, f"plots/values/{path}", choices.value[:, brigade], name, rgb, width=2.5)
        log_curve(layers, f"plots/values_best/{path}", best[:, brigade], name, pale, width=1.0)


def has_choice_values(recording: Recording) -> bool:
    """Return whether there is a plot of the values of choices."""
    return not bool(np.all(np.isnan(choices_of(recording).value)))


def first_burning(recording: Recording, n: int = N_FOCUS) -> list[int]:
    """Return the ids of the `n` buildings that burn first: what to plot where none are named."""
    burning = np.isin(recording.column("/buildings", "fieryness"), (1, 2, 3))
    touched = np.flatnonzero(burning.any(axis=0))
    order = touched[np.argsort(burning[:, touched].argmax(axis=0), kind="stable")][:n]
    return [int(identifier) for identifier in np.asarray(recording.city.building_id)[np.sort(order)]]


def log_plot(
    layers: Layers, path: str, numbers: NDArray[np.float64], names: Sequence[str], rgb: Sequence[colors.Rgb]
) -> None:
    """Send (k, curves) numbers with the curves' names and colors; nothing if there are no curves.

    Several curves of B are thinner than those of A; the legend has one row for curves of one name.
    """
    rows, width = numbers.shape
    if width == 0:
        return
    widths = [1.3 if layers.name == "B" and width > 1 else 2.0] * width
    layers.static(path, rerun.SeriesLines(names=list(names), colors=colors.packed_table(rgb), widths=widths))
    if rows:
        layers.rows(path, rerun.Scalars.columns(scalars=numbers.reshape(-1)).partition(np.full(rows, width)))


def log_curve(
    layers: Layers, path: str, numbers: NDArray[np.float64], name: str, rgb: colors.Rgb, *, width: float
) -> None:
    """Send one curve, (k,), with a gap where it is not a number; nothing if there never was one."""
    known = ~np.isnan(numbers)
    if not known.any() and not layers.has(path):
        return
    layers.static(path, rerun.SeriesLines(names=[name], colors=colors.single(rgb), widths=[width]))
    layers.rows(path, rerun.Scalars.columns(scalars=numbers[known]).partition(known.astype(np.int64)))


def _of_run(layers: Layers, rgb: Sequence[colors.Rgb]) -> list[colors.Rgb]:
    """Make the colors of the second of two runs paler."""
    return [colors.paler(one) if layers.name == "B" else one for one in rgb]


def _cycle(n: int) -> list[colors.Rgb]:
    return [colors.BRIGADE_RGB[index % len(colors.BRIGADE_RGB)] for index in range(n)]
