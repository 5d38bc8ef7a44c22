"""Fire sites: which burning buildings belong together, how big they are and where they can still spread."""

from __future__ import annotations

import numpy as np

from fireworld.kernels.arrays import (
    BrigadeState,
    BuildingArrays,
    CivilianState,
    FireState,
    GeometryArrays,
    LinkArrays,
    NearArrays,
    SiteState,
)
from fireworld.kernels.codes import can_catch, is_alight
from fireworld.kernels.episode_arrays import N_BLOCKS, SITES_CHANGED, SITES_KNOWN, Warmth
from fireworld.kernels.jit import inner
from fireworld.kernels.warmth import ONE, WORD_SHIFT, ZERO, bounds, clear_bit, has_bit, lowest_bit, set_bit

FAR = 1e300
NORTH, EAST, SOUTH, WEST = 1, 2, 4, 8
NOWHERE = -1
"""Place of buildings that do not burn."""


@inner
def put_out(fire: FireState, sites: SiteState, warmth: Warmth) -> None:
    """Take what no longer burns out of the sites; in the first look of a call at everything, else at their members."""
    known = warmth.number[SITES_KNOWN] != 0
    for k in range(sites.counts[2] if known else len(sites.place)):
        b = sites.member[k] if known else np.uint32(k)
        sites.place[b] = NOWHERE
        if not is_alight(fire.fieryness[b]):
            sites.label[b] = 0
    warmth.number[SITES_KNOWN] = 1


@inner
def gather(fire: FireState, near: NearArrays, sites: SiteState, warmth: Warmth) -> None:
    """Group the burning buildings into connected sets, in order of their lowest building index."""
    waiting, member, codes = warmth.waiting, sites.member, fire.fieryness
    n_burning = ZERO
    for k in range(warmth.number[N_BLOCKS]):
        first, end = bounds(warmth.block[k], len(codes))
        for b in range(first, end):
            warmth.burning[n_burning] = b
            n_burning += ONE if is_alight(codes[b]) else ZERO
    for k in range(n_burning):
        set_bit(warmth.burning[k], waiting)
    n_sites, n_members = 0, ZERO
    for k in range(n_burning):
        b = warmth.burning[k]
        if not has_bit(b, waiting):
            continue
        clear_bit(b, waiting)
        sites.start[n_sites] = n_members
        sites.place[b], member[n_members] = n_sites, b
        head = n_members
        n_members += ONE
        while head < n_members < n_burning:
            here = member[head]
            head += ONE
            for row in range(near.ptr[here], near.ptr[here + ONE]):
                word = np.uint64(near.word[row])
                found = waiting[word] & near.bits[row]
                waiting[word] ^= found
                while found != ZERO:
                    there = (word << WORD_SHIFT) + lowest_bit(found)
                    found &= found - ONE
                    sites.place[there], member[n_members] = n_sites, there
                    n_members += ONE
        n_sites += 1
    sites.start[n_sites] = n_members
    sites.counts[0] = n_sites
    sites.counts[2] = n_members


@inner
def lowest_label(site: int, above: int, sites: SiteState) -> int:
    """Return the lowest number above a bound that a building of a site had in the last step, 0 if none had one."""
    lowest = 0
    for k in range(sites.start[site], sites.start[site + 1]):
        label = sites.label[sites.member[k]]
        if label > above and (lowest == 0 or label < lowest):
            lowest = label
    return lowest


@inner
def number_sites(sites: SiteState) -> None:
    """Give every site its number: sites that merge keep the lowest, of a site that splits the largest part keeps it.

    Numbers rise with age and are never used again. Equal parts: the one with the lowest building index keeps it.
    The old numbers go in rising order to the largest site that lays claim to them; a site that goes away empty-handed
    claims its next higher one. A claim is noted as a negative number.
    """
    n_sites, number = sites.counts[0], sites.number
    for site in range(n_sites):
        number[site] = -lowest_label(site, 0, sites)
    while True:
        heir, heir_size = -1, 0
        for site in range(n_sites):
            size = sites.start[site + 1] - sites.start[site]
            if number[site] < 0 and (
                heir < 0 or number[site] > number[heir] or (number[site] == number[heir] and size > heir_size)
            ):
                heir, heir_size = site, size
        if heir < 0:
            break
        given = -number[heir]
        number[heir] = given
        for site in range(n_sites):
            if number[site] == -given:
                number[site] = -lowest_label(site, given, sites)
    for site in range(n_sites):
        if number[site] == 0:
            sites.counts[1] += 1
            number[site] = sites.counts[1]


@inner
def nearest_burning(x: float, y: float, buildings: BuildingArrays, geometry: GeometryArrays, sites: SiteState) -> int:
    """Return the burning building whose centroid is nearest to a point (ties: lowest id), -1 if nothing burns."""
    best, best_square = -1, FAR
    for k in range(sites.counts[2]):
        b = sites.member[k]
        dx, dy = geometry.x[b] - x, geometry.y[b] - y
        square = dx * dx + dy * dy
        closer = square < best_square or (
            square == best_square and buildings.building_id[b] < buildings.building_id[best]
        )
        if closer:
            best, best_square = b, square
    return best


@inner
def assign_brigades(
    brigades: BrigadeState, buildings: BuildingArrays, geometry: GeometryArrays, sites: SiteState
) -> None:
    """Keep every brigade with its site; follow a site that merged; send it to the nearest fire when its site is out.

    Runs before the labels of the step before are overwritten: they show where a merged site went.
    """
    for brigade in range(len(brigades.site)):
        number = brigades.site[brigade]
        kept = False
        for site in range(sites.counts[0]):
            kept = kept or sites.number[site] == number
        if kept:
            continue
        brigades.site[brigade] = 0
        if number > 0:
            for k in range(sites.counts[2]):
                b = sites.member[k]
                if sites.label[b] == number:
                    brigades.site[brigade] = sites.number[sites.place[b]]
                    break
        if brigades.site[brigade] == 0:
            b = nearest_burning(brigades.x[brigade], brigades.y[brigade], buildings, geometry, sites)
            if b >= 0:
                brigades.site[brigade] = sites.number[sites.place[b]]


