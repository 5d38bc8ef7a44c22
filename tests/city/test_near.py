"""The neighbourhood that makes fire sites."""

from __future__ import annotations

import numpy as np
import pytest

from fireworld.city import near as module
from fireworld.city.city import Links
from fireworld.city.near import near_relation
from fireworld.errors import CityError
from tests.city.plans import footprints, rectangle


def no_links(n):
    return Links(np.zeros(n + 1, np.int32), np.empty(0, np.int32), np.empty(0, np.float32))


def near(plan, links=None):
    relation = near_relation(plan, no_links(len(plan.building_id)) if links is None else links)
    assert (relation.share == 1).all()
    return [
        relation.building[begin:end].tolist() for begin, end in zip(relation.ptr[:-1], relation.ptr[1:], strict=True)
    ]


@pytest.mark.parametrize(("gap_mm", "related"), [(29_999, True), (30_000, False), (30_001, False), (0, True)])
def test_closer_than_thirty_metres_strictly(gap_mm, related):
    plan = footprints(rectangle(0, 0, 5000, 5000), rectangle(5000 + gap_mm, 1000, 5000, 5000))
    assert near(plan) == ([[1], [0]] if related else [[], []])


@pytest.mark.parametrize(("more_mm", "related"), [(0, False), (-1, True)])
def test_corner_to_corner(more_mm, related):
    # 18 m and 24 m apart: 30 m exactly.
    plan = footprints(rectangle(0, 0, 5000, 5000), rectangle(23_000, 29_000 + more_mm, 5000, 5000))
    assert near(plan) == ([[1], [0]] if related else [[], []])


def test_the_middle_of_a_wall_counts():
    wedge = [(100_000, 29_000), (101_000, 60_000), (99_000, 60_000)]
    assert near(footprints(rectangle(0, -5000, 200_000, 5000), wedge)) == [[1], [0]]


def test_crossing_buildings_are_near_however_far_their_corners():
    bars = rectangle(-100_000, -1000, 200_000, 2000), rectangle(-1000, -100_000, 2000, 200_000)
    assert near(footprints(*bars)) == [[1], [0]]


def test_links_relate_in_both_directions():
    plan = footprints(*[rectangle(100_000 * k, 0, 5000, 5000) for k in range(3)])
    links = Links(np.array([0, 0, 0, 1], np.int32), np.array([0], np.int32), np.array([0.01], np.float32))
    assert near(plan, links) == [[2], [], [0]]


def test_links_named_twice_and_of_near_buildings_count_once():
    plan = footprints(*[rectangle(20_000 * k, 0, 5000, 5000) for k in range(4)])
    ptr, building = np.array([0, 2, 3, 3, 4], np.int32), np.array([1, 3, 0, 0], np.int32)
    assert near(plan, Links(ptr, building, np.ones(4, np.float32))) == [[1, 3], [0, 2], [1, 3], [0, 2]]


def test_a_building_over_the_whole_city_is_near_all():
    crowd = [rectangle(40_000 * (k % 30), 40_000 * (k // 30), 5000, 5000) for k in range(900)]
    found = near(footprints(*crowd[:450], rectangle(-500_000, -500_000, 2_500_000, 2_500_000), *crowd[450:]))
    wall = [k for k, other in enumerate(found) if 450 in other]
    assert wall == found[450] == []  # its walls are far from all of them
    ring = [(-10_000, -10_000), (1_190_000, -10_000), (1_190_000, 1_190_000), (-10_000, 1_190_000)]
    found = near(footprints(*crowd, ring))
    at_the_edge = [k for k in range(900) if {k % 30, k // 30} & {0, 29}]
    assert found[900] == at_the_edge
    assert [k for k in range(900) if 900 in found[k]] == at_the_edge


def test_many_neighbours_need_more_room():
    heap = [rectangle(100 * k, 100 * k, 5000, 5000) for k in range(40)]
    assert near(footprints(*heap)) == [[other for other in range(40) if other != k] for k in range(40)]


@pytest.mark.parametrize("seed", range(4))
def test_outlines_that_cross_themselves_and_repeat_corners(seed):
    import shapely

    draw = np.random.default_rng(seed)
    outlines = []
    for _ in range(60):
        corners = draw.integers(0, 400_000, 2) + draw.integers(-30_000, 30_000, (draw.integers(3, 8), 2))
        corners = np.repeat(corners, draw.integers(1, 3, len(corners)), axis=0)
        outlines.append([(int(x), int(y)) for x, y in corners])
    rings = [shapely.LinearRing(outline) for outline in outlines]
    closer = np.array([[one.distance(other) < 30_000 for other in rings] for one in rings])
    np.fill_diagonal(closer, val=False)
    listed = [[*outline, outline[0]] if k % 2 else outline for k, outline in enumerate(outlines)]
    assert near(footprints(*listed)) == [np.flatnonzero(row).tolist() for row in closer]


@pytest.mark.parametrize("seed", range(4))
def test_agrees_with_shapely(seed):
    import shapely

    draw = np.random.default_rng(seed)
    outlines = []
    for _ in range(80):
        x, y, width, depth = draw.integers([0, 0, 2000, 2000], [400_000, 250_000, 40_000, 20_000])
        corners = np.array(rectangle(0, 0, int(width), int(depth))) @ np.array([[3, 4], [-4, 3]]) // 5 + [x, y]
        outlines.append([(int(a), int(b)) for a, b in corners])
    rings = shapely.linearrings([[*outline, outline[0]] for outline in outlines])
    closer = shapely.distance(rings[:, None], rings[None, :]) < 30_000
    np.fill_diagonal(closer, val=False)
    assert near(footprints(*outlines)) == [np.flatnonzero(row).tolist() for row in closer]
    assert closer.any(axis=1).sum() > 40


def test_outlines_of_many_corners_around_one_another_are_refused(monkeypatch):
    """Rings, each within the box of the next, but 31 m away from it: every wall of both would be compared."""
    rings = []
    for half in range(40_000, 400_000, 31_500):
        side = range(-half, half, half // 20)
        rings.append([
            *((x, -half) for x in side), *((half, y) for y in side), *((-x, half) for x in side),
            *((-half, -y) for y in side),
        ])  # fmt: skip
    plan = footprints(*rings, ids=range(7, 7 + len(rings)))
    monkeypatch.setattr(module, "COMPARED_FREE", 0)
    monkeypatch.setattr(module, "COMPARED_PER_BUILDING", 200_000)
    assert near(plan) == [[]] * len(rings)
    monkeypatch.setattr(module, "COMPARED_PER_BUILDING", 5000)
    wanted = "city: building [0-9]+: apexes: expected outlines that are compared at no more than 60000 pairs of walls"
    with pytest.raises(CityError, match=wanted):
        near(plan)
