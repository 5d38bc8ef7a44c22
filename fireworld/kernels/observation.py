"""What a brigade sees, and which building an action names."""

from __future__ import annotations

import numpy as np

from fireworld.kernels.arrays import (
    Array,
    BrigadeState,
    BuildingArrays,
    FireState,
    GeometryArrays,
    LinkArrays,
    ObservationConstants,
    SiteState,
)
from fireworld.kernels.codes import can_catch
from fireworld.kernels.jit import inner, kernel

N_ACTIONS = 4
EASIEST, NEAREST_TO_CIVILIAN, NEAREST_TO_CENTER, NEAREST_TO_ME = 0, 1, 2, 3
N_FEATURES = 8
BY_ACTION, BY_TARGET, BY_SPRAY = 0, 1, 2
"""What the flags tell: what is chosen; which of the four targets is gone for; or sprayed."""


@inner
def level(square: float, low: float, medium: float) -> int:
    """Class a squared distance: 0 low, 1 medium, 2 high."""
    if square < low:
        return 0
    return 1 if square < medium else 2


@inner
def volume_class(volume: float, unit: float, growth: float) -> int:
    """Class a burning volume: the thresholds are the unit volume, and 4 more, each `growth` times the one before."""
    found = 0
    bound = unit
    for _ in range(5):
        if volume >= bound:
            found += 1
        bound *= growth
    return found


@inner
def sides_in_city(site: int, sites: SiteState, constants: ObservationConstants) -> int:
    """Return beyond how many sides of a site's box the city continues."""
    return (
        (sites.north[site] < constants.north)
        + (sites.east[site] < constants.east)
        + (sites.south[site] > constants.south)
        + (sites.west[site] > constants.west)
    )


@inner
def state_index(features: Array) -> int:
    """Return the state of eight features: mixed radix 5, 3, 3, 6, 2, 2, 2, 2, the first the most significant."""
    index = features[0]
    index = index * 3 + features[1]
    index = index * 3 + features[2]
    index = index * 6 + features[3]
    for k in range(4, N_FEATURES):
        index = index * 2 + features[k]
    return index


@kernel
def site_place(brigade: int, site_of: Array, sites: SiteState) -> int:
    """Return the position of a brigade's site in the site arrays, -1 if it has none. site_of: (b,) numbers of sites."""
    for site in range(sites.counts[0]):
        if sites.number[site] == site_of[brigade]:
            return site
    return -1


@kernel
def observe(
    brigade: int,
    actions: Array,
    site_of: Array,
    sites: SiteState,
    constants: ObservationConstants,
    features: Array,
) -> int:
    """Write the eight features that a brigade sees and return its state; -1 (features 0) without a site. MODEL 5.

    `features` is (8,) int64, written. `actions` (b,) are what the brigades do, -1 nothing; a target of one's own has no
    flag. Given `brigades.action`, into which choices are written one after another, the flags are what the others
    chose: those before it in this step, those after it in the last one. `site_of` (b,) are the numbers of their fire
    sites.
    """
    for k in range(N_FEATURES):
        features[k] = 0
    site = site_place(brigade, site_of, sites)
    if site < 0:
        return -1
    sides = sites.free_sides[site]
    features[0] = (sides & 1) + (sides >> 1 & 1) + (sides >> 2 & 1) + (sides >> 3 & 1)
    if constants.edge_by_city:
        features[0] = sides_in_city(site, sites, constants)
    features[1] = level(sites.center_square[site], constants.center_low_square, constants.center_medium_square)
    features[2] = level(sites.civilian_square[site], constants.civilian_low_square, constants.civilian_medium_square)
    features[3] = volume_class(sites.volume[site], constants.unit_volume, constants.volume_growth)
    for other in range(len(actions)):
        if (other != brigade or constants.own_flags) and 0 <= actions[other] < N_ACTIONS:
            features[4 + actions[other]] = 1
    return state_index(features)


