"""Air cells and walls of hand-made footprints."""

from __future__ import annotations

import numpy as np
import pytest

from fireworld.city.air import cover_cells
from fireworld.city.build import physics_of, visiting_order
from fireworld.errors import CityError
from fireworld.parameters import FireParameters
from tests.city.plans import footprints, rectangle


def cells(air, building=0):
    part = slice(air.ptr[building], air.ptr[building + 1])
    return list(zip(air.x[part].tolist(), air.y[part].tolist(), air.percent[part].tolist(), strict=True))


def inside(outline, x, y):
    """Say whether a point lies in an outline: the textbook even-odd rule, on its own terms."""
    crossings = 0
    for (x1, y1), (x2, y2) in zip(outline, outline[1:] + outline[:1], strict=True):
        if (y1 <= y) != (y2 <= y) and x1 + (y - y1) * (x2 - x1) / (y2 - y1) <= x:
            crossings += 1
    return crossings % 2 == 1


def test_a_square_of_one_cell_fills_it_and_no_other():
    air = cover_cells(footprints(rectangle(3000, -2000, 5000, 5000)), 5000)
    assert air.origin_mm == (3000, -2000)
    assert air.shape == (2, 2)  # the far edge is exactly on the next cell
    assert cells(air) == [(0, 0, 100)]


def test_cells_come_x_outer_y_inner():
    air = cover_cells(footprints(rectangle(0, 0, 7500, 5500)), 5000)
    assert air.shape == (2, 2)
    assert cells(air) == [(0, 0, 100), (0, 1, 10), (1, 0, 50), (1, 1, 5)]


def test_near_walls_count_and_far_walls_do_not():
    # Samples at 0, 500, 1000 ... : 1000 to 2000 holds two of them each way, 1001 to 2001 too.
    outer = rectangle(0, 0, 5000, 5000)
    air = cover_cells(footprints(outer, rectangle(1000, 1000, 1000, 1000), rectangle(1001, 1001, 1000, 1000)), 5000)
    assert cells(air, 1) == [(0, 0, 4)]
    assert cells(air, 2) == [(0, 0, 4)]


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("cell_mm", [5000, 3333, 1701])
def test_cover_is_the_count_of_samples_inside(seed, cell_mm):
    draw = np.random.default_rng(seed)
    outlines = []
    for _ in range(4):
        middle, spokes = draw.integers(-20_000, 20_000, 2), np.sort(draw.choice(16, 7, replace=False))
        reach = draw.uniform(2000, 9000, 7)
        angle = spokes * np.pi / 8
        ring = middle + np.stack([reach * np.cos(angle), reach * np.sin(angle)], axis=1)
        outlines.append([(int(x), int(y)) for x, y in ring])
    air = cover_cells(footprints(*outlines), cell_mm)
    for building, outline in enumerate(outlines):
        counted = {}
        for x in range(air.shape[0]):
            for y in range(air.shape[1]):
                samples = [
                    (air.origin_mm[0] + (x + i / 10) * cell_mm, air.origin_mm[1] + (y + j / 10) * cell_mm)
                    for i in range(10)
                    for j in range(10)
                ]
                hits = sum(inside(outline, *sample) for sample in samples)
                if hits:
                    counted[x, y] = hits
        assert {(x, y): percent for x, y, percent in cells(air, building)} == counted


def test_direction_and_first_corner_of_an_outline_do_not_matter():
    outline = [(0, 0), (9000, 500), (12_300, 8100), (4000, 3000)]
    plain = cover_cells(footprints(outline), 5000)
    for other in (outline[::-1], outline[2:] + outline[:2]):
        assert cells(cover_cells(footprints(other), 5000)) == cells(plain)


def test_a_building_between_the_samples_is_refused_by_name():
    thin = [(10_100, 10_100), (10_400, 10_100), (10_400, 14_000), (10_100, 14_000)]
    with pytest.raises(CityError, match=r"^here: building 77: apexes: expected a footprint that covers"):
        cover_cells(footprints(rectangle(0, 0, 5000, 5000), thin, ids=[5, 77]), 5000, where="here")


def test_a_city_too_large_for_the_grid_is_refused():
    with pytest.raises(CityError, match=r"^city: buildings: expected at most 4000000 air cells of 5000 mm"):
        cover_cells(footprints(rectangle(0, 0, 5000, 5000), rectangle(10**9, 10**9, 5000, 5000)), 5000)


def test_buildings_over_too_many_cells_are_refused_by_the_largest_ones_name():
    outlines = [rectangle(0, 0, 9_000_000, 9_000_000) for _ in range(5)]
    with pytest.raises(CityError, match=r"building 4: apexes: expected at most 16000000 air cells of 5000 mm"):
        cover_cells(footprints(*outlines, rectangle(0, 0, 5000, 5000), ids=[4, 5, 6, 7, 8, 9]), 5000)


def test_a_building_of_four_kilometres_is_a_building():
    air = cover_cells(footprints(rectangle(0, 0, 4_000_000, 4_000_000)), 5000)
    assert len(air.x) == 800 * 800
    assert (air.percent == 100).all()


def test_physics_by_hand():
    # 10 m by 6 m of one storey, wood: 180 m3; three walls of 10, 6 and 10 m, 3 m high: the closing one is left out.
    physics = physics_of(footprints(rectangle(0, 0, 10_000, 6000)), FireParameters())
    assert physics["volume_m3"].tolist() == [180.0]
    assert physics["initial_fuel"].tolist() == [432_000.0]
    assert physics["heat_capacity"].tolist() == [pytest.approx(198.0)]
    assert physics["ignition_point"].tolist() == [47.0]
    assert physics["wall_area_m2"].tolist() == [78.0]
    assert {physics["volume_m3"].dtype, physics["initial_fuel"].dtype, physics["heat_capacity"].dtype} == {
        np.dtype(np.float32)
    }


def test_visiting_order_by_hand():
    # Table of 16: keys 1, (17 ^ 0) & 15 = 1, (65536 ^ 1) & 15 = 1, 0.
    assert visiting_order(np.array([1, 17, 65536, 32])).tolist() == [3, 0, 1, 2]
    # 12 still fit 16 places, where 17 and 1 tie; 13 need 32.
    assert visiting_order(np.array([17, *range(11)])).tolist() == [1, 0, *range(2, 12)]
    assert visiting_order(np.array([17, *range(12)])).tolist() == [*range(1, 13), 0]
