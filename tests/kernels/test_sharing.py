"""The rule `allocate`, by hand: who goes to which site, and for which building."""

from __future__ import annotations

import numpy as np
import pytest

from fireworld.kernels.sharing import allocate, fresh_shares
from tests.kernels.small import METRE, burn, make_city, make_world, square

EAST = 600.0
"""Metres from the site in the west to that in the east; further ones are as far apart."""


def world_of(*sizes, n_brigades, here=0, free=True):
    """Sites of so many buildings in a row each; the brigades belong to one of them and stand at its first building.

    The buildings are numbered site after site; the last one burns nowhere.
    """
    outlines = [square(EAST * site + 20.0 * k, 0.0) for site, size in enumerate(sizes) for k in range(size)]
    city = make_city(*outlines, square(-EAST, 0.0))
    n = sum(sizes)
    world = make_world(city, brigades=[n] * n_brigades, free=free)
    burn(world, *range(n))
    assert world.state.sites.number[: len(sizes)].tolist() == [*range(1, len(sizes) + 1)]
    brigades = world.state.brigades
    brigades.site[:] = here + 1
    brigades.x[:], brigades.y[:] = here * EAST * METRE, 0.0
    return world


def choose(world, brigade, known=None):
    """What the rule lets a brigade go for."""
    city, state = world.city_arrays, world.state
    known = np.full(world.n_brigades, -1, dtype=np.int32) if known is None else np.array(known, dtype=np.int32)
    where = state.brigades, city.buildings, state.fire, city.geometry, state.sites
    shares = fresh_shares(world.n_brigades, world.city.n_buildings)
    return int(allocate(brigade, known, world.constants.brigades.free, *where, shares))


def shared_out(world):
    """The site, by number, of the building that each brigade goes for, where nobody knows of another."""
    state = world.state
    targets = [choose(world, brigade) for brigade in range(world.n_brigades)]
    return [int(state.sites.number[state.sites.place[b]]) for b in targets]


@pytest.mark.parametrize(
    ("sizes", "n_brigades", "expected"),
    [
        ((3, 3), 4, [2, 2]),
        ((6, 2), 4, [3, 1]),
        ((8, 1), 4, [3, 1]),  # at least one to each
        ((2, 6), 4, [1, 3]),
        ((2, 2, 2), 3, [1, 1, 1]),
        ((6, 3, 3), 4, [2, 1, 1]),
        ((5, 5), 3, [2, 1]),
        ((5, 4), 1, [1, 0]),
        ((1, 7), 1, [1, 0]),  # its share of the other site is below a whole brigade
        ((1, 6, 6), 2, [1, 1, 0]),
        ((4,), 3, [3]),
    ],
)
def test_shares(sizes, n_brigades, expected):
    found = shared_out(world_of(*sizes, n_brigades=n_brigades))
    assert [found.count(site + 1) for site in range(len(sizes))] == expected


def test_what_is_shared_out_stays_so_until_a_share_is_off_by_a_brigade():
    world = world_of(4, 4, n_brigades=4)
    for sites, expected in (
        ([1, 1, 2, 2], [1, 1, 2, 2]),
        ([2, 1, 2, 1], [2, 1, 2, 1]),
        ([1, 1, 1, 2], [1, 1, 2, 2]),  # the first two are as near: the last but one of three stands nearer
    ):
        world.state.brigades.site[:] = sites
        world.state.brigades.x[2] = 200 * METRE
        assert shared_out(world) == expected
    three = world_of(5, 4, n_brigades=3)
    for sites in ([1, 1, 2], [1, 2, 2]):
        three.state.brigades.site[:] = sites
        assert shared_out(three) == sites, "off by a third of a brigade, one way or the other"


def test_the_nearest_that_can_go_does():
    world = world_of(2, 2, n_brigades=4)
    world.state.brigades.x[:] = np.array([0, 300, 400, 500]) * METRE
    assert shared_out(world) == [1, 1, 2, 2]
    world.state.brigades.refilling[3] = 1
    assert shared_out(world)[:3] == [1, 2, 2]
    world.state.brigades.refilling[:] = 0, 0, 1, 1
    assert shared_out(world)[:2] == [2, 2]
    world.state.brigades.refilling[:] = 0
    world.state.brigades.hp[3] = 0  # three live, and one of them is enough for the smaller part
    assert shared_out(world)[:3] == [1, 1, 2]


def test_fixed_all_stay():
    assert shared_out(world_of(2, 6, n_brigades=4, free=False)) == [1, 1, 1, 1]


def test_each_goes_for_the_coolest_that_nobody_has():
    world = world_of(3, n_brigades=4)
    capacity = world.city_arrays.buildings.capacity
    world.state.fire.energy[:3] = capacity[:3] * np.array([300.0, 100.0, 200.0])
    assert choose(world, 0) == 1
    assert choose(world, 1, [1, -1, -1, -1]) == 2
    assert choose(world, 2, [1, 2, -1, -1]) == 0
    assert choose(world, 3, [1, 2, 0, -1]) == 1, "all are taken"
    assert choose(world, 0, [1, -1, -1, -1]) == 1, "what it went for itself is not taken"
    world.state.fire.energy[:3] = capacity[:3] * 100.0
    assert [choose(world, 1, [k, -1, -1, -1]) for k in (0, 1, 2)] == [1, 0, 0], "ties: the lowest id"


def test_without_fire_nobody_goes_anywhere():
    world = world_of(2, n_brigades=1)
    burn(world)
    assert choose(world, 0) == -1
