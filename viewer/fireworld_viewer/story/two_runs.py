"""Two runs in one city: whether they can be compared, their steps aligned, and which buildings are worse off."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from fireworld.errors import ViewError, expected
from fireworld.records import CityRecord

DAMAGE_ORDER: Final = (0, 4, 5, 1, 6, 2, 7, 3, 8)
"""Fieryness codes from the least damage to the most: by the official score's factors; 8 comes after 3, both count 0."""

_DAMAGE: Final = np.argsort(np.array(DAMAGE_ORDER)).astype(np.int8)  # (9,) place of each code in that order


def compare_damage(fieryness_a: NDArray[np.uint8], fieryness_b: NDArray[np.uint8]) -> NDArray[np.int8]:
    """Compare codes: -1 where the second run has less damage, 1 where it has more, 0 where the codes are equal."""
    signs: NDArray[np.int8] = np.sign(_DAMAGE[fieryness_b] - _DAMAGE[fieryness_a])
    return signs


def common_steps(
    steps_a: NDArray[np.int64], steps_b: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.intp], NDArray[np.intp]]:
    """Align two runs: every step of either once both have begun; a run that has ended stays in its last state.

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
    """Check that two runs took place in the same city.

    Raises:
        ViewError: the cities differ in a building; the message names both and what differs.
    """
    for name in ("building_id", "outline_ptr", "outline_x_m", "outline_y_m", "floors"):
        if not np.array_equal(getattr(first, name), getattr(second, name)):
            cities = f"{first.name!r} with {len(first.building_id)} buildings"
            others = f"{second.name!r} with {len(second.building_id)}"
            hint = f"{name} differs; try to view them one by one"
            raise ViewError(expected("view", "", "two recordings of one city", f"{cities} and {others}", hint))
