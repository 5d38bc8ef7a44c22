"""The figure of two policies: where its points lie, and what their marks say."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from fireworld_viewer import colors
from fireworld_viewer.pictures.differences import (
    BETTER,
    EQUAL,
    WORSE,
    DifferencePanel,
    decided_otherwise,
    draw_difference_map,
    draw_paired_differences,
)
from fireworld_viewer.pictures.figure_files import PAIR_COLORS
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_hex

DIFFERENCES = np.array([2.0, -1.0, 0.0, 4.0])


def panel(*, higher_is_better: bool | None, label: str = "burnt out") -> DifferencePanel:
    estimate = (1.25, -0.5, 3.0)
    lines = {"test-1": (DIFFERENCES, estimate), "over all": (DIFFERENCES, estimate)}
    return DifferencePanel(label=label, unit="buildings", higher_is_better=higher_is_better, lines=lines)


def points(axes: Any) -> dict[str, list[float]]:
    """The differences of the first line by the color of their marks."""
    found: dict[str, list[float]] = {}
    for item in axes.collections:
        first_line = [x for x, y in np.asarray(item.get_offsets()).tolist() if y < 0.5]
        if first_line:
            found[to_hex(item.get_facecolor()[0])] = first_line
    return found


def test_points_have_the_color_of_who_is_better():
    more, less, neither = draw_paired_differences(
        [panel(higher_is_better=True), panel(higher_is_better=False), panel(higher_is_better=None)], title="B against A"
    ).axes
    assert points(more) == {BETTER: [2.0, 4.0], WORSE: [-1.0], EQUAL: [0.0]}
    assert points(less) == {BETTER: [-1.0], WORSE: [2.0, 4.0], EQUAL: [0.0]}
    assert points(neither) == {EQUAL: DIFFERENCES.tolist()}
    titles = [axes.get_title(loc="left") for axes in (more, less, neither)]
    assert titles == ["burnt out (more is better)", "burnt out (less is better)", "burnt out"]


def test_a_line_has_its_scenario_its_mean_and_its_interval():
    (axes,) = draw_paired_differences([panel(higher_is_better=True)], title="B against A").axes
    assert [text.get_text() for text in axes.get_yticklabels()] == ["test-1", "over all"]
    zero, interval, mean, *_ = axes.get_lines()
    assert zero.get_xdata() == [0.0, 0.0]
    assert list(interval.get_xdata()) == [-0.5, 3.0]
    assert list(mean.get_xdata()) == [1.25]
    low, high = axes.get_xlim()
    assert low == -high < -4.0


def test_what_differs_is_shown_by_what_matters(small):
    """Other states have colors, other numbers a light shade, other decisions a line to either target."""
    record = list(small)[12]
    n = len(record.buildings.fieryness)
    codes = record.buildings.fieryness.copy()
    codes[:2] = (8 - codes[0], codes[1])
    target = record.decisions.target.copy()
    target[1] = (target[1] + 1) % n
    other = replace(
        record,
        buildings=replace(record.buildings, fieryness=codes),
        decisions=replace(record.decisions, target=target),
    )
    assert decided_otherwise(record, other) == [1]
    assert decided_otherwise(record, record) == []
    differing = {"building": np.arange(n) < 3, "brigade": np.zeros(3, bool), "civilian": np.zeros(6, bool)}
    axes = draw_difference_map(small.city, record, other, differing).axes[0]
    drawn = next(item for item in axes.collections if isinstance(item, PolyCollection) and item.get_zorder() == 3)
    state, *numbers = [tuple((255 * face[:3]).round().astype(int)) for face in drawn.get_facecolor()]
    assert state in {colors.BETTER_RGB, colors.WORSE_RGB}
    unburnt = np.array(colors.FIERYNESS_RGB[0])
    assert all(np.abs(np.array(shade) - unburnt).max() < 40 for shade in numbers)
    ends = {line.get_color(): (line.get_xdata()[1], line.get_ydata()[1]) for line in axes.lines}
    for color, aim in zip(PAIR_COLORS, (record.decisions.target[1], target[1]), strict=True):
        assert ends[color] == pytest.approx((small.city.center_x_m[aim], small.city.center_y_m[aim]))
    entries = [text.get_text() for text in axes.get_legend().get_texts()]
    assert {"target in A (1)", "target in B (1)", "a number only (2)"} <= set(entries)
