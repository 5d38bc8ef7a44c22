"""Courtyards cut into outlines: area, inside and length by hand, and what the model makes of them."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fireworld.city.build import build_city
from fireworld.city.city import Plan, StreetMap
from fireworld.city.formats.osm.keyhole import with_courtyards
from fireworld.city.formats.osm.rings import is_inside
from fireworld.city.outlines import Building, assemble, centroid_mm, doubled_area_mm2
from fireworld.parameters import PRESETS


def box(west, south, east, north):
    return [(west, south), (east, south), (east, north), (west, north)]


def length(outline):
    return sum(
        np.hypot(x2 - x1, y2 - y1) for (x1, y1), (x2, y2) in zip(outline, outline[1:] + outline[:1], strict=True)
    )


def test_the_slit_is_the_shortest_way():
    outline, slits = with_courtyards(box(0, 0, 20000, 20000), [box(2000, 8000, 6000, 12000)])
    assert slits == 2000
    assert doubled_area_mm2(outline) == 2 * (20000**2 - 4000**2)
    assert length(outline) == 80000 + 16000 + 2 * 2000
    assert outline == [
        (0, 0), (20000, 0), (20000, 20000), (0, 20000), (0, 8000),
        (2000, 8000), (2000, 12000), (6000, 12000), (6000, 8000), (2000, 8000), (0, 8000),
    ]  # fmt: skip


def test_a_slit_between_corners():
    outline, slits = with_courtyards([(0, 0), (10, 0), (10, 10)], [[(8, 4), (9, 6), (8, 6)]])
    assert slits == pytest.approx(1.0)
    assert doubled_area_mm2(outline) == 100 - 2


def test_a_hole_that_touches_the_outside_needs_none():
    outline, slits = with_courtyards(box(0, 0, 10, 10), [[(0, 0), (4, 2), (2, 4)]])
    assert slits == 0
    assert doubled_area_mm2(outline) == 200 - 12
    assert all(one != other for one, other in pairwise(outline))


@pytest.mark.parametrize("clockwise", [False, True])
def test_rings_may_run_either_way(clockwise):
    outer, hole = box(0, 0, 20, 20), box(5, 5, 10, 10)
    outline, _ = with_courtyards(outer[::-1] if clockwise else outer, [hole[::-1] if clockwise else hole])
    assert doubled_area_mm2(outline) == 2 * (400 - 25)


@settings(max_examples=30)
@given(st.lists(st.tuples(*[st.integers(5, 45)] * 4), min_size=9, max_size=9), st.integers(0, 3), st.booleans())
def test_what_is_inside_stays_inside(drawn, turn, mirrored):
    """Up to nine holes in cells of 100, some left out; area, length and insides as of the rings themselves."""
    holes = [
        box(100 * (k % 3) + a, 100 * (k // 3) + b, 100 * (k % 3) + 50 + c, 100 * (k // 3) + 50 + d)
        for k, (a, b, c, d) in enumerate(drawn)
        if (a + b) % 3
    ]
    outer = box(0, 0, 300, 300)
    outer = outer[turn:] + outer[:turn]
    outline, slits = with_courtyards(outer[::-1] if mirrored else outer, holes)
    assert doubled_area_mm2(outline) == abs(doubled_area_mm2(outer)) - sum(map(doubled_area_mm2, holes))
    assert length(outline) == pytest.approx(length(outer) + sum(map(length, holes)) + 2 * slits)
    for x in range(13, 300, 37):
        for y in range(11, 300, 41):
            if any(x in {west, east} or y in {south, north} for (west, south), _, (east, north), _ in holes):
                continue
            wanted = is_inside(outer, (x, y)) and not any(is_inside(hole, (x, y)) for hole in holes)
            assert is_inside(outline, (x, y)) == wanted, (x, y)


def city_of(*outlines, rays_per_mm=0.0025):
    """A city of buildings, a street beside it."""
    buildings = [
        Building(
            building_id=number, corners_mm=[*outline, outline[0]], centroid_mm=centroid_mm(outline), floors=1,
            material=0, ground_area_m2=doubled_area_mm2(outline) // 2_000_000, inflammable=True, refuge=False,
        )
        for number, outline in enumerate(outlines, start=1)
    ]  # fmt: skip
    streets = StreetMap(
        node_mm=np.array([[-5000, 0], [-5000, 60000]], dtype=np.int32),
        street=np.array([[0, 1]], dtype=np.int32),
        hydrant_node=np.zeros(0, dtype=np.int32),
    )
    fire = replace(PRESETS["paper"].fire, ray_rate_per_mm=rays_per_mm)
    return build_city(Plan("two", assemble(buildings), streets), fire, seed=1)


def test_what_the_model_makes_of_a_courtyard():
    outer, hole, neighbour = box(0, 0, 60000, 60000), box(20000, 20000, 40000, 40000), box(70000, 0, 80000, 60000)
    cut, slits = with_courtyards(outer, [hole])
    assert slits == 20000
    city, solid = (city_of(one, neighbour, rays_per_mm=0.2) for one in (cut, outer))
    # The slit's two walls count as walls; the closing wall has no length.
    assert city.wall_area_m2[0] == (240 + 80 + 2 * 20) * 3
    assert city.volume_m3[0] == (3600 - 400) * 3
    covered = city.air.percent[: city.air.ptr[1]].sum() / 100 * 25
    assert covered == 3600 - 400
    # What meets the neighbour is what it would be without the courtyard: rays from the slit meet the slit.
    out, out_solid = (float(one.wall_area_m2[0] * one.links.share[0]) for one in (city, solid))
    assert city.links.building[0] == solid.links.building[0] == 1
    assert out == pytest.approx(out_solid, rel=0.05)


def test_rays_from_the_slit_meet_the_slit():
    cut, _ = with_courtyards(box(0, 0, 60000, 60000), [box(20000, 20000, 40000, 40000)])
    city = city_of(cut, box(70000, 0, 80000, 60000))
    n_rays = 4 * 150 + 4 * 50 + 2 * 50
    hits = city.links.share[0] * n_rays
    assert hits == pytest.approx(round(float(hits)), abs=1e-3)  # the slit's rays are among all rays
    assert 0 < hits < 150  # only those of the eastern wall can meet the neighbour
