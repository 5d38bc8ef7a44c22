"""Which part of an extract becomes a city: a disc around a place, a box, or all of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from fireworld.city.city import Array, Int64Array
from fireworld.city.formats.osm.projection import LATITUDE_MAX, RADIUS_MAX_M, UNITS_PER_DEGREE, Projection
from fireworld.city.formats.osm.reader import OsmFile, Window
from fireworld.city.outlines import Corner
from fireworld.errors import CityError, expected

STREET_MARGIN_MM: Final = 50_000
"""Streets reach so far beyond the buildings, so that those at the border have theirs."""
METRES_PER_DEGREE: Final = 111_000.0
"""A bit less than there are."""


@dataclass(frozen=True)
class Area:
    """A disc of a radius around the centre, or a box, in the plane of a projection."""

    projection: Projection
    radius_mm: int | None
    box_mm: tuple[int, int, int, int]
    """West, south, east, north; of a disc the box around it."""
    window: Window
    """All of it and of its streets, in units of 1e-7 degrees."""

    def holds(self, points_mm: Int64Array) -> Array:
        """Return which points, (k, 2), are inside, (k,) bool."""
        x, y = points_mm[:, 0], points_mm[:, 1]
        if self.radius_mm is not None:
            inside: Array = x * x + y * y <= self.radius_mm * self.radius_mm
            return inside
        west, south, east, north = self.box_mm
        return (west <= x) & (x <= east) & (south <= y) & (y <= north)

    def clip(self, start: Corner, end: Corner) -> tuple[Corner, Corner] | None:
        """Return the piece of a street that is not beyond the margin; None if there is none of a length."""
        span = (0.0, 1.0)
        if self.radius_mm is not None:
            found = _clip_to_disc(start, end, self.radius_mm + STREET_MARGIN_MM)
        else:
            west, south, east, north = self.box_mm
            margin = STREET_MARGIN_MM
            found = _clip_to_box(start, end, (west - margin, south - margin, east + margin, north + margin))
        if found is None or found[0] >= found[1]:
            return None
        if found == span:
            return start, end
        first, last = _along(start, end, found[0]), _along(start, end, found[1])
        return None if first == last else (first, last)


def area_of(
    file: OsmFile,
    *,
    around: tuple[float, float] | None,
    radius_m: float | None,
    box: tuple[float, float, float, float] | None,
) -> Area:
    """Return the area that is asked for: latitude and longitude in degrees, box as south, west, north, east.

    Without radius and box it is the bounds of the extract; the centre of a disc is their middle if not given.

    Raises:
        CityError: degrees out of bounds, an area too large, or one that does not touch the extract.
    """
    if radius_m is not None and box is not None:
        raise CityError(expected("--box", "", "a radius or a box", "both"))
    if around is not None and radius_m is None:
        raise CityError(expected("--around", "", "a radius with it", "none", "try --radius 500"))
    bounds = file.window()
    _check_bounds(file, bounds)
    if radius_m is not None:
        return _disc(file, bounds, around, radius_m)
    if box is not None:
        south, west, north, east = (_units("--box", degrees) for degrees in box)
        if not (south < north and west < east):
            raise CityError(expected("--box", "", "south below north and west of east", list(box)))
        asked: Window = (west, south, east, north)
        if not _touch(asked, bounds):
            raise _beside(file, "--box", bounds)
        bounds = asked
    projection = Projection((bounds[1] + bounds[3]) // 2, (bounds[0] + bounds[2]) // 2)
    corners = projection.to_mm([(bounds[0], bounds[1]), (bounds[2], bounds[1]), (bounds[0], bounds[3]), bounds[2:]])
    (west_mm, south_mm), (east_mm, north_mm) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    if max(-west_mm, -south_mm, east_mm, north_mm) > 1000 * RADIUS_MAX_M:
        wide, high = (east_mm - west_mm) / 1e6, (north_mm - south_mm) / 1e6
        wanted = f"an area of at most {2 * RADIUS_MAX_M / 1000:.0f} km by {2 * RADIUS_MAX_M / 1000:.0f} km"
        got = f"one of {wide:.0f} km by {high:.0f} km"
        raise CityError(expected(file.where, "", wanted, got, "try --radius or --box"))
    box_mm = (west_mm, south_mm, east_mm, north_mm)
    return Area(projection, None, box_mm, _grown(bounds, projection.latitude))


def _disc(file: OsmFile, bounds: Window, around: tuple[float, float] | None, radius_m: float) -> Area:
    """Return a disc."""
    if not 1 <= radius_m <= RADIUS_MAX_M:
        raise CityError(expected("--radius", "", f"metres from 1 to {RADIUS_MAX_M:.0f}", radius_m))
    if around is None:
        latitude, longitude = (bounds[1] + bounds[3]) // 2, (bounds[0] + bounds[2]) // 2
    else:
        latitude, longitude = _units("--around", around[0]), _units("--around", around[1], most=180.0)
        if abs(around[0]) > LATITUDE_MAX:
            raise CityError(expected("--around", "", f"a latitude from -{LATITUDE_MAX} to {LATITUDE_MAX}", around[0]))
    r = round(radius_m * 1000)
    window = _grown((longitude, latitude, longitude, latitude), latitude, more_m=radius_m)
    if not _touch(window, bounds):
        raise _beside(file, "--around", bounds)
    return Area(Projection(latitude, longitude), r, (-r, -r, r, r), window)


def _check_bounds(file: OsmFile, bounds: Window) -> None:
    """Refuse what is no part of the earth that can be made a plane."""
    most = 180 * UNITS_PER_DEGREE
    polar = round(LATITUDE_MAX * UNITS_PER_DEGREE)
    west, south, east, north = bounds
    if not (-most <= west <= east <= most and -polar <= south <= north <= polar):
        got = ", ".join(f"{one / UNITS_PER_DEGREE:g}" for one in (south, west, north, east))
        wanted = f"bounds south, west, north, east between -{LATITUDE_MAX:g}, -180 and {LATITUDE_MAX:g}, 180"
        raise CityError(expected(file.where, "bounds", wanted, got))


def _units(name: str, degrees: float, *, most: float = 180.0) -> int:
    if not -most <= degrees <= most:
        raise CityError(expected(name, "", f"degrees from -{most:g} to {most:g}", degrees))
    return round(degrees * UNITS_PER_DEGREE)


def _beside(file: OsmFile, name: str, bounds: Window) -> CityError:
    south, west, north, east = (f"{bounds[k] / UNITS_PER_DEGREE:.4f}" for k in (1, 0, 3, 2))
    wanted = f"a place within {file.where}, south {south}, west {west}, north {north}, east {east}"
    return CityError(expected(name, "", wanted, "one beside it"))


def _touch(one: Window, other: Window) -> bool:
    return one[0] <= other[2] and other[0] <= one[2] and one[1] <= other[3] and other[1] <= one[3]


def _grown(window: Window, latitude: int, *, more_m: float = 0.0) -> Window:
    """Return a window with room for the streets around it."""
    from fireworld.city.formats.osm.projection import sin_cos

    rise = round((more_m + 2 * STREET_MARGIN_MM / 1000) / METRES_PER_DEGREE * UNITS_PER_DEGREE)
    _, cos = sin_cos(np.array([latitude / UNITS_PER_DEGREE * 3.141592653589793 / 180]))
    aside = round(rise / (0.9 * float(cos[0])))
    return window[0] - aside, window[1] - rise, window[2] + aside, window[3] + rise


def _along(start: Corner, end: Corner, part: float) -> Corner:
    """Return the point at a part of the way, in whole mm."""
    if part in {0.0, 1.0}:
        return end if part else start
    x, y = (int(np.floor(start[k] + (end[k] - start[k]) * part + 0.5)) for k in (0, 1))
    return x, y


def _clip_to_box(start: Corner, end: Corner, box: tuple[int, int, int, int]) -> tuple[float, float] | None:
    """Return between which parts of its way a street is in a box."""
    first, last = 0.0, 1.0
    for axis in (0, 1):
        way, low, high = end[axis] - start[axis], box[axis] - start[axis], box[axis + 2] - start[axis]
        if way == 0:
            if low > 0 or high < 0:
                return None
            continue
        enters, leaves = sorted((low / way, high / way))
        first, last = max(first, enters), min(last, leaves)
    return first, last


def _clip_to_disc(start: Corner, end: Corner, radius: int) -> tuple[float, float] | None:
    """Return between which parts of its way a street is in a disc around 0, 0."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    a, b = dx * dx + dy * dy, start[0] * dx + start[1] * dy
    c = start[0] * start[0] + start[1] * start[1] - radius * radius
    inside = b * b - a * c
    if a == 0 or inside < 0:
        return None
    root = float(np.sqrt(float(inside)))
    return max(0.0, (-b - root) / a), min(1.0, (-b + root) / a)
