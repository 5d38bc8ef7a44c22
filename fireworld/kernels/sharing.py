"""The rule `allocate`: brigades are shared out among the fire sites, and each goes for a building that nobody has.

Shares are in proportion to the burning buildings of the sites. All numbers are whole: a site is *over* by its brigades
times all burning buildings less the living brigades times its own, so one brigade is as much as all that burns.
"""

from __future__ import annotations

import numpy as np

from fireworld.kernels.arrays import Array, BrigadeState, BuildingArrays, FireState, GeometryArrays, SiteState
from fireworld.kernels.episode_arrays import Shares
from fireworld.kernels.jit import inner, kernel
from fireworld.kernels.observation import site_place


def fresh_shares(n_brigades: int, n_buildings: int) -> Shares:
    """Return room for sharing out brigades among as many sites as there are buildings at most."""
    return Shares(joined=np.zeros(n_brigades, dtype=np.int32), n_joined=np.zeros(n_buildings, dtype=np.int32))


@inner
def count_shares(brigades: BrigadeState, sites: SiteState, shares: Shares) -> int:
    """Write where the living brigades belong, and how many to each site; return how many live."""
    n_living = 0
    for site in range(sites.counts[0]):
        shares.n_joined[site] = 0
    for brigade in range(len(brigades.hp)):
        place = site_place(brigade, brigades.site, sites) if brigades.hp[brigade] > 0 else -1
        shares.joined[brigade] = place
        n_living += 1 if brigades.hp[brigade] > 0 else 0
        if place >= 0:
            shares.n_joined[place] += 1
    return n_living


@inner
def over(site: int, n_living: int, sites: SiteState, shares: Shares) -> np.int64:
    """Return by how much a site has more brigades than its share; negative where it has fewer."""
    size = np.int64(sites.start[site + 1] - sites.start[site])
    return np.int64(shares.n_joined[site]) * np.int64(sites.counts[2]) - n_living * size


@inner
def next_move(n_living: int, sites: SiteState, shares: Shares) -> tuple[int, int]:
    """Return the site that gives a brigade away next and the one that gets it, -1, -1 if all is shared out.

    A site without anyone comes first, where there are enough brigades for all. Else the site with most too many gives
    one to that with most too few, if one of them is off by a brigade or more and both are nearer to their shares then.
    As long as there are enough, nobody gives its last one away. Ties: the first site.
    """
    n_sites, whole = sites.counts[0], np.int64(sites.counts[2])
    enough = n_living >= n_sites
    giver, taker, most, least = -1, -1, np.int64(0), np.int64(0)
    for site in range(n_sites):
        off, n_joined = over(site, n_living, sites, shares), shares.n_joined[site]
        if n_joined > (1 if enough else 0) and (giver < 0 or off > most):
            giver, most = site, off
        if taker < 0 or off < least:
            taker, least = site, off
    urgent = False
    if enough:
        for site in range(n_sites):
            off = over(site, n_living, sites, shares)
            if shares.n_joined[site] == 0 and (not urgent or off < least):
                taker, least, urgent = site, off, True
    if giver < 0 or giver == taker:
        return -1, -1
    if urgent or ((most >= whole or least <= -whole) and most - least > whole):
        return giver, taker
    return -1, -1


@inner
def square_to_site(x: float, y: float, site: int, geometry: GeometryArrays, sites: SiteState) -> float:
    """Return the squared distance of a point, mm, to the nearest burning building of a site."""
    best = np.inf
    for k in range(sites.start[site], sites.start[site + 1]):
        dx, dy = geometry.x[sites.member[k]] - x, geometry.y[sites.member[k]] - y
        best = min(best, dx * dx + dy * dy)
    return best


@inner
def share_out(
    brigade: int, n_living: int, brigades: BrigadeState, geometry: GeometryArrays, sites: SiteState, shares: Shares
) -> int:
    """Return the place of the site that a brigade is to fight, when all that is to be moved is moved.

    Of the brigades of a site that gives one away, the nearest goes that does not refill (ties: the lowest number).
    """
    for _ in range(len(brigades.hp)):
        giver, taker = next_move(n_living, sites, shares)
        goes, nearest = -1, np.inf
        for other in range(len(brigades.hp)):
            if giver < 0 or shares.joined[other] != giver or brigades.refilling[other] != 0:
                continue
            square = square_to_site(brigades.x[other], brigades.y[other], taker, geometry, sites)
            if square < nearest:
                goes, nearest = other, square
        if goes < 0:
            break
        shares.joined[goes] = taker
        shares.n_joined[giver] -= 1
        shares.n_joined[taker] += 1
    return shares.joined[brigade]


@kernel
def allocate(
    brigade: int,
    known: Array,
    free: bool,
    brigades: BrigadeState,
    buildings: BuildingArrays,
    fire: FireState,
    geometry: GeometryArrays,
    sites: SiteState,
    shares: Shares,
) -> np.int64:
    """Return the building that a brigade goes for by the rule, -1 without a site.

    It is the coolest of the site that no other goes for, else the coolest (ties: the lowest id). `known` (b,) is what
    the brigades go for, as far as this one knows, -1 nothing. Unless allocation is free, it stays with its site.
    `shares` is scratch.
    """
    n_living = count_shares(brigades, sites, shares)
    site = shares.joined[brigade]
    if site >= 0 and free:
        site = share_out(brigade, n_living, brigades, geometry, sites, shares)
    if site < 0:
        return np.int64(-1)
    best, best_taken, coolest = np.int64(-1), False, 0.0
    for k in range(sites.start[site], sites.start[site + 1]):
        b, taken = np.int64(sites.member[k]), False
        for other in range(len(known)):
            taken = taken or (other != brigade and known[other] == b)
        temperature = fire.energy[b] / buildings.capacity[b]
        first = temperature < coolest or (
            temperature == coolest and best >= 0 and buildings.building_id[b] < buildings.building_id[best]
        )
        if best < 0 or (best_taken and not taken) or (best_taken == taken and first):
            best, best_taken, coolest = b, taken, temperature
    return best
