"""Fire sites: which burning buildings belong together, their numbers, who is sent where, and the free sides."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from fireworld.kernels.sites import EAST, NORTH, SOUTH, WEST, nearest_burning
from fireworld.scenario.observed import Observed
from tests.kernels.small import METRE, burn, make_city, make_world, site_numbers, square

SPACED = [square(50.0 * k, 0.0) for k in range(7)]  # outlines 40 m apart: neighbours only where linked
ROW = {k: [k + 1] for k in range(6)}


def row_world(n_brigades: int = 0, **others):
    """Seven buildings in a row, each linked to the next."""
    return make_world(make_city(*SPACED, links=ROW), brigades=[0] * n_brigades, **others)


@pytest.mark.parametrize(("gap_mm", "n_sites"), [(29_999, 1), (30_000, 2)])
def test_outlines_closer_than_30_m_are_one_site(gap_mm, n_sites):
    world = make_world(make_city(square(0, 0), square((10_000 + gap_mm) / METRE, 0)))
    burn(world, 0, 1)
    assert len(set(site_numbers(world).values())) == n_sites


@pytest.mark.parametrize("links", [{0: [1]}, {1: [0]}])
def test_a_link_in_either_direction_joins(links):
    world = make_world(make_city(square(0, 0), square(500, 0), square(1000, 0), links=links))
    burn(world, 0, 1, 2)
    assert site_numbers(world) == {0: 1, 1: 1, 2: 2}


def test_only_burning_buildings_connect():
    world = row_world()
    burn(world, 0, 2)
    assert site_numbers(world) == {0: 1, 2: 2}
    burn(world, 0, 1, 2)
    assert site_numbers(world) == {0: 1, 1: 1, 2: 1}


@pytest.mark.parametrize("code", [1, 2, 3])
def test_every_burning_code_counts(code):
    world = row_world()
    burn(world, 3, code=code)
    assert site_numbers(world) == {3: 1}


def test_sites_that_merge_keep_the_lowest_number_and_brigades_follow():
    world = row_world(n_brigades=2)
    brigades = world.state.brigades
    burn(world, 0, 2)
    brigades.site[:] = 1, 2
    burn(world, 0, 1, 2)
    assert site_numbers(world) == {0: 1, 1: 1, 2: 1}
    assert brigades.site.tolist() == [1, 1]
    burn(world, 0, 2)
    assert site_numbers(world) == {0: 1, 2: 3}, "number 2 is never used again"


def test_the_largest_part_of_a_split_site_keeps_the_number():
    world = row_world(n_brigades=1)
    burn(world, 0, 1, 2, 3, 4)
    burn(world, 0, 2, 3, 4)
    assert site_numbers(world) == {0: 2, 2: 1, 3: 1, 4: 1}
    assert world.state.brigades.site.tolist() == [1]
    burn(world, 2, 4)
    assert site_numbers(world) == {2: 1, 4: 3}, "equal parts: the lowest building keeps it"


def test_a_smaller_part_of_a_split_site_that_meets_another_keeps_that_ones_number():
    outlines = [square(50.0 * k, 0.0) for k in range(9)]
    world = make_world(make_city(*outlines, links={k: [k + 1] for k in range(8)}))
    burn(world, 0, 1, 2, 3, 4, 5, 7)
    assert site_numbers(world)[7] == 2
    burn(world, 0, 1, 2, 3, 5, 6, 7)
    assert site_numbers(world) == {0: 1, 1: 1, 2: 1, 3: 1, 5: 2, 6: 2, 7: 2}


def test_a_brigade_whose_site_is_out_goes_to_the_nearest_fire():
    world = row_world(n_brigades=2)
    brigades = world.state.brigades
    brigades.x[:], brigades.y[:] = (0.0, 300.0 * METRE), (0.0, 0.0)
    burn(world, 0, 3, 6)
    assert brigades.site.tolist() == [1, 3]
    burn(world, 3, 6)
    assert brigades.site.tolist() == [2, 3]
    burn(world)
    assert brigades.site.tolist() == [0, 0]
    burn(world, 0)
    assert brigades.site.tolist() == [4, 4]


def test_a_tie_for_the_nearest_fire_goes_to_the_lowest_id():
    world = make_world(make_city(square(-100, 0), square(100, 0), ids=[7, 5]))
    burn(world, 0, 1)
    assert nearest_burning(0.0, 0.0, world.city_arrays.buildings, world.city_arrays.geometry, world.state.sites) == 1
    assert nearest_burning(-1.0, 0.0, world.city_arrays.buildings, world.city_arrays.geometry, world.state.sites) == 0
    burn(world)
    assert nearest_burning(0.0, 0.0, world.city_arrays.buildings, world.city_arrays.geometry, world.state.sites) == -1


def test_sites_are_measured():
    """Volume = 100 m2 * 3 m * floors; the box of the outlines; squares of the nearest building's distances."""
    city = make_city(square(0, 0), square(20, 0), square(300, 400), square(600, 0), floors=[1, 2, 3, 1])
    world = make_world(city, civilians=[(3, 600, 0), (-1, 300, 300), (0, 0, 0)])
    burn(world, 0, 1, 2)
    sites = world.state.sites
    assert sites.counts[:1] == 2
    assert sites.volume[:2].tolist() == [900.0, 900.0]
    assert [side[0] for side in (sites.west, sites.south, sites.east, sites.north)] == [-5000, -5000, 25_000, 5000]
    middle = np.array(city.middle_mm)
    nearest = ((np.array([20_000.0, 0.0]) - middle) ** 2).sum()
    assert sites.center_square[0] == nearest
    assert sites.civilian_square[0] == 280_000.0**2 + 300_000.0**2, "the one indoors in the fire does not count"
    assert sites.civilian_square[1] == 100_000.0**2
    world.state.civilians.hp[:2] = 0
    burn(world, 0, 1, 2)
    assert (sites.civilian_square[:2] > 1e299).all(), "nor do the dead"


