"""What a brigade sees around a target: its own tank and way, the side and the site; for networks that read it."""

from __future__ import annotations

import numpy as np

from fireworld.kernels.arrays import Array, NetworkArrays
from fireworld.kernels.episode_arrays import Ranks
from fireworld.kernels.jit import inner
from fireworld.kernels.ranking import METERS_100, N_WEIGHTS, Sight, beyond, know_building

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
def sum_up(step: int, sight: Sight, ranks: Ranks) -> None:
    """Add up what burns on each side of every site, once a step."""
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
        ranks.site_needed[site] = needed


@inner
def place_others(brigade: int, known: Array, sight: Sight, ranks: Ranks) -> None:
    """Count on which side of which site the targets of the others are; `known` (b,), -1 nothing."""
    sites = sight.sites
    for site in range(sites.counts[0]):
        for side in range(N_SIDES):
            ranks.side_others[site, side] = 0.0
    for other in range(len(known)):
        target = known[other]
        if other != brigade and target >= 0 and sites.place[target] >= 0:
            ranks.side_others[sites.place[target], ranks.side[target]] += 1.0


@inner
def total(values: Array) -> float:
    """Return the sum over the sides, (4,), in their order."""
    return ((values[0] + values[1]) + values[2]) + values[3]


@inner
def refuge_distance(b: int, sight: Sight) -> float:
    """Return how far a building is from the nearest refuge, in hundreds of metres."""
    geometry, least = sight.geometry, MOST_FAR
    for k in range(len(sight.streets.refuge)):
        refuge = sight.streets.refuge[k]
        dx, dy = geometry.x[b] - geometry.x[refuge], geometry.y[b] - geometry.y[refuge]
        least = min(least, np.sqrt(dx * dx + dy * dy) / METERS_100)
    return least


@inner
def describe_around(brigade: int, b: int, n_brigades: int, sight: Sight, ranks: Ranks, out: Array) -> None:
    """Write what is around a burning building for a brigade into the last 13 places of `out` (30,), float64; MODEL 7.1.

    In this step all has been summed up, and the others of this brigade placed.
    """
    sites, geometry, brigades, constants = sight.sites, sight.geometry, sight.brigades, sight.brigade_constants
    site, side, around = np.int64(sites.place[b]), np.int64(ranks.side[b]), out[N_WEIGHTS:]
    team, others = float(n_brigades), max(float(n_brigades - 1), 1.0)
    dx, dy = geometry.x[b] - brigades.x[brigade], geometry.y[b] - brigades.y[brigade]
    far = beyond(dx * dx + dy * dy, constants.range_square) * METERS_100
    around[0] = min(brigades.tank[brigade] / max(constants.power, 1) / TEN_STEPS, MOST)
    around[1] = min(far / max(constants.speed, 1) / TEN_STEPS, MOST)
    around[2] = refuge_distance(b, sight)
    n_burning, kindling = total(ranks.side_burning[site]), total(ranks.side_kindling[site])
    around[3] = min(np.sqrt(n_burning / team), MOST_FAR)
    around[4] = min(np.sqrt(ranks.site_needed[site] / team), MOST_FAR)
    around[5] = min(np.sqrt(kindling), MOST_FAR)
    around[6] = ranks.side_burning[site, side] / n_burning
    around[7] = ranks.side_kindling[site, side] / kindling if kindling > 0.0 else 0.0
    around[8] = ranks.side_others[site, side] / others
    dx = geometry.x[b] - 0.5 * (sites.west[site] + sites.east[site])
    dy = geometry.y[b] - 0.5 * (sites.south[site] + sites.north[site])
    around[9] = min(np.sqrt(dx * dx + dy * dy) / METERS_100, MOST)
    around[10] = min(float(sites.counts[0] - 1), MOST)
    around[11] = 0.0 if sites.number[site] == brigades.site[brigade] else 1.0
    around[12] = total(ranks.side_others[site]) / others
