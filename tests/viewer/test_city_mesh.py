"""The city's mesh: roofs cover their outlines exactly, walls stand on them, every vertex knows its building."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fireworld_viewer.city_mesh import SHADES_PERCENT, build_mesh, triangulate
from hypothesis import given
from hypothesis import strategies as st


def area(x: np.ndarray, y: np.ndarray) -> float:
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)) / 2


def triangles_of(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Cut one polygon, between two others that are cut too."""
    square, n = np.array([(0, 0), (1, 0), (1, 1), (0, 1)]), len(x)
    triangles = triangulate(np.array([0, 4, 4 + n, 8 + n]), np.concatenate([square, np.column_stack([x, y]), square]))
    assert triangles[:2].tolist() == [[0, 1, 2], [0, 2, 3]]
    assert (triangles[-2:] - 4 - n).tolist() == [[0, 1, 2], [0, 2, 3]]
    return triangles[2:-2] - 4


def triangle_areas(x: np.ndarray, y: np.ndarray, triangles: np.ndarray) -> list[float]:
    return [area(x[corners], y[corners]) for corners in triangles]


@given(st.lists(st.floats(1.0, 9.0), min_size=3, max_size=16), st.booleans())
def test_triangles_tile_any_star_shaped_polygon(radii: list[float], clockwise: bool):
    angles = np.arange(len(radii)) * (2 * math.pi / len(radii))
    x, y = np.array(radii) * np.cos(angles), np.array(radii) * np.sin(angles)
    if clockwise:
        x, y = x[::-1].copy(), y[::-1].copy()
    triangles = triangles_of(x, y)
    assert triangles.shape == (len(radii) - 2, 3)
    areas = np.array(triangle_areas(x, y, triangles))
    assert math.isclose(areas.sum(), area(x, y), rel_tol=1e-9, abs_tol=1e-9) or math.isclose(
        np.abs(areas).sum(), abs(area(x, y)), rel_tol=1e-9
    )
    assert np.all(areas >= -1e-9) or np.all(areas <= 1e-9)  # no triangle is folded back: none lies outside


@pytest.mark.parametrize(
    "outline",
    [
        [(0, 0), (10, 0), (10, 4), (4, 4), (4, 10), (0, 10)],  # L
        [(0, 0), (9, 0), (9, 9), (6, 9), (6, 3), (3, 3), (3, 9), (0, 9)],  # U
        [(0, 0), (4, 0), (8, 0), (8, 8), (0, 8)],  # a corner in the middle of a straight wall
        [(0, 0), (5, 4), (10, 0), (6, 5), (10, 10), (5, 6), (0, 10), (4, 5)],  # star
        # a courtyard, cut in by a slit
        [(0, 0), (20, 0), (20, 20), (0, 20), (0, 8), (2, 8), (2, 12), (6, 12), (6, 8), (2, 8), (0, 8)],
        # two of them
        [
            (0, 0),
            (30, 0),
            (30, 10),
            (10, 10),
            (10, 6),
            (14, 6),
            (14, 4),
            (20, 4),
            (20, 8),
            (24, 8),
            (24, 2),
            (20, 2),
            (20, 4),
            (14, 4),
            (14, 2),
            (8, 2),
            (8, 6),
            (10, 6),
            (10, 10),
            (0, 10),
        ],
    ],
)
def test_triangles_tile_angular_outlines(outline: list[tuple[float, float]]):
    x, y = np.array(outline, dtype=float).T
    areas = triangle_areas(x, y, triangles_of(x, y))
    assert sum(areas) == pytest.approx(area(x, y))
    assert min(areas) >= 0


def test_mesh_of_a_city(small):
    city = small.city
    mesh = build_mesh(city)
    n_corners = np.diff(city.outline_ptr)
    assert len(mesh.vertex_xyz_m) == len(mesh.vertex_building) == len(mesh.vertex_shade) == 5 * n_corners.sum()
    assert np.array_equal(np.bincount(mesh.vertex_building), 5 * n_corners)
    assert mesh.triangle.max() < len(mesh.vertex_xyz_m)
    assert mesh.vertex_shade.max() < len(SHADES_PERCENT)
    width, height = mesh.picture_size
    assert width * (height - 1) < len(n_corners) <= width * height
    column, row = np.floor(mesh.vertex_uv * (width, height)).astype(int).T
    assert np.array_equal(row * width + column, mesh.vertex_building)
    owners = mesh.vertex_building[mesh.triangle]
    assert np.all(owners == owners[:, :1])  # no triangle joins two buildings

    for building in range(len(city.building_id)):
        own = mesh.vertex_building == building
        corners = slice(*city.outline_ptr[building : building + 2])
        height = 3.0 * city.floors[building]
        z = mesh.vertex_xyz_m[own, 2]
        assert set(z.tolist()) == {0.0, height}
        roof = mesh.triangle[(owners[:, 0] == building) & np.all(mesh.vertex_shade[mesh.triangle] == 0, axis=1)]
        x, y = mesh.vertex_xyz_m[:, 0].astype(float), mesh.vertex_xyz_m[:, 1].astype(float)
        covered = sum(abs(part) for part in triangle_areas(x, y, roof))
        assert covered == pytest.approx(abs(area(city.outline_x_m[corners], city.outline_y_m[corners])), rel=1e-5)
        assert mesh.roof_xyz_m[building, 2] == height


@pytest.mark.parametrize("building", [2, 1])  # 2 runs counterclockwise, 1 clockwise
def test_walls_are_shaded_by_the_direction_they_face(small, building: int):
    mesh = build_mesh(small.city)
    own = np.flatnonzero(mesh.vertex_building == building)
    walls = own[4:].reshape(4, 4)
    middle = mesh.vertex_xyz_m[own[:4], :2].mean(axis=0)
    for wall in walls:
        toward_x, toward_y = mesh.vertex_xyz_m[wall, :2].mean(axis=0) - middle
        expected = 2 if abs(toward_x) > abs(toward_y) else 1 if toward_y < 0 else 3
        assert set(mesh.vertex_shade[wall].tolist()) == {expected}
