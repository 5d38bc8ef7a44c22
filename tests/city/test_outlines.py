"""Outlines as real maps have them: closed, with repeated corners, crossing themselves, clockwise, over one another."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fireworld.city.air import cover_cells
from fireworld.city.build import build_city, physics_of, visiting_order
from fireworld.city.city import City, Plan
from fireworld.city.formats.json_plan import parse_plan
from fireworld.city.formats.json_text import plan_text
from fireworld.city.links import radiation_links, wall_table
from fireworld.city.outlines import walls_of, without_repeats
from fireworld.errors import CityError
from fireworld.parameters import FireParameters
from tests.city.plans import footprints, plan, rectangle
from tests.reference import outlines as reference

FIRE = FireParameters()
OPEN = rectangle(0, 0, 10_000, 6000)
CLOSED = [*OPEN, OPEN[0]]


def wall_area(*outlines):
    return physics_of(footprints(*outlines), FIRE)["wall_area_m2"].tolist()


def footprints_of(outline):
    """Return the footprints of one outline, which need not enclose any area."""
    corners = np.array(outline, dtype=np.int32)
    ptr = np.array([0, len(corners)], dtype=np.int32)
    return replace(footprints(OPEN), outline_ptr=ptr, outline_mm=corners)


def cells(outline, cell_mm=5000):
    try:
        air = cover_cells(footprints_of(outline), cell_mm)
    except CityError:  # what two loops hold alike is outside of both
        return {}
    return dict(zip(zip(air.x.tolist(), air.y.tolist(), strict=True), air.percent.tolist(), strict=True))


def links_of(*outlines):
    found = footprints(*outlines)
    return radiation_links(found, visiting_order(found.building_id), FIRE, seed=1)


def test_wall_area_leaves_out_only_the_way_from_the_last_corner_listed():
    # Walls of 10, 6, 10 and 6 m, 3 m high: without the last one 78 m2; where the first corner is repeated, all 96.
    assert wall_area(OPEN, CLOSED, [*CLOSED, OPEN[0]]) == [78.0, 96.0, 96.0]
    # Begun at another corner, a wall of 10 m is the last one.
    assert wall_area([*OPEN[1:], OPEN[0]]) == [66.0]
    doubled = [corner for corner in OPEN for _ in range(2)]
    assert wall_area(doubled) == [78.0]


def test_walls_of_a_closed_outline_end_with_one_that_has_no_length():
    walls = walls_of(footprints(CLOSED, OPEN))
    assert walls.building.tolist() == [0] * 5 + [1] * 4
    assert walls.length_mm.tolist() == [10_000, 6000, 10_000, 6000, 0, 10_000, 6000, 10_000, 6000]
    assert np.flatnonzero(walls.closing).tolist() == [4, 8]


def test_a_corner_listed_twice_makes_no_wall():
    walls = walls_of(footprints([OPEN[0], OPEN[1], OPEN[1], *OPEN[2:]]))
    assert walls.length_mm.tolist() == [10_000, 6000, 10_000, 6000]


def test_walls_without_length_send_no_rays():
    # 0.0025 rays a mm: 25, 15, 25, 15.
    for outline, n_rays in ((OPEN, [25, 15, 25, 15]), (CLOSED, [25, 15, 25, 15, 0])):
        found = footprints(outline)
        assert wall_table(found, visiting_order(found.building_id), FIRE).n_rays.tolist() == n_rays
        assert reference.n_rays(outline, FIRE.ray_rate_per_mm) == n_rays


@pytest.mark.parametrize(("rate", "n_rays"), [(0.0025, [5, 3, 5, 3]), (0.002, [5, 3, 5, 3]), (0.0021, [5, 3, 5, 3])])
def test_the_rate_of_rays_is_a_number_of_single_precision(rate, n_rays):
    # In single precision 0.002 is 0.0020000000949949026: 2 m make 4.00000019 rays, which are 5, and 1 m makes 3.
    assert float(np.float32(0.002)) * 2000 > 4
    outline = rectangle(0, 0, 2000, 1000)
    walls = wall_table(footprints(outline), np.array([0], dtype=np.int32), FireParameters(ray_rate_per_mm=rate))
    assert walls.n_rays.tolist() == n_rays == reference.n_rays(outline, rate)


def test_a_repeated_corner_changes_no_link():
    other = rectangle(14_000, 0, 10_000, 6000)
    plain = links_of(OPEN, other)
    assert len(plain.building) == 2
    for outline in (CLOSED, [OPEN[0], *CLOSED], [OPEN[0], OPEN[1], OPEN[1], *OPEN[2:]]):
        again = links_of(outline, other)
        np.testing.assert_array_equal(again.share, plain.share)


def test_buildings_on_top_of_each_other_and_touching_ones():
    # The second lies on the first, the third shares its east wall: what the walls share the first one visited takes.
    links = links_of(OPEN, OPEN, rectangle(10_000, 0, 10_000, 6000))
    assert links.ptr[-1] == len(links.building) > 0
    assert wall_area(OPEN, OPEN) == [78.0, 78.0]
    city = build_city(plan(OPEN, OPEN, rectangle(10_000, 0, 10_000, 6000)), FIRE, seed=1)
    assert [city.near.building[a:b].tolist() for a, b in zip(city.near.ptr, city.near.ptr[1:], strict=False)] == [
        [1, 2],
        [0, 2],
        [0, 1],
    ]


def test_points_on_a_wall_are_decided_by_the_double_rounding():
    # On the diagonal 3500 / 12500 * 12500 is 3500.0000000000005, and so is 7000 a bit more: these two points of the
    # diagonal lie left of it, all others on it or right of it.
    assert 3500 / 12_500 * 12_500 > 3500
    assert 7000 / 12_500 * 12_500 > 7000
    right = cells([(0, 0), (12_500, 0), (12_500, 12_500)])
    assert [right[k, k] for k in range(3)] == [55 - 1, 55 - 1, 15]
    left = cells([(0, 0), (12_500, 12_500), (0, 12_500)])
    assert [left[k, k] for k in range(3)] == [45 + 1, 45 + 1, 10]


def test_inside_an_outline_that_crosses_itself():
    # Two triangles joined at their tips in (5000, 5000), each half of the samples of its half of the square.
    hourglass = [(0, 0), (10_000, 0), (0, 10_000), (10_000, 10_000)]
    assert cells(hourglass, 10_000) == reference.covers(hourglass, (0, 0), 10_000)
    assert sum(cells(hourglass, 10_000).values()) == 50
    # A square run through twice has no inside, but the smaller square in it has.
    twice = [*rectangle(0, 0, 10_000, 10_000), (0, 0), *rectangle(0, 0, 5000, 5000)]
    assert cells(twice, 5000) == {(0, 1): 100, (1, 0): 100, (1, 1): 100}


@pytest.mark.parametrize("shift", [(0, 0), (-9_123_457, -777), (900_000_000, -900_000_000)])
def test_direction_place_and_start_of_an_outline(shift):
    outline = [(0, 0), (9000, 500), (12_300, 8100), (12_300, 8100), (8000, 6000), (4000, 4000)]
    moved = [(x + shift[0], y + shift[1]) for x, y in outline]
    expected = reference.covers(moved, (min(x for x, _ in moved), min(y for _, y in moved)), 5000)
    assert cells(moved) == expected
    assert cells(moved[::-1]) == expected
    assert cells([*moved[2:], *moved[:2], moved[2]]) == expected


GRID = st.integers(0, 24).map(lambda k: 500 * k)


@settings(max_examples=60)
@given(st.lists(st.tuples(GRID, GRID), min_size=4, max_size=9), st.booleans())
def test_any_outline_is_what_the_reference_makes_of_it(corners, closed):
    frame = rectangle(0, 0, 12_500, 12_500)  # so that every outline covers something
    outline = [*frame, frame[0], *corners] + ([frame[0]] if closed else [])
    found = footprints_of(outline)
    assert cells(outline) == reference.covers(outline, (0, 0), 5000)
    assert physics_of(found, FIRE)["wall_area_m2"].tolist() == [reference.wall_area_m2(outline)]
    walls = wall_table(found, visiting_order(found.building_id), FIRE)
    assert walls.n_rays.tolist() == reference.n_rays(outline, FIRE.ray_rate_per_mm)


def test_repeats_can_be_left_out():
    ptr, corners = without_repeats(footprints([*CLOSED, OPEN[0]], [OPEN[0], OPEN[1], OPEN[1], *OPEN[2:]], OPEN))
    assert ptr.tolist() == [0, 4, 8, 12]
    assert corners.tolist() == [list(corner) for corner in OPEN * 3]


def document(*outlines, **more):
    buildings = [{"id": 10 + k, "apexes": [x for corner in each for x in corner]} for k, each in enumerate(outlines)]
    return json.dumps({"buildings": buildings, **more}).encode()


def read(*outlines, **more):
    return parse_plan(document(*outlines, **more), where="city.json")


HOURGLASS = [(0, 0), (10_000, 0), (4000, 10_000), (6000, 10_000)]


def test_outlines_that_cross_themselves_are_noted():
    assert read(OPEN, CLOSED).notes == ()
    note = "outlines that cross or touch themselves: {}; the even-odd rule says what is inside"
    assert read(OPEN, HOURGLASS).notes == (note.format("building 11"),)
    assert read(*[HOURGLASS] * 7).notes == (note.format("buildings 10, 11, 12, 13, 14 and 2 more"),)


def test_corners_and_notes_survive_being_written_and_read():
    source = {"map": "kobe", "licence": {"name": "BSD-3-Clause", "years": [2009, 2025]}, "none": None}
    before = read(CLOSED, HOURGLASS, [OPEN[0], OPEN[1], OPEN[1], *OPEN[2:]], source=source)
    assert before.source == source
    again = parse_plan(plan_text(before).encode(), where="again.json", name="other")
    assert again.source == source
    assert again.notes == before.notes
    np.testing.assert_array_equal(again.footprints.outline_mm, before.footprints.outline_mm)
    assert read(OPEN).source is None
    assert "source" not in json.loads(plan_text(read(OPEN)))


def test_a_recorded_outline_says_nothing_of_how_it_is_closed():
    from fireworld.parameters import PAPER
    from fireworld.simulation.observer import city_record
    from fireworld.simulation.placement import Placement

    nobody = np.zeros(0, dtype=np.int32)
    placement = Placement(nobody, nobody, nobody.reshape(0, 2), nobody)

    def recorded(found: Plan):
        city: City = build_city(found, PAPER.fire, seed=1)
        return city_record(city, placement, PAPER)

    plain, closed = recorded(plan(OPEN)), recorded(plan([OPEN[0], *CLOSED]))
    assert plain.outline_ptr.tolist() == closed.outline_ptr.tolist() == [0, 4]
    assert plain.outline_x_m.tolist() == closed.outline_x_m.tolist()
    assert plain.wall_area_m2.tolist() == [78.0]
    assert closed.wall_area_m2.tolist() == [96.0]
