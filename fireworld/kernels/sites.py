"""Fire sites: which burning buildings belong together, how big they are and where they can still spread."""

from __future__ import annotations

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
from fireworld.kernels.jit import inner, kernel

FAR = 1e300
NORTH, EAST, SOUTH, WEST = 1, 2, 4, 8
NOWHERE, WAITING = -1, -2
"""Places of buildings that do not burn, and of burning ones whose site is not known yet."""


@inner
def gather(fire: FireState, near: NearArrays, sites: SiteState) -> None:
    """Group the burning buildings into connected sets, in order of their lowest building index."""
    place, member = sites.place, sites.member
    n_burning = 0
    for b in range(len(place)):
        burning = 1 <= fire.fieryness[b] <= 3
        place[b] = WAITING if burning else NOWHERE
        n_burning += burning
    n_sites, n_members = 0, 0
    for b in range(len(place)):
        if n_members == n_burning:
            break
        if place[b] != WAITING:
            continue
        sites.start[n_sites] = n_members
        place[b] = n_sites
        member[n_members] = b
        head = n_members
        n_members += 1
        while head < n_members < n_burning:
            here = member[head]
            head += 1
            for k in range(near.ptr[here], near.ptr[here + 1]):
                there = near.building[k]
                if place[there] == WAITING:
                    place[there] = n_sites
                    member[n_members] = there
                    n_members += 1
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
    for b in range(len(sites.label)):
        place = sites.place[b]
        sites.label[b] = sites.number[place] if place >= 0 else 0


@inner
def civilian_squares(civilians: CivilianState, fire: FireState, geometry: GeometryArrays, sites: SiteState) -> None:
    """Find each burning building's squared distance to the nearest living civilian who is in no burning building."""
    for k in range(sites.counts[2]):
        sites.building_civilian_square[sites.member[k]] = FAR
    for civilian in range(len(civilians.hp)):
        inside = civilians.building[civilian]
        if civilians.hp[civilian] <= 0 or (inside >= 0 and 1 <= fire.fieryness[inside] <= 3):
            continue
        x, y = civilians.x[civilian], civilians.y[civilian]
        for k in range(sites.counts[2]):
            b = sites.member[k]
            dx, dy = geometry.x[b] - x, geometry.y[b] - y
            square = dx * dx + dy * dy
            sites.building_civilian_square[b] = min(square, sites.building_civilian_square[b])


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
def find_free_sides(
    buildings: BuildingArrays, links: LinkArrays, geometry: GeometryArrays, fire: FireState, sites: SiteState
) -> None:
    """Find the sides over which a site can spread: the centroid of an unburnt linked building is beyond; MODEL 5.1.

    Beyond some sides of a large fire there is nothing left to burn: the search ends once all others are found free.
    """
    low_x, low_y, high_x, high_y = FAR, FAR, -FAR, -FAR  # bounds of all that can still catch fire
    for b in range(len(fire.fieryness)):
        if (fire.fieryness[b] == 0 or fire.fieryness[b] == 4) and buildings.inflammable[b] != 0:
            x, y = geometry.x[b], geometry.y[b]
            low_x, low_y, high_x, high_y = min(low_x, x), min(low_y, y), max(high_x, x), max(high_y, y)
    for site in range(sites.counts[0]):
        west, south, east, north = sites.west[site], sites.south[site], sites.east[site], sites.north[site]
        possible = sides_beyond(low_x, low_y, west, south, east, north)
        possible |= sides_beyond(high_x, high_y, west, south, east, north)
        sides = 0
        for k in range(sites.start[site], sites.start[site + 1]):
            if sides == possible:
                break
            b = sites.member[k]
            for link in range(links.ptr[b], links.ptr[b + 1]):
                there = links.building[link]
                code = fire.fieryness[there]
                if (code == 0 or code == 4) and buildings.inflammable[there] != 0:  # noqa: PLR1714
                    sides |= sides_beyond(geometry.x[there], geometry.y[there], west, south, east, north)
        sites.free_sides[site] = sides


@kernel
def find_sites(
    buildings: BuildingArrays,
    links: LinkArrays,
    near: NearArrays,
    geometry: GeometryArrays,
    fire: FireState,
    civilians: CivilianState,
    brigades: BrigadeState,
    sites: SiteState,
) -> None:
    """Find and measure the fire sites of the moment and settle which brigade belongs to which."""
    gather(fire, near, sites)
    number_sites(sites)
    assign_brigades(brigades, buildings, geometry, sites)
    relabel(sites)
    civilian_squares(civilians, fire, geometry, sites)
    measure_sites(geometry, sites)
    find_free_sides(buildings, links, geometry, fire, sites)
