"""One mesh of the whole city: extruded buildings that share one set of vertices, so that a step only recolors them.

Its colors are a picture with a pixel for each building: a step takes three bytes a building, where colors of vertices
would take eighty.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fireworld.records import CityRecord

STOREY_M: Final = 3.0
SHADES_PERCENT: Final = (100, 82, 70, 58)
"""Brightness of a roof and of walls that face south, east or west, and north: light from above and the south."""

_SOUTH, _SIDE, _NORTH = range(1, 4)


@dataclass(frozen=True)
class CityMesh:
    """Buildings as triangles; static during a run. v vertices, t triangles."""

    vertex_xyz_m: NDArray[np.float32]  # (v, 3)
    triangle: NDArray[np.uint32]  # (t, 3) indices of vertices
    vertex_building: NDArray[np.int32]  # (v,) building of each vertex, rising
    vertex_shade: NDArray[np.uint8]  # (v,) index into SHADES_PERCENT
    vertex_uv: NDArray[np.float32]  # (v, 2) the middle of its building's pixel in the picture, of which 1 by 1 is all
    picture_size: tuple[int, int]  # width and height of the picture, in pixels: the buildings row by row
    roof_xyz_m: NDArray[np.float32]  # (n, 3) middle of each roof


def city_box_m(city: CityRecord, margin_m: float = 0.0) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the south-west and the north-east corner of the city with a margin."""
    x, y = np.asarray(city.outline_x_m), np.asarray(city.outline_y_m)
    low = float(x.min()) - margin_m, float(y.min()) - margin_m
    return low, (float(x.max()) + margin_m, float(y.max()) + margin_m)


def build_mesh(city: CityRecord) -> CityMesh:
    """Extrude every building of a city.

    A building of c corners has c roof vertices and 4 of its own for each wall, so that every face keeps one color.
    """
    ptr = np.asarray(city.outline_ptr, dtype=np.int64)
    x, y = np.asarray(city.outline_x_m, dtype=np.float64), np.asarray(city.outline_y_m, dtype=np.float64)
    n_corners = np.diff(ptr)
    building = np.repeat(np.arange(len(n_corners)), n_corners)
    position = np.arange(len(x)) - ptr[building]
    following = np.where(position + 1 == n_corners[building], ptr[building], np.arange(len(x)) + 1)
    height = (np.asarray(city.floors) * STOREY_M)[building]

    # Vertices, building by building: first the roof's corners, then four for each wall.
    roof = 5 * ptr[building] + position
    wall = 5 * ptr[building] + n_corners[building] + 4 * position
    xyz = np.zeros((5 * len(x), 3), dtype=np.float32)
    shade = np.zeros(5 * len(x), dtype=np.uint8)
    xyz[roof] = np.column_stack([x, y, height])
    doubled_area = np.bincount(building, weights=x * y[following] - x[following] * y, minlength=len(n_corners))
    facing = _facing(x, y, following, np.sign(doubled_area)[building])
    next_x, next_y, ground = x[following], y[following], np.zeros(len(x))
    corners = ((x, y, ground), (next_x, next_y, ground), (next_x, next_y, height), (x, y, height))
    for corner, columns in enumerate(corners):
        xyz[wall + corner] = np.column_stack(columns)
        shade[wall + corner] = facing
    walls = np.concatenate([np.column_stack([wall, wall + 1, wall + 2]), np.column_stack([wall, wall + 2, wall + 3])])
    middles = np.column_stack([city.center_x_m, city.center_y_m, np.asarray(city.floors) * STOREY_M])
    vertex_building = np.repeat(np.arange(len(n_corners), dtype=np.int32), 5 * n_corners)
    width, length = _picture_size(len(n_corners))
    row, column = np.divmod(vertex_building, width)
    return CityMesh(
        vertex_xyz_m=xyz,
        triangle=np.concatenate([roof[triangulate(ptr, np.column_stack([x, y]))], walls]).astype(np.uint32),
        vertex_building=vertex_building,
        vertex_shade=shade,
        vertex_uv=np.column_stack([(column + 0.5) / width, (row + 0.5) / length]).astype(np.float32),
        picture_size=(width, length),
        roof_xyz_m=middles.astype(np.float32),
    )