@kernel
def find_target(
    brigade: int,
    action: int,
    brigades: BrigadeState,
    buildings: BuildingArrays,
    fire: FireState,
    geometry: GeometryArrays,
    sites: SiteState,
) -> int:
    """Return the burning building of the brigade's site that an action names (ties: lowest id), -1 without a site."""
    site = site_place(brigade, brigades.site, sites)
    if site < 0:
        return -1
    best, best_measure = -1, 0.0
    for k in range(sites.start[site], sites.start[site + 1]):
        b = sites.member[k]
        if action == EASIEST:
            measure = fire.energy[b] / buildings.capacity[b]
        elif action == NEAREST_TO_CIVILIAN:
            measure = sites.building_civilian_square[b]
        elif action == NEAREST_TO_CENTER:
            measure = geometry.center_square[b]
        else:
            dx, dy = geometry.x[b] - brigades.x[brigade], geometry.y[b] - brigades.y[brigade]
            measure = dx * dx + dy * dy
        if (
            best < 0
            or measure < best_measure
            or (measure == best_measure and buildings.building_id[b] < buildings.building_id[best])
        ):
            best, best_measure = b, measure
    return best


@kernel
def find_named(
    brigade: int,
    action: int,
    brigades: BrigadeState,
    buildings: BuildingArrays,
    links: LinkArrays,
    fire: FireState,
    geometry: GeometryArrays,
    sites: SiteState,
    constants: ObservationConstants,
) -> int:
    """Return what `find_target` does; or, where the easiest may be a building that is only heated, the coolest of all.

    Heated is what has never burned and can, has at least half the energy at which it would burn, and has a radiation
    link from a burning building of the site.
    """
    best = find_target(brigade, action, brigades, buildings, fire, geometry, sites)
    if best < 0 or action != EASIEST or not constants.heated:
        return best
    site, lowest = site_place(brigade, brigades.site, sites), fire.energy[best] / buildings.capacity[best]
    for k in range(sites.start[site], sites.start[site + 1]):
        for link in range(links.ptr[sites.member[k]], links.ptr[sites.member[k] + 1]):
            b = np.int64(links.building[link])
            if not can_catch(fire.fieryness[b]) or buildings.inflammable[b] == 0:
                continue
            measure = fire.energy[b] / buildings.capacity[b]
            cooler = measure < lowest or (measure == lowest and buildings.building_id[b] < buildings.building_id[best])
            if cooler and 2.0 * fire.energy[b] >= buildings.ignition_energy[b]:
                best, lowest = b, measure
    return best


@kernel
def flag_targets(
    brigade: int,
    known: Array,
    brigades: BrigadeState,
    buildings: BuildingArrays,
    links: LinkArrays,
    fire: FireState,
    geometry: GeometryArrays,
    sites: SiteState,
    constants: ObservationConstants,
    features: Array,
) -> int:
    """Write the flags anew where they tell of targets: does another go for what the action would name for me?

    `known` (b,) are the targets of the brigades as far as this one knows, -1 none; `features` (8,) are those of
    `observe`. Returns the state, -1 without a site.
    """
    if site_place(brigade, brigades.site, sites) < 0:
        return -1
    for action in range(N_ACTIONS):
        target = find_named(brigade, action, brigades, buildings, links, fire, geometry, sites, constants)
        flag = 0
        for other in range(len(known)):
            counts = (other != brigade or constants.own_flags) and known[other] == target
            if counts and (constants.flags == BY_TARGET or brigades.sprayed[other] > 0):
                flag = 1
        features[4 + action] = flag
    return state_index(features)


@kernel
def can_choose(brigade: int, hp: Array, refilling: Array, site_counts: Array) -> bool:
    """Return whether a brigade picks an action: alive, not refilling, something burns, by `SiteState.counts`."""
    return hp[brigade] > 0 and refilling[brigade] == 0 and site_counts[0] > 0
