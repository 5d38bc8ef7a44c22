"""The ray caster: hand-made walls, and every ray against all walls in exact arithmetic."""

from __future__ import annotations

import re
import time
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from fireworld.city import links
from fireworld.city.build import visiting_order
from fireworld.city.links import radiation_links
from fireworld.city.outlines import walls_of
from fireworld.errors import CityError
from fireworld.parameters import FireParameters
from tests.city.plans import footprints, rectangle, walls_hit

FIRE = FireParameters()


def hit(plan, source, start, end, order=None):
    order = visiting_order(plan.building_id) if order is None else np.array(order, dtype=np.int32)
    rays = {"source": np.array([source]), "start_mm": np.array([start]), "end_mm": np.array([end])}
    return int(walls_hit(plan, order, **rays)[0])


def exact_hit(walls, source, start, end):
    """Meet every wall as fractions; ties to the lowest wall."""
    best = (Fraction(2), -1)
    rx, ry = end[0] - start[0], end[1] - start[1]
    for w, ((ax, ay), (bx, by)) in enumerate(zip(walls.start_mm.tolist(), walls.end_mm.tolist(), strict=True)):
        determinant = rx * (by - ay) - ry * (bx - ax)
        if determinant == 0 or w == source:
            continue
        at = Fraction((ax - start[0]) * (by - ay) - (ay - start[1]) * (bx - ax), determinant)
        across = Fraction((ax - start[0]) * ry - (ay - start[1]) * rx, determinant)
        if 0 <= at <= 1 and 0 <= across <= 1:
            best = min(best, (at, w))
    return best[1]


def links_of(plan, seed=1):
    return radiation_links(plan, visiting_order(plan.building_id), FIRE, seed=seed)


def test_a_ray_meets_the_nearest_wall_and_never_its_own():
    # Walls of a rectangle: 0 south, 1 east, 2 north, 3 west; the second one begins at 4.
    plan = footprints(rectangle(0, 0, 10_000, 10_000), rectangle(20_000, 0, 10_000, 10_000))
    assert hit(plan, 1, (10_000, 5000), (60_000, 5000)) == 7
    assert hit(plan, 1, (10_000, 5000), (-60_000, 5000)) == 3
    assert hit(plan, 1, (10_000, 5000), (19_999, 5000)) == -1
    assert hit(plan, 1, (10_000, 5000), (20_000, 5000)) == 7  # touching counts
    assert hit(plan, 1, (10_000, 5000), (10_000, 90_000)) == 2  # at the corner; along its own wall until there
    assert hit(plan, 0, (5000, 0), (5000, -200_000)) == -1


def test_a_parallel_wall_is_never_met():
    plan = footprints(rectangle(0, 0, 10_000, 10_000), rectangle(20_000, 0, 10_000, 10_000))
    assert hit(plan, 2, (10_000, 10_000), (60_000, 10_000)) == 1  # its own corner first
    assert hit(plan, 3, (10_001, 10_000), (60_000, 10_000)) == 7  # the corner of the other, not its north wall


def test_of_two_coinciding_walls_the_one_visited_first_is_met():
    plan = footprints(
        rectangle(0, 0, 10_000, 10_000), rectangle(20_000, 0, 10_000, 10_000), rectangle(20_000, 0, 10_000, 20_000)
    )
    assert hit(plan, 1, (10_000, 5000), (60_000, 5000), order=[0, 1, 2]) == 7
    assert hit(plan, 1, (10_000, 5000), (60_000, 5000), order=[2, 0, 1]) == 11