def _picture_size(n_buildings: int) -> tuple[int, int]:
    """Return width and height of the squarest picture with a pixel for each building: no side may be long."""
    width = math.isqrt(max(0, n_buildings - 1)) + 1
    return width, max(1, -(-n_buildings // width))


def triangulate(ptr: NDArray[np.int64], xy: NDArray[np.float64]) -> NDArray[np.int64]:
    """Cut simple polygons into triangles, (t, 3) indices of corners: a fan of a convex one, ears of others.

    Args:
        ptr: (n + 1,) start of each polygon's corners.
        xy: (c, 2) corners in either sense of rotation; the closing corner is not repeated. Polygons of c corners have
            c - 2 triangles, in their order.
    """
    n_corners = np.diff(ptr)
    n_triangles = np.maximum(n_corners - 2, 0)
    polygon = np.repeat(np.arange(len(n_corners)), n_triangles)
    start = np.cumsum(n_triangles) - n_triangles
    second = ptr[polygon] + 1 + np.arange(len(polygon)) - start[polygon]
    triangles = np.column_stack([ptr[polygon], second, second + 1])
    before, after = np.arange(len(xy)) - 1, np.arange(len(xy)) + 1
    whole = n_corners > 0
    before[ptr[:-1][whole]], after[ptr[1:][whole] - 1] = ptr[1:][whole] - 1, ptr[:-1][whole]
    turns = _turn(xy[before], xy, xy[after])
    owner = np.repeat(np.arange(len(n_corners)), n_corners)
    left, right = (np.bincount(owner[turning], minlength=len(n_corners)) > 0 for turning in (turns > 0, turns < 0))
    for k in np.flatnonzero(left & right).tolist():
        triangles[start[k] : start[k] + n_triangles[k]] = ptr[k] + _ears(xy[ptr[k] : ptr[k + 1]])
    return triangles


def _ears(xy: NDArray[np.float64]) -> NDArray[np.int64]:
    """Cut a simple polygon, (c, 2), into triangles, (c - 2, 3), by cutting off one ear after another."""
    (x, y), n = xy.T, len(xy)
    doubled_area = float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))
    left = list(range(n)) if doubled_area > 0 else list(range(n - 1, -1, -1))
    triangles = []
    while len(left) > 3:
        ear = next((at for at in range(len(left)) if _is_ear(xy, left, at)), 0)
        triangles.append((left[ear - 1], left[ear], left[(ear + 1) % len(left)]))
        del left[ear]
    triangles.append((left[0], left[1], left[2]))
    return np.array(triangles, dtype=np.int64)


def _is_ear(xy: NDArray[np.float64], left: list[int], at: int) -> bool:
    """Return whether a corner of a counterclockwise polygon can be cut off: it bulges, and the cut is empty.

    Corners at the places of the cut's own are no obstacle: where a courtyard is cut in, its slit has each end twice.
    """
    corners = left[at - 1], left[at], left[(at + 1) % len(left)]
    a, b, c = xy[list(corners)]
    if _turn(a, b, c) <= 0:
        return False
    others = xy[[corner for corner in left if corner not in corners]]
    inside = (_turn(a, b, others) >= 0) & (_turn(b, c, others) >= 0) & (_turn(c, a, others) >= 0)
    for corner in (a, b, c):
        inside &= (others != corner).any(axis=1)
    return not bool(np.any(inside))


def _turn(a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return twice the signed area of triangles, (..., 2) each to (...): positive where the way a-b-c turns left."""
    ab, ac = b - a, c - a
    doubled: NDArray[np.float64] = ab[..., 0] * ac[..., 1] - ab[..., 1] * ac[..., 0]
    return doubled


def _facing(
    x: NDArray[np.float64], y: NDArray[np.float64], following: NDArray[np.int64], sense: NDArray[np.float64]
) -> NDArray[np.uint8]:
    """Return the shade of each wall, (corners,), by the direction it faces; sense 1 is counterclockwise."""
    outward_x, outward_y = (y[following] - y) * sense, (x - x[following]) * sense
    sideways = np.abs(outward_x) > np.abs(outward_y)
    return np.where(sideways, _SIDE, np.where(outward_y < 0, _SOUTH, _NORTH)).astype(np.uint8)
