"""Cameras of the map: at the fire from the south, or straight down on a box."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fireworld.records import Recording
from fireworld_viewer.city_mesh import city_box_m

_MARGIN_M: Final = 45.0
_FOUGHT_BUILDINGS: Final = 60
_LEAST_DISTANCE_M: Final = 100.0
_UP, _SOUTH = math.sin(math.radians(56.0)), math.cos(math.radians(56.0))
"""The direction from the fire to the camera."""
_SLOPE: Final = math.tan(math.radians(55.0 / 2))
"""Half the height of a fresh Rerun view's field of view, by the distance."""


@dataclass(frozen=True)
class Camera:
    """Where the eye is and what it looks at, in metres."""

    eye_m: tuple[float, float, float]
    target_m: tuple[float, float, float]
    up: tuple[float, float, float] = (0.0, 0.0, 1.0)  # what is up in the picture


def frame_fire(recordings: Sequence[Recording], *, aspect: float) -> Camera:
    """Look from the south, from above, at the fire while it can still be fought, or at the whole city without one.

    aspect: width of the view by its height.
    """
    city = recordings[0].city
    low, high = map(np.array, city_box_m(city))
    fought = np.any([_fought_buildings(one.column("/buildings", "fieryness")) for one in recordings], axis=0)
    if fought.any():
        center = np.column_stack([city.center_x_m, city.center_y_m])[fought]
        low = np.maximum(low, center.min(axis=0) - _MARGIN_M)
        high = np.minimum(high, center.max(axis=0) + _MARGIN_M)
    (x_m, y_m), (half_width_m, half_depth_m) = _middle_and_halves(low, high)
    # The near edge of the ground is closer to the eye than its middle, and seen larger.
    seen_m = max(half_width_m / (_SLOPE * aspect), half_depth_m * _UP / _SLOPE, _LEAST_DISTANCE_M)
    far_m = 1.06 * seen_m + half_depth_m * _SOUTH
    return Camera(eye_m=(x_m, y_m - far_m * _SOUTH, far_m * _UP), target_m=(x_m, y_m, 0.0))


def frame_from_above(low: ArrayLike, high: ArrayLike, *, aspect: float) -> Camera:
    """Look straight down, north up, on a box between its south-west and its north-east corner in metres."""
    (x_m, y_m), (half_width_m, half_depth_m) = _middle_and_halves(low, high)
    far_m = 1.08 * max(half_width_m / (_SLOPE * aspect), half_depth_m / _SLOPE, _LEAST_DISTANCE_M)
    return Camera(eye_m=(x_m, y_m, far_m), target_m=(x_m, y_m, 0.0), up=(0.0, 1.0, 0.0))


def _middle_and_halves(low: ArrayLike, high: ArrayLike) -> list[list[float]]:
    ends = np.array([low, high])
    return [(ends.sum(axis=0) / 2).tolist(), ((ends[1] - ends[0]) / 2).tolist()]


def _fought_buildings(fieryness: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Return which buildings burned, (n,), up to the step at which more than _FOUGHT_BUILDINGS had. (k, n) codes."""
    touched = np.logical_or.accumulate(fieryness != 0, axis=0)
    small = np.flatnonzero(touched.sum(axis=1) <= _FOUGHT_BUILDINGS)
    found: NDArray[np.bool_] = touched[small[-1] if len(small) else 0]
    return found
