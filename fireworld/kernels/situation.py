"""What a brigade sees around a target: its own tank and way, the side and the site; for networks that read it."""

from __future__ import annotations

import numpy as np

from fireworld.kernels.arrays import Array, NetworkArrays
from fireworld.kernels.episode_arrays import Ranks
from fireworld.kernels.jit import inner
from fireworld.kernels.ranking import BEYOND, METERS_100, N_WEIGHTS, Sight, know_building

N_AROUND = 13
N_SEEN = N_WEIGHTS + N_AROUND
"""What a network may read: the features of a target, the action that names it, and what is around it."""
N_SIDES = 4
TEN_STEPS = 10.0
MOST, MOST_FAR = 3.0, 10.0
"""Above these, what is counted in tens of steps, and in hundreds of metres or roots, is no longer distinguished."""


@inner
def reads_around(network: NetworkArrays) -> bool:
    """Return whether a network reads what is around a target."""
    found = False
    for k in range(len(network.feature)):
        found = found or network.feature[k] >= N_WEIGHTS
    return found


@inner
def side_at(x: float, y: float, site: int, sight: Sight) -> int:
    """Return on which side of a site a point lies, by the middle of its box: 0 south-west, 1 -east, 2 north-, 3."""
    sites = sight.sites
    east = x >= 0.5 * (sites.west[site] + sites.east[site])
    north = y >= 0.5 * (sites.south[site] + sites.north[site])
    return (1 if east else 0) + (2 if north else 0)


@inner
def sum_up(step: int, n_brigades: int, sight: Sight, ranks: Ranks) -> None:
    """Add up what burns on each side of every site, and write what all see alike around each building, once a step."""
    if ranks.summed[0] == step:
        return
    ranks.summed[0] = step
    sites, geometry = sight.sites, sight.geometry
    for site in range(sites.counts[0]):
        needed = 0.0
        for side in range(N_SIDES):
            ranks.side_burning[site, side] = ranks.side_kindling[site, side] = 0.0
        for k in range(sites.start[site], sites.start[site + 1]):
            b = np.int64(sites.member[k])
            know_building(b, step, sight)
            side = side_at(geometry.x[b], geometry.y[b], site, sight)
            ranks.side[b] = side
            ranks.side_burning[site, side] += 1.0
            ranks.side_kindling[site, side] += sight.described[b, 5]
            needed += sight.described[b, 6] * sight.described[b, 6]
        around_site(site, needed, float(n_brigades), sight, ranks)


@inner
def total(values: Array) -> float:
    """Return the sum over the sides, (4,), in their order."""
    return ((values[0] + values[1]) + values[2]) + values[3]


@inner
def refuge_distance(b: int, sight: Sight) -> float:
    """Return how far a building is from the nearest refuge, in hundreds of metres."""
    geometry, least = sight.geometry, np.inf
    for k in range(len(sight.streets.refuge)):
        refuge = sight.streets.refuge[k]
        dx, dy = geometry.x[b] - geometry.x[refuge], geometry.y[b] - geometry.y[refuge]
        least = min(least, dx * dx + dy * dy)
    return min(np.sqrt(least) / METERS_100, MOST_FAR)


@inner
def around_site(site: int, needed: float, team: float, sight: Sight, ranks: Ranks) -> None:
    """Write what all see alike around the burning buildings of a site into `ranks.around`; MODEL 7.1.

    `needed` is how many steps one brigade would have to spray them; `team` how many brigades there are.
    """
    sites, geometry = sight.sites, sight.geometry
    n_burning, kindling = total(ranks.side_burning[site]), total(ranks.side_kindling[site])
    x, y = 0.5 * (sites.west[site] + sites.east[site]), 0.5 * (sites.south[site] + sites.north[site])
    burning_each, needed_each = min(np.sqrt(n_burning / team), MOST_FAR), min(np.sqrt(needed / team), MOST_FAR)
    all_kindling, n_others = min(np.sqrt(kindling), MOST_FAR), min(float(sites.counts[0] - 1), MOST)
    for k in range(sites.start[site], sites.start[site + 1]):
        b = np.int64(sites.member[k])
        around, side = ranks.around[b], np.int64(ranks.side[b])
        around[2] = refuge_distance(b, sight)
        around[3], around[4], around[5] = burning_each, needed_each, all_kindling
        around[6] = ranks.side_burning[site, side] / n_burning
        around[7] = ranks.side_kindling[site, side] / kindling if kindling > 0.0 else 0.0
        dx, dy = geometry.x[b] - x, geometry.y[b] - y
        around[9] = min(np.sqrt(dx * dx + dy * dy) / METERS_100, MOST)
        around[10] = n_others


@inner
def place_others(brigade: int, known: Array, sight: Sight, ranks: Ranks) -> None:
    """Work out what a brigade sees alike around all buildings of a site, or of a side of it; MODEL 7.1.

    Which share of the others goes for them; `known` (b,) is what they go for, -1 nothing. How long it can spray.
    """
    sites, brigades, others = sight.sites, sight.brigades, max(float(len(known) - 1), 1.0)
    for site in range(sites.counts[0]):
        for side in range(N_SIDES):
            ranks.side_others[site, side] = 0.0
    for other in range(len(known)):
        target = known[other]
        if other != brigade and target >= 0 and sites.place[target] >= 0:
            ranks.side_others[sites.place[target], ranks.side[target]] += 1.0
    for site in range(sites.counts[0]):
        ranks.site_others[site] = total(ranks.side_others[site]) / others
        for side in range(N_SIDES):
            ranks.side_others[site, side] /= others
    ranks.sprays_left[0] = min(brigades.tank[brigade] / max(sight.brigade_constants.power, 1) / TEN_STEPS, MOST)


@inner
def describe_around(brigade: int, first: int, end: int, sight: Sight, ranks: Ranks, out: Array) -> None:
    """Write what is around the buildings [first, end) in the row for a brigade; MODEL 7.1.

    In this step all has been summed up, and the others of this brigade placed. `out` (n, 30) float64 has the features
    of these buildings in its first columns; written are the last 13.
    """
    sites, per_step = sight.sites, max(sight.brigade_constants.speed, 1)
    for k in range(np.uint64(first), np.uint64(end)):
        b, seen = np.int64(sites.member[k]), out[k - np.uint64(first)]
        site, around, alike = np.int64(sites.place[b]), seen[N_WEIGHTS:], ranks.around[b]
        for j in range(N_AROUND):
            around[j] = alike[j]
        around[0] = ranks.sprays_left[0]
        around[1] = min(seen[BEYOND] * METERS_100 / per_step / TEN_STEPS, MOST)
        around[8] = ranks.side_others[site, np.int64(ranks.side[b])]
        around[11] = 0.0 if sites.number[site] == sight.brigades.site[brigade] else 1.0
        around[12] = ranks.site_others[site]
