"""The table of colors: packed as Rerun wants them, and health colored by what is left of it."""

from __future__ import annotations

import numpy as np
import pytest
from fireworld_viewer import colors
from fireworld_viewer.rerun_view import plots
from fireworld_viewer.story import narration

from fireworld.records import ACTIVITIES, FIERYNESS


def test_every_code_and_activity_has_a_color_of_its_own():
    assert len(colors.FIERYNESS_RGB) == len(set(colors.FIERYNESS_RGB)) == len(FIERYNESS)
    assert len(colors.ACTIVITY_RGB) == len(set(colors.ACTIVITY_RGB)) == len(ACTIVITIES)
    assert colors.REFUGE_RGB not in colors.FIERYNESS_RGB


def test_packed_is_red_green_blue_and_opaque():
    assert colors.single((1, 2, 3)).tolist() == [0x010203FF]
    assert colors.packed_table(((1, 2, 3), (255, 0, 16))).tolist() == [0x010203FF, 0xFF0010FF]


def test_shades_darken_each_part_and_keep_it_opaque():
    table = colors.shaded_table(((200, 100, 50),), (100, 50))
    assert table.tolist() == [[0xC86432FF, 0x643219FF]]


@pytest.mark.parametrize(
    ("hp", "rgb"),
    [(1000, colors.HEALTHY_RGB), (500, colors.HURT_RGB), (1, colors.DYING_RGB), (0, colors.DEAD_RGB)],
)
def test_health_runs_from_green_over_white_to_magenta_and_the_dead_are_black(hp: int, rgb: colors.Rgb):
    shown = colors.health_rgb(np.array([[hp]]), np.array([1000]))
    assert shown.shape == (1, 1, 3)
    assert np.abs(shown[0, 0].astype(int) - rgb).max() <= 2


def test_health_follows_each_persons_own_start():
    shown = colors.health_rgb(np.array([500, 500]), np.array([500, 1000]))
    assert tuple(shown[0]) == colors.HEALTHY_RGB
    assert tuple(shown[1]) == pytest.approx(colors.HURT_RGB, abs=2)


def luminance(rgb: colors.Rgb) -> float:
    """Relative luminance of an sRGB color, 0 to 1 (WCAG 2)."""
    parts = np.array(rgb) / 255
    linear = np.where(parts <= 0.03928, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
    return float(linear @ (0.2126, 0.7152, 0.0722))


def contrast(one: colors.Rgb, other: colors.Rgb) -> float:
    """Contrast of two colors, 1 to 21 (WCAG 2)."""
    dark, light = sorted((luminance(one), luminance(other)))
    return (light + 0.05) / (dark + 0.05)


def test_two_runs_have_colors_that_mean_nothing_else():
    """Blue is water, yellow to red is fire; better and worse are not colors of a run."""
    others = {
        *colors.FIERYNESS_RGB, *colors.ACTIVITY_RGB, *colors.HEALTH_RGB, colors.WATER_RGB, colors.REFUGE_RGB,
        *colors.DIFFERENCE_RGB, colors.DIFFERS_RGB,
    }  # fmt: skip
    assert not others & {*colors.RUN_RGB}
    assert not {colors.BETTER_RGB, colors.WORSE_RGB} & {*colors.FIERYNESS_RGB, *colors.ACTIVITY_RGB, colors.WATER_RGB}


def test_curves_and_logs_are_to_be_read_on_black_and_on_white():
    events = [rgb for *_, rgb in narration._EVENT_LINES.values()]
    single_run = [*colors.BRIGADE_RGB, *plots._COUNT_RGB, *plots._REWARD_RGB]
    scores = [*plots._SCORE_RGB, *colors.RUN_RGB]
    for rgb in (*events, *single_run, *map(colors.paler, single_run), *scores):
        assert contrast(rgb, (255, 255, 255)) > 2.2, rgb
        assert contrast(rgb, (13, 16, 17)) > 2.2, rgb  # Rerun's dark background
