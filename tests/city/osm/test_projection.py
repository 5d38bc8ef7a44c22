"""Degrees to millimetres: known lengths, and how far the plane is from the earth."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fireworld.city.formats.osm.projection import Projection, sin_cos


def test_sine_and_cosine():
    angles = np.linspace(-math.pi / 2, math.pi / 2, 1001)
    sin, cos = sin_cos(angles)
    assert np.abs(sin - np.sin(angles)).max() < 4e-16
    assert np.abs(cos - np.cos(angles)).max() < 4e-16


@pytest.mark.parametrize(
    ("latitude", "lon_m", "lat_m"),
    [(0, 1113.195, 1105.743), (60, 558.00, 1114.12), (-60, 558.00, 1114.12)],  # a hundredth of a degree
)
def test_lengths_of_degrees(latitude, lon_m, lat_m):
    plane = Projection(latitude * 10_000_000, 250_000_000)
    (east, _), (_, north), (zero, nothing) = plane.to_mm(
        [(250_100_000, latitude * 10_000_000), (250_000_000, latitude * 10_000_000 + 100_000),
         (250_000_000, latitude * 10_000_000)]
    ).tolist()  # fmt: skip
    assert east / 1000 == pytest.approx(lon_m, abs=0.01)
    assert north / 1000 == pytest.approx(lat_m, abs=0.03)
    assert (zero, nothing) == (0, 0)


def test_the_short_way_around_the_earth():
    ((x, y),) = Projection(0, 1_799_999_000).to_mm([(-1_799_999_000, 0)]).tolist()
    assert (x, y) == (22264, 0)  # two ten-thousandths of a degree, eastward


def chord_m(a: tuple[float, float], b: tuple[float, float]) -> float:
    """The straight line between two places through the earth, by x, y, z."""
    points = []
    for longitude, latitude in (a, b):
        lon, lat = math.radians(longitude), math.radians(latitude)
        e2 = (2 - 1 / 298.257223563) / 298.257223563
        normal = 6378137 / math.sqrt(1 - e2 * math.sin(lat) ** 2)
        points.append((normal * math.cos(lat) * math.cos(lon), normal * math.cos(lat) * math.sin(lon),
                       normal * (1 - e2) * math.sin(lat)))  # fmt: skip
    return math.dist(*points)


@given(
    st.floats(-80, 80), st.floats(-20_000, 20_000), st.floats(-20_000, 20_000), st.floats(-500, 500),
    st.floats(-500, 500),
)  # fmt: skip
def test_lengths_in_the_plane_are_those_on_earth(latitude, x, y, dx, dy):
    per_lat, per_lon = 111_000.0, 111_320.0 * math.cos(math.radians(latitude))
    a = (25 + x / per_lon, latitude + y / per_lat)
    b = (a[0] + dx / per_lon, a[1] + dy / per_lat)
    plane = Projection(round(latitude * 1e7), 250_000_000)
    units = [(round(lon * 1e7), round(lat * 1e7)) for lon, lat in (a, b)]
    (x1, y1), (x2, y2) = plane.to_mm(units).tolist()
    on_earth = chord_m(*((lon / 1e7, lat / 1e7) for lon, lat in units))
    assert math.hypot(x2 - x1, y2 - y1) / 1000 == pytest.approx(on_earth, abs=0.0015 + 6e-6 * on_earth)