@inner
def relabel(sites: SiteState) -> None:
    """Remember the site of every burning building for the next step."""
    for k in range(sites.counts[2]):
        b = sites.member[k]
        sites.label[b] = sites.number[sites.place[b]]


@inner
def civilian_squares(
    civilians: CivilianState, fire: FireState, geometry: GeometryArrays, sites: SiteState, warmth: Warmth
) -> None:
    """Find each burning building's squared distance to the nearest living civilian who is in no burning building."""
    n_members, member_x, member_y, squares = np.uint64(sites.counts[2]), warmth.x, warmth.y, warmth.square
    for k in range(n_members):
        b = sites.member[k]
        member_x[k], member_y[k], squares[k] = geometry.x[b], geometry.y[b], FAR
    for civilian in range(len(civilians.hp)):
        inside = civilians.building[civilian]
        if civilians.hp[civilian] <= 0 or (inside >= 0 and is_alight(fire.fieryness[inside])):
            continue
        x, y = civilians.x[civilian], civilians.y[civilian]
        for k in range(n_members):
            dx, dy = member_x[k] - x, member_y[k] - y
            squares[k] = min(dx * dx + dy * dy, squares[k])
    for k in range(n_members):
        sites.building_civilian_square[sites.member[k]] = squares[k]


@inner
def measure_sites(geometry: GeometryArrays, sites: SiteState) -> None:
    """Measure every site: volume, bounding box, distance from the centre and from a civilian."""
    for site in range(sites.counts[0]):
        volume, center, civilian = 0.0, FAR, FAR
        west, south, east, north = FAR, FAR, -FAR, -FAR
        for k in range(sites.start[site], sites.start[site + 1]):
            b = sites.member[k]
            volume += geometry.volume[b]
            center = min(center, geometry.center_square[b])
            civilian = min(civilian, sites.building_civilian_square[b])
            west, south = min(west, geometry.west[b]), min(south, geometry.south[b])
            east, north = max(east, geometry.east[b]), max(north, geometry.north[b])
        sites.volume[site] = volume
        sites.center_square[site], sites.civilian_square[site] = center, civilian
        sites.west[site], sites.south[site] = west, south
        sites.east[site], sites.north[site] = east, north


@inner
def sides_beyond(x: float, y: float, west: float, south: float, east: float, north: float) -> int:
    """Return the sides of a box, as bits, beyond which a point lies."""
    sides = NORTH if y > north else 0
    if x > east:
        sides |= EAST
    if y < south:
        sides |= SOUTH
    return sides | WEST if x < west else sides


@inner
def sides_near(sides: int, b: int, geometry: GeometryArrays, site: int, sites: SiteState, jump: float) -> int:
    """Return those of some sides, beyond which a building lies, from which its box is less than `jump`, mm."""
    near = NORTH if geometry.south[b] - sites.north[site] < jump else 0
    if geometry.west[b] - sites.east[site] < jump:
        near |= EAST
    if sites.south[site] - geometry.north[b] < jump:
        near |= SOUTH
    if sites.west[site] - geometry.east[b] < jump:
        near |= WEST
    return sides & near


@inner
def find_free_sides(
    buildings: BuildingArrays,
    links: LinkArrays,
    geometry: GeometryArrays,
    fire: FireState,
    sites: SiteState,
    jump: float,
) -> None:
    """Find the sides over which a site can spread: the centroid of an unburnt linked building is beyond; MODEL 5.1.

    Nearer than `jump`, mm, inf for any distance, its box has to begin beyond the side.

    Most buildings of a large site have no links that lead beyond a side that is not known to be free.
    """
    for site in range(sites.counts[0]):
        west, south, east, north = sites.west[site], sites.south[site], sites.east[site], sites.north[site]
        sides = 0
        for k in range(sites.start[site], sites.start[site + 1]):
            b = sites.member[k]
            beyond = sides_beyond(links.west[b], links.south[b], west, south, east, north)
            beyond |= sides_beyond(links.east[b], links.north[b], west, south, east, north)
            if beyond & ~sides == 0:
                continue
            for link in range(links.ptr[b], links.ptr[b + 1]):
                there = links.building[link]
                if can_catch(fire.fieryness[there]) and buildings.inflammable[there] != 0:
                    found = sides_beyond(geometry.x[there], geometry.y[there], west, south, east, north)
                    sides |= found if jump == np.inf else sides_near(found, there, geometry, site, sites, jump)
        sites.free_sides[site] = sides


@inner
def find_sites(
    buildings: BuildingArrays,
    links: LinkArrays,
    near: NearArrays,
    geometry: GeometryArrays,
    fire: FireState,
    civilians: CivilianState,
    brigades: BrigadeState,
    sites: SiteState,
    warmth: Warmth,
    jump: float,
) -> None:
    """Find and measure the fire sites of the moment and settle which brigade belongs to which.

    `jump` is that of `find_free_sides`.
    """
    put_out(fire, sites, warmth)
    gather(fire, near, sites, warmth)
    number_sites(sites)
    assign_brigades(brigades, buildings, geometry, sites)
    relabel(sites)
    civilian_squares(civilians, fire, geometry, sites, warmth)
    measure_sites(geometry, sites)
    find_free_sides(buildings, links, geometry, fire, sites, jump)
    warmth.number[SITES_CHANGED] = 0
