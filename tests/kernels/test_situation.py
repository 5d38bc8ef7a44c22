"""What a brigade sees around a target, worked out anew in plain numpy from the definitions of the model, section 7."""

from __future__ import annotations

import numpy as np
import pytest

from fireworld.kernels.ranking import N_WEIGHTS
from fireworld.kernels.ranks import fresh_ranks, line_up, see_row
from fireworld.kernels.situation import N_AROUND, N_SEEN, place_others, sum_up
from fireworld.policy.names import find_policy
from fireworld.policy.teams.ranking_words import AROUND
from fireworld.scenario import load_scenario
from fireworld.simulation.built import build_scenario
from tests.kernels.small import sight_of

TWO_FIRES = {"fires": [{"at": [0.3, 0.3], "n_buildings": 7}, {"at": [0.75, 0.7], "n_buildings": 5}], "brigades.n": 5}


def fought(n_steps, **values):
    world = build_scenario(load_scenario("test-2").with_values({**TWO_FIRES, **values})).world(seed=3)
    policy = find_policy("each-another").policy
    policy.begin(world.city_arrays, world.n_brigades, 3)
    for _ in range(n_steps):
        world.step(policy)
    world.look()
    return world


def by_definition(world, sight, brigade, b, known):
    """The thirteen, in metres and plain sums."""
    city, state, constants = world.city_arrays, world.state, world.constants.brigades
    sites, brigades, geometry = state.sites, state.brigades, city.geometry
    x, y = geometry.x / 1000.0, geometry.y / 1000.0
    site = int(sites.place[b])
    members = sites.member[sites.start[site] : sites.start[site + 1]].astype(int)
    middle = (
        (geometry.west[members].min() + geometry.east[members].max()) / 2000.0,
        (geometry.south[members].min() + geometry.north[members].max()) / 2000.0,
    )
    side = {int(one): (x[one] >= middle[0], y[one] >= middle[1]) for one in members}
    described = {int(one): sight.described[one] for one in members}
    same = [one for one in side if side[one] == side[b]]
    kindling = sum(described[one][5] for one in side)
    others = [int(one) for k, one in enumerate(known) if k != brigade and one >= 0 and sites.place[one] == site]
    far = max(np.hypot(x[b] - brigades.x[brigade] / 1000.0, y[b] - brigades.y[brigade] / 1000.0) - 50.0, 0.0)
    refuges = city.streets.refuge
    team = len(known)
    return {
        "sprays_left": min(brigades.tank[brigade] / constants.power / 10.0, 3.0),
        "way_steps": min(min(far, 300.0) / (constants.speed / 1000.0) / 10.0, 3.0),
        "refuge_distance": min(np.hypot(x[b] - x[refuges], y[b] - y[refuges]).min() / 100.0, 10.0),
        "site_burning": np.sqrt(len(members) / team),
        "site_steps": min(np.sqrt(sum(described[one][6] ** 2 for one in side) / team), 10.0),
        "site_kindling": min(np.sqrt(kindling), 10.0),
        "side_burning": len(same) / len(members),
        "side_kindling": sum(described[one][5] for one in same) / kindling if kindling else 0.0,
        "side_others": sum(side[one] == side[b] for one in others) / (team - 1),
        "outward": min(np.hypot(x[b] - middle[0], y[b] - middle[1]) / 100.0, 3.0),
        "sites": min(sites.counts[0] - 1, 3),
        "other_site": float(sites.number[site] != brigades.site[brigade]),
        "site_others": len(others) / (team - 1),
    }


@pytest.mark.parametrize("n_steps", [0, 4, 11])
def test_it_is_what_the_model_says(n_steps):
    world = fought(n_steps)
    sites, known = world.state.sites, world.state.brigades.target.copy()
    assert sites.counts[0] >= 2
    sight, ranks, seen = (
        sight_of(world),
        fresh_ranks(world.n_brigades, len(sites.place)),
        np.full((len(sites.place), N_SEEN), np.nan),
    )
    line_up(known, sight.geometry, sites, ranks)
    sum_up(1, len(known), sight, ranks)
    names, differing = [one.name for one in AROUND], set()
    for brigade in range(world.n_brigades):
        place_others(brigade, known, sight, ranks)
        see_row(brigade, 0, int(sites.counts[2]), True, sight, ranks, seen)
        for b, row in zip(sites.member[: sites.counts[2]].astype(int), seen, strict=False):
            found = dict(zip(names, row[N_WEIGHTS:].tolist(), strict=True))
            wanted = by_definition(world, sight, brigade, int(b), known)
            assert found == pytest.approx(wanted, rel=1e-9, abs=1e-12)
            differing |= {name for name in names if found[name]}
    assert differing >= {"sprays_left", "way_steps", "refuge_distance", "site_burning", "side_burning", "sites"}
    assert len(names) == N_AROUND == 13
