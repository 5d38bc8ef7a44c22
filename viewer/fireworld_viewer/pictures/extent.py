"""What part of a city pictures show: where it burns, and who is near."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fireworld.records import CityRecord, Recording
from fireworld_viewer.city_mesh import city_box_m
from fireworld_viewer.story.series import chosen_targets, recorded

MARGIN_M: Final = 12.0
"""Around a whole city."""
_AROUND_M: Final = 18.0
_NEAR_M: Final = 45.0
_LEAST_M: Final = 110.0
_SLIMMEST: Final = 0.8
"""Of a part's sides, the shorter by the longer."""
_MOST: Final = 0.6
"""Share of the city above which all of it is shown."""


class Extent(NamedTuple):
    """A part of the plane, in metres."""

    west: float
    east: float
    south: float
    north: float

    @property
    def wide(self) -> float:
        """From west to east."""
        return self.east - self.west

    @property
    def high(self) -> float:
        """From south to north."""
        return self.north - self.south


def whole_extent(city: CityRecord) -> Extent:
    """Return what a map of the whole city shows."""
    (west, south), (east, north) = city_box_m(city, MARGIN_M)
    return Extent(west, east, south - MARGIN_M, north)


def fire_extent(recordings: Sequence[Recording]) -> Extent | None:
    """Return the part of a city in which at any step of the runs something burns, is burnt or sprayed.

    There is a margin, and the brigades are in it as far as they are near. None where that is most of the city, or
    nothing: then all of it is to be shown.
    """
    city = recordings[0].city
    touched = np.any([_touched(one) for one in recordings], axis=0)
    if not touched.any():
        return None
    fire = _around(np.column_stack([city.center_x_m, city.center_y_m])[touched], _AROUND_M)
    places = [place for one in recordings for place in _near(one, fire)]
    box = _around(np.concatenate([[(fire.west, fire.south), (fire.east, fire.north)], *places]), 0.0)
    whole = whole_extent(city)
    longer = max(box.wide, box.high, _LEAST_M)
    west, east = _widened(box.west, box.east, _SLIMMEST * longer, whole.west, whole.east)
    south, north = _widened(box.south, box.north, _SLIMMEST * longer, whole.south, whole.north)
    part = Extent(west, east, south, north)
    return None if part.wide * part.high > _MOST * whole.wide * whole.high else part


def widened(part: Extent | None, places: NDArray[np.float64], city: CityRecord) -> Extent | None:
    """Return a part of a city with room for some places, (k, 2); None where that is most of the city, or `part` is."""
    if part is None:
        return None
    corners = np.array([(part.west, part.south), (part.east, part.north)])
    whole = whole_extent(city)
    west, east, south, north = _around(np.concatenate([corners, places - MARGIN_M, places + MARGIN_M]), 0.0)
    box = Extent(max(west, whole.west), min(east, whole.east), max(south, whole.south), min(north, whole.north))
    return None if box.wide * box.high > _MOST * whole.wide * whole.high else box


def _touched(recording: Recording) -> NDArray[np.bool_]:
    """Return which buildings are at some step not as they were, or are sprayed: (n,)."""
    found: NDArray[np.bool_] = np.any(recording.column("/buildings", "fieryness") != 0, axis=0)
    if recorded(recording, "decisions") and recorded(recording, "brigades.sprayed_litres"):
        target = chosen_targets(recording)
        sprayed = recording.column("/brigades", "sprayed_litres") > 0
        found[target[sprayed & (target >= 0)]] = True
    return found


def _near(recording: Recording, fire: Extent) -> Iterator[NDArray[np.float64]]:
    """Yield the places of brigades that are near a fire: (k, 2), with room for what is drawn of them."""
    x, y = (recording.column("/brigades", name).astype(np.float64).ravel() for name in ("x_m", "y_m"))
    near = (x > fire.west - _NEAR_M) & (x < fire.east + _NEAR_M) & (y > fire.south - _NEAR_M)
    near &= y < fire.north + _NEAR_M
    for shift_m in (-MARGIN_M, MARGIN_M):
        yield np.column_stack([x, y])[near] + shift_m


def _around(places: NDArray[np.float64], margin_m: float) -> Extent:
    (west, south), (east, north) = places.min(axis=0) - margin_m, places.max(axis=0) + margin_m
    return Extent(float(west), float(east), float(south), float(north))


def _widened(low: float, high: float, least: float, first: float, last: float) -> tuple[float, float]:
    """Make a range at least so long, around its middle, and move it between the ends of the city."""
    half = max(high - low, min(least, last - first)) / 2
    middle = min(max((low + high) / 2, first + half), last - half) if 2 * half < last - first else (first + last) / 2
    return max(middle - half, first), min(middle + half, last)
