"""Outlines that cross or touch themselves: every way to do it, the two ways of finding out, and long outlines."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fireworld.city import crossings
from fireworld.city.crossings import crosses_itself, crossing_outlines
from tests.city.plans import rectangle


@pytest.mark.parametrize(
    ("outline", "crosses"),
    [
        (rectangle(0, 0, 5, 4), False),
        ([(0, 0), (3, 0), (9, 0), (9, 9), (0, 9)], False),  # a corner in the middle of a straight wall
        ([(0, 0), (9, 0), (9, 9), (6, 9), (6, 3), (3, 3), (3, 9), (0, 9)], False),
        ([(0, 0), (10, 10), (10, 0), (0, 9)], True),  # two walls cross
        ([(0, 0), (4, 0), (4, 4), (8, 4), (8, 8), (4, 8), (4, 4), (0, 4)], True),  # a corner twice
        ([(0, 0), (8, 0), (8, 8), (4, 0), (0, 8)], True),  # a corner on a wall
        ([(0, 0), (8, 0), (8, 8), (8, 3), (5, 3)], True),  # a wall on another
        ([(0, 0), (9, 0), (5, 0), (5, 5)], True),  # back along itself
        ([(0, 4), (4, 0), (8, 4), (4, 0), (0, 8)], True),
    ],
)
def test_by_hand(outline, crosses):
    for turned in (outline, outline[::-1], outline[2:] + outline[:2], [(y, x) for x, y in outline]):
        assert crosses_itself(turned) == crosses


@settings(max_examples=300)
@given(st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6)), min_size=3, max_size=9))
def test_the_sweep_says_what_shapely_says(corners):
    outline = [corner for k, corner in enumerate(corners) if corner != corners[k - 1]]
    if len(set(outline)) < 3:
        return
    ptr, listed = np.array([0, len(outline)], dtype=np.int32), np.array(outline, dtype=np.int32)
    assert crossing_outlines(ptr, listed).tolist() == [crosses_itself(outline)]


def test_each_outline_is_judged_on_its_own(monkeypatch):
    outlines = [rectangle(0, 0, 9, 9), [(0, 0), (10, 10), (10, 0), (0, 9)], rectangle(0, 0, 9, 9)]
    ptr = np.cumsum([0, *map(len, outlines)]).astype(np.int32)
    corners = np.array([corner for outline in outlines for corner in outline], dtype=np.int32)
    assert crossing_outlines(ptr, corners).tolist() == [False, True, False]
    monkeypatch.setattr(crossings, "SHORT_OUTLINE", 3)
    assert crossing_outlines(ptr, corners).tolist() == [False, True, False]


def star(n_corners):
    """A star of long thin rays: every wall is in the way of every other's box."""
    angle = np.arange(n_corners) * (2 * np.pi / n_corners)
    reach = np.where(np.arange(n_corners) % 2, 900_000_000, 40_000_000)
    return [(int(x), int(y)) for x, y in zip(reach * np.cos(angle), reach * np.sin(angle), strict=True)]


def test_twenty_thousand_corners_are_no_quadratic_number_of_pairs(monkeypatch):
    asked = 0
    turn = crossings._turn

    def counted(*corners):
        nonlocal asked
        asked += 1
        return turn(*corners)

    monkeypatch.setattr(crossings, "_turn", counted)
    outline = star(20_000)
    assert not crosses_itself(outline)
    assert asked < 40 * len(outline)
    assert crosses_itself([*outline, (0, 0), (0, 950_000_000)])