@pytest.mark.parametrize(
    ("x_m", "y_m", "sides"),
    [
        (0, 40, NORTH),
        (40, 0, EAST),
        (0, -40, SOUTH),
        (-40, 0, WEST),
        (40, 40, NORTH | EAST),
        (-40, -40, SOUTH | WEST),
    ],
)
def test_a_side_is_free_where_fire_can_spread(x_m, y_m, sides):
    city = make_city(square(0, 0), square(x_m, y_m), links={0: [1]})
    world = make_world(city)
    fieryness, free = world.state.fire.fieryness, world.state.sites.free_sides
    for code, expected in ((0, sides), (4, sides), (5, 0), (6, 0), (7, 0), (8, 0)):
        fieryness[1] = code
        burn(world, 0)
        assert free[0] == expected, code


@pytest.mark.parametrize(
    ("x_m", "y_m", "sides"),
    [
        (19.9, 0, EAST),
        (20, 0, 0),
        (0, 19.9, NORTH),
        (0, -19.9, SOUTH),
        (-19.9, 0, WEST),
        (19.9, 19.9, NORTH | EAST),
        (19.9, 30, EAST),
    ],
)
def test_fire_does_not_jump_a_street_of_10_m(x_m, y_m, sides):
    """Of outlines 10 m wide; without the switch every one of these sides is free."""
    city = make_city(square(0, 0), square(x_m, y_m), links={0: [1]})
    world = make_world(city, observed=Observed(free_edges="streets"))
    burn(world, 0)
    assert world.state.sites.free_sides[0] == sides


def test_what_leaves_a_side_closed():
    outlines = [square(0, 0), square(40, 0)]
    there_only = make_world(make_city(*outlines, links={1: [0]}))
    burn(there_only, 0)
    assert there_only.state.sites.free_sides[0] == 0, "links lead from the burning building"
    refuge = make_world(make_city(*outlines, links={0: [1]}, refuges=[1]))
    burn(refuge, 0)
    assert refuge.state.sites.free_sides[0] == 0, "it must be inflammable"
    beside = make_city(square(0, 0), square(30, 30), square(0, 30), links={0: [2], 1: [2]})
    between = make_world(beside)
    burn(between, 0, 1)
    assert between.state.sites.free_sides[0] == 0, "a centroid within the box lies beyond no side"


def test_a_building_on_the_edge_of_the_box_is_not_beyond_it():
    city = make_city(square(0, 0), square(40, 0), links={0: [1]})
    world = make_world(city)
    geometry = world.city_arrays.geometry._replace(east=np.array([40_000.0, 45_000.0]))
    world.start = dataclasses.replace(world.start, city_arrays=world.city_arrays._replace(geometry=geometry))
    burn(world, 0)
    assert world.state.sites.free_sides[0] == 0


def test_the_order_of_buildings_does_not_matter_to_who_belongs_together():
    shuffled = [4, 0, 6, 2, 5, 1, 3]
    place = {old: new for new, old in enumerate(shuffled)}
    links = {place[k]: [place[k + 1]] for k in range(6)}
    world = make_world(make_city(*(SPACED[old] for old in shuffled), links=links))
    burn(world, *(place[k] for k in (0, 1, 3, 5, 6)))
    numbers = site_numbers(world)
    assert numbers[place[0]] == numbers[place[1]]
    assert numbers[place[5]] == numbers[place[6]]
    assert len(set(numbers.values())) == 3
