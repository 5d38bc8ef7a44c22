"""From degrees to whole millimetres around a place: a transverse Mercator projection on WGS 84.

x runs east and y north of the centre. Sines and cosines are sums of powers, with + - * / and square roots only, so that
an extract makes the same city on every processor, to the millimetre. Within 20 km of the centre places are right to a
millimetre, and lengths to 5 millionths of themselves: 5 mm in a kilometre.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, islice
from typing import Any, Final

import numpy as np

from fireworld.city.city import Float64Array, Int64Array
from fireworld.city.outlines import Corner

Place = tuple[int, int]
"""Longitude and latitude in units of 1e-7 degrees."""

UNITS_PER_DEGREE: Final = 10_000_000
"""OpenStreetMap keeps degrees as whole numbers of this size; about a centimetre."""
LATITUDE_MAX: Final = 85.0
RADIUS_MAX_M: Final = 20_000.0
ROWS_AT_ONCE: Final = 10_000
_SEMI_MAJOR_M: Final = 6_378_137.0
_FLATTENING: Final = 1 / 298.257223563
_E2: Final = _FLATTENING * (2 - _FLATTENING)
_SECOND_E2: Final = _E2 / (1 - _E2)
_RADIANS_PER_UNIT: Final = 3.141592653589793 / 180 / UNITS_PER_DEGREE
_TERMS: Final = 12
"""Of the sum of powers: enough for the last bit up to a quarter turn."""


@dataclass(frozen=True)
class Projection:
    """A plane around a centre, which is given in units of 1e-7 degrees."""

    latitude: int
    longitude: int

    def to_mm(self, places: Any) -> Int64Array:
        """Return where places are, (k, 2) longitude and latitude in units, as (k, 2) x and y in whole mm."""
        units = np.asarray(places, dtype=np.int64).reshape(-1, 2)
        turn = 360 * UNITS_PER_DEGREE
        east = (units[:, 0] - self.longitude + turn // 2) % turn - turn // 2  # the short way around the earth
        lon: Float64Array = east.astype(np.float64) * _RADIANS_PER_UNIT
        lat: Float64Array = units[:, 1].astype(np.float64) * _RADIANS_PER_UNIT
        start = np.full(len(lat), self.latitude * _RADIANS_PER_UNIT)
        sin, cos = sin_cos(lat)
        sin2, cos2 = sin * sin, cos * cos
        tan2, eta2 = sin2 / cos2, _SECOND_E2 * cos2
        normal = _SEMI_MAJOR_M / np.sqrt(1 - _E2 * sin2)
        q2 = lon * lon * cos2
        fifth = 5 - 18 * tan2 + tan2 * tan2 + 14 * eta2 - 58 * tan2 * eta2
        x = normal * cos * lon * (1 + q2 / 6 * (1 - tan2 + eta2) + q2 * q2 / 120 * fifth)
        bulge = 1 + q2 / 12 * (5 - tan2 + 9 * eta2 + 4 * eta2 * eta2)
        y = _arc(start, lat) + normal * sin * cos * lon * lon / 2 * bulge
        metres = np.stack([x, y], axis=1)
        mm: Int64Array = np.floor(metres * 1000 + 0.5).astype(np.int64)
        return mm


def projected(projection: Projection, rows: Iterable[Sequence[Place]]) -> Iterator[list[Corner]]:
    """Yield rows of places in whole mm; many rows at once take little more time than one."""
    remaining = iter(rows)
    while some := list(islice(remaining, ROWS_AT_ONCE)):
        places = np.fromiter(chain.from_iterable(chain.from_iterable(some)), dtype=np.int64)
        corners = iter(map(tuple, projection.to_mm(places).tolist()))
        for row in some:
            yield list(islice(corners, len(row)))


def sin_cos(angle: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Return sine and cosine of angles from minus to plus a quarter turn, in radians."""
    square = angle * angle
    sin, cos = np.ones_like(angle), np.ones_like(angle)
    for k in range(_TERMS, 0, -1):
        sin = 1 - square / (2 * k * (2 * k + 1)) * sin
        cos = 1 - square / ((2 * k - 1) * 2 * k) * cos
    return angle * sin, cos


def _arc(start: Float64Array, end: Float64Array) -> Float64Array:
    """Return the length of the meridian between latitudes, in metres, by Simpson's rule."""
    return (end - start) / 6 * (_bend(start) + 4 * _bend((start + end) / 2) + _bend(end))


def _bend(latitude: Float64Array) -> Float64Array:
    """Return the radius of a meridian's curve, in metres."""
    sin, _ = sin_cos(latitude)
    part = 1 - _E2 * sin * sin
    return _SEMI_MAJOR_M * (1 - _E2) / (part * np.sqrt(part))
