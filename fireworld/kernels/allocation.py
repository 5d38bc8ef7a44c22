"""Which targets a brigade may name by itself, to which site it belongs by the one it goes for, and if it keeps that.

Every loop, mask and check asks here. `free` is `BrigadeConstants.free`. MODEL 4.1 and 4.2.
"""

from __future__ import annotations

import numpy as np

from fireworld.kernels.arrays import Array, BrigadeConstants, BrigadeState, SiteState
from fireworld.kernels.jit import kernel
from fireworld.kernels.observation import can_choose, site_place


@kernel
def named_range(brigade: int, site_of: Array, sites: SiteState, free: bool) -> tuple[np.int64, np.int64]:
    """Return which burning buildings a brigade may name as its own target: [first, end) of `SiteState.member`.

    They are those of its site; with free allocation, those of all sites. `site_of` (b,) are the numbers of the sites.
    """
    if free:
        return np.int64(0), np.int64(sites.counts[2])
    place = site_place(brigade, site_of, sites)
    if place < 0:
        return np.int64(0), np.int64(0)
    return np.int64(sites.start[place]), np.int64(sites.start[place + 1])


@kernel
def may_name(brigade: int, target: int, site_of: Array, sites: SiteState, free: bool) -> bool:
    """Return whether a building, -1 none, is one of those of `named_range`."""
    if target < 0 or sites.place[target] < 0:
        return False
    return bool(free or sites.number[sites.place[target]] == site_of[brigade])


@kernel
def stays(brigade: int, brigades: BrigadeState, sites: SiteState, constants: BrigadeConstants) -> bool:
    """Return whether a brigade stays with what it did, before it decides: where targets are kept, while that burns.

    A target of another fire site is let go of, unless allocation is free; so is what it had before it refilled.
    """
    if not constants.keeps or brigades.action[brigade] < 0:
        return False
    return may_name(brigade, brigades.target[brigade], brigades.site, sites, constants.free)


@kernel
def is_asked(brigade: int, brigades: BrigadeState, sites: SiteState, constants: BrigadeConstants) -> bool:
    """Return whether a brigade chooses in a step that has begun: it can, and does not stay with what it did."""
    chooses = can_choose(brigade, brigades.hp, brigades.refilling, sites.counts)
    return chooses and not stays(brigade, brigades, sites, constants)


@kernel
def join_site(brigade: int, target: int, site_of: Array, sites: SiteState, free: bool) -> None:
    """Let a brigade belong to the site of the target that it goes for, -1 none, where allocation is free.

    A target that does not burn is of no site: the brigade stays with its own.
    """
    if free and target >= 0 and sites.place[target] >= 0:
        site_of[brigade] = sites.number[sites.place[target]]
