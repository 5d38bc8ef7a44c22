"""The figure of two policies: where its points lie, and what their marks say."""

from __future__ import annotations

from typing import Any

import numpy as np
from fireworld_viewer.pictures.differences import (
    BETTER,
    EQUAL,
    WORSE,
    DifferencePanel,
    draw_paired_differences,
)
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