@pytest.mark.parametrize("seed", range(6))
def test_the_grid_misses_no_wall(seed):
    draw = np.random.default_rng(seed)
    size = [20_000, 200_000, 5_000_000][seed % 3]
    outlines = []
    for _ in range(60):  # triangles of any size, in one another's way
        base, reach = draw.integers(0, size, 2), int(draw.choice([900, 12_000, size // 2]))
        triangle = base + draw.integers(-reach, reach + 1, (3, 2))
        outlines.append([(int(x), int(y)) for x, y in triangle])
    outlines = [
        o for o in outlines if (o[1][0] - o[0][0]) * (o[2][1] - o[0][1]) != (o[2][0] - o[0][0]) * (o[1][1] - o[0][1])
    ]
    plan = footprints(*outlines)
    walls = walls_of(plan)
    source = draw.integers(0, len(walls.building), 300)
    place = draw.uniform(size=(300, 1))
    start = np.floor(walls.start_mm[source] + place * (walls.end_mm - walls.start_mm)[source]).astype(np.int64)
    end = start + draw.integers(-200_000, 200_001, (300, 2))
    end[:20, 0], end[20:40, 1] = start[:20, 0], start[20:40, 1]
    order = np.arange(len(outlines), dtype=np.int32)
    hits = walls_hit(plan, order, source=source, start_mm=start, end_mm=end)
    rays = zip(source.tolist(), start.tolist(), end.tolist(), strict=True)
    assert hits.tolist() == [exact_hit(walls, *ray) for ray in rays]
    assert (hits >= 0).any()


def test_two_long_walls_face_to_face():
    # A wall 400 m long and 1 m away from its neighbour: of its rays half leave outwards, and nearly all those hit.
    plan = footprints(rectangle(0, 0, 400_000, 2000), rectangle(0, 3000, 400_000, 2000))
    links = links_of(plan)
    n_rays = np.ceil(walls_of(plan).length_mm * FIRE.ray_rate_per_mm).reshape(2, 4).sum(axis=1)
    assert n_rays.tolist() == [2010.0, 2010.0]
    # North and south walls send 1000 rays each; about half of the facing one's reach the neighbour.
    assert links.building.tolist() == [1, 0]
    assert links.share == pytest.approx([500 / 2010] * 2, abs=0.04)


def test_too_many_rays_are_refused_by_the_name_of_the_building_that_sends_most():
    plan = footprints(rectangle(0, 0, 10_000, 10_000), rectangle(20_000, 0, 10_000_000, 10_000_000), ids=[4, 7])
    order = visiting_order(plan.building_id)
    with pytest.raises(CityError) as caught:
        radiation_links(plan, order, replace(FIRE, ray_rate_per_mm=10.0), seed=1, where="here")
    assert str(caught.value) == (
        "here: building 7: apexes: expected at most 10002000 rays from all walls, at 10 a mm, got 400400000, "
        "400000000 of them from this one; try a smaller parameters.fire.ray_rate_per_mm"
    )


def test_walls_that_lie_on_one_another_are_refused(monkeypatch):
    plan = footprints(*[rectangle(100 * k, 100 * k, 10_000, 10_000) for k in range(50)], ids=range(7, 57))
    monkeypatch.setattr(links, "COMPARED_FREE", 0)
    monkeypatch.setattr(links, "COMPARED_PER_RAY", 200)
    links_of(plan)
    monkeypatch.setattr(links, "COMPARED_PER_RAY", 1)
    with pytest.raises(CityError) as caught:
        links_of(plan)
    assert re.fullmatch(
        r"city: building \d+: apexes: expected at most (\d+) comparisons of \1 rays with walls, got more: "
        "too many walls lie on one another",
        str(caught.value),
    )


def comb(x_mm: int, *, teeth: int) -> list[tuple[int, int]]:
    """An outline of two corners for each tooth, which are 20 m long and 20 cm apart."""
    zigzag = [(100 * k, x_mm + 20_000 * (k % 2)) for k in range(2 * teeth)]
    return [*zigzag, (200 * teeth, -9000 - x_mm), (0, -9000 - x_mm)]


@pytest.mark.slow
def test_stacked_combs_are_refused_in_seconds():
    """In one cell of the grid, because another building is far away, lie all their walls."""
    plan = footprints(*[comb(k, teeth=1990) for k in range(20)], rectangle(10**6, 10**6, 10_000, 10_000))
    began = time.process_time()
    with pytest.raises(CityError, match="too many walls lie on one another"):
        links_of(plan)
    assert time.process_time() - began < 10


def test_a_lonely_building_has_no_links():
    links = links_of(footprints(rectangle(0, 0, 10_000, 10_000)))
    assert links.ptr.tolist() == [0, 0]
    assert len(links.building) == len(links.share) == 0


def test_a_new_building_far_away_changes_nobodys_rays():
    near = [rectangle(20_000 * k, 15_000 * j, 12_000, 11_000) for k in range(4) for j in range(4)]
    before = links_of(footprints(*near))
    after = links_of(footprints(rectangle(900_000, 900_000, 9000, 9000), *near, ids=[99, *range(16)]))
    assert after.ptr[1] == 0
    np.testing.assert_array_equal(after.building, before.building + 1)
    np.testing.assert_array_equal(after.share, before.share)


def test_another_seed_is_another_luck():
    plan = footprints(*[rectangle(20_000 * k, 0, 12_000, 11_000) for k in range(5)])
    assert not np.array_equal(links_of(plan, seed=1).share, links_of(plan, seed=2).share)
    np.testing.assert_array_equal(links_of(plan, seed=1).share, links_of(plan, seed=1).share)
