"""Fire sites in plain numpy: which burning buildings belong together, and what brigades see of them; MODEL 4 and 5."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Self

import numpy as np

from fireworld.city.city import Array, City, Float64Array, Links

FAR: Final = 1e300
"""The square of no distance: there is no civilian to be near to."""
NORTH, EAST, SOUTH, WEST = 1, 2, 4, 8
CIVILIAN_LOW_MM, CIVILIAN_MEDIUM_MM = 30_000.0, 80_000.0
N_VOLUMES: Final = 6


@dataclass(frozen=True)
class SiteTables:
    """What is fixed of n buildings; lengths in millimetres."""

    near: Array  # (most neighbours, n) those of lower index that make one site with each, padded with n
    links: Array  # (most links, n) the buildings that each radiates to, padded with n
    building_id: Array  # (n,)
    x: Float64Array  # (n,) centroid
    y: Float64Array  # (n,)
    extremes: Float64Array  # (5, n) west, south, -east, -north of the outline; squared distance from the city's centre
    volume: Float64Array  # (n,) m3
    inflammable: Array  # (n,) bool
    center_bounds: tuple[float, float]  # squared distances from the centre at which "medium" and "high" begin
    volume_bounds: tuple[float, ...]  # m3 at which the classes 1 to 5 begin

    @classmethod
    def of_city(cls, city: City, *, unit_volume_m3: float | None) -> Self:
        """Prepare a city. Without a unit of volume it is twice the mean of the buildings."""
        starts = city.footprints.outline_ptr[:-1]
        outline = city.footprints.outline_mm.astype(np.float64)
        x, y = city.footprints.centroid_mm.T.astype(np.float64)
        middle_x, middle_y = city.middle_mm
        unit = unit_volume_m3
        if unit is None:
            unit = 2.0 * (math.fsum(city.volume_m3.tolist()) / city.n_buildings)
        third = city.half_diagonal_mm / 3.0
        return cls(
            near=padded(city.near, lower_only=True),
            links=padded(city.links),
            building_id=city.footprints.building_id,
            x=x,
            y=y,
            extremes=np.stack(
                [
                    np.minimum.reduceat(outline[:, 0], starts),
                    np.minimum.reduceat(outline[:, 1], starts),
                    -np.maximum.reduceat(outline[:, 0], starts),
                    -np.maximum.reduceat(outline[:, 1], starts),
                    (x - middle_x) ** 2 + (y - middle_y) ** 2,
                ]
            ),
            volume=city.volume_m3.astype(np.float64),
            inflammable=city.footprints.inflammable.astype(np.bool_),
            center_bounds=(third * third, 4.0 * third * third),
            volume_bounds=tuple(unit * 2.0**k for k in range(N_VOLUMES - 1)),
        )


def padded(relation: Links, *, lower_only: bool = False) -> Array:
    """Turn a CSR relation of n buildings into a table, (most, n) int64, padded with n.

    Without the neighbours of higher index, if only the lower ones are wanted.
    """
    n = len(relation.ptr) - 1
    building, other = np.repeat(np.arange(n), np.diff(relation.ptr)), relation.building.astype(np.int64)
    if lower_only:
        building, other = building[other < building], other[other < building]
    counts = np.bincount(building, minlength=n)
    table = np.full((counts.max(), n), n, dtype=np.int64)
    table[np.arange(len(other)) - np.repeat(np.cumsum(counts) - counts, counts), building] = other
    return table


@dataclass
class Memory:
    """What is remembered of the sites from step to step."""

    label: Array  # (n,) number of the site each building burns in, 0 none
    last_number: int = 0  # given to a site


@dataclass(frozen=True)
class Sites:
    """The s fire sites of a moment and the k burning buildings in them."""

    member: Array  # (k,) burning buildings, site after site, rising within each
    place: Array  # (k,) site of each of them
    start: Array  # (s+1,) where each site begins in member
    number: list[int]  # (s,)
    civilian_square: Float64Array  # (k,) squared distance to the nearest civilian who can still be saved, or FAR
    features: list[tuple[int, int, int, int]]  # (s,) free edges, and the classes of the two distances and the volume
    free_sides: list[int]  # (s,) bits N, E, S, W
    memory_before: Array  # (n,) labels of the step before: they tell where a site went

    def of_number(self, number: int) -> int:
        """Return the place of the site with a number, -1 if there is none."""
        return self.number.index(number) if number in self.number else -1

    def members(self, place: int) -> slice:
        """Return where a site's buildings are in `member`."""
        return slice(int(self.start[place]), int(self.start[place + 1]))


def find_sites(tables: SiteTables, fieryness: Array, memory: Memory, people_mm: Float64Array) -> Sites | None:
    """Find, number and measure the fire sites of the moment; None if nothing burns.

    Args:
        tables: the city.
        fieryness: (n,) codes.
        memory: changed.
        people_mm: (p, 2) the living civilians who are in no burning building.
    """
    burning = np.flatnonzero(fieryness - np.uint8(1) < 3)  # codes 1 to 3; 0 wraps round to 255
    before, memory.label = memory.label, np.zeros_like(memory.label)
    if not len(burning):
        return None
    root = connect(tables.near, burning)
    is_root = root == np.arange(len(root))
    place = (np.cumsum(is_root) - 1)[root]
    order = np.argsort(place, kind="stable")
    member, place = burning[order], place[order]
    sizes = np.bincount(place)
    start = np.concatenate([[0], np.cumsum(sizes)])
    number = inherit(before[member], place, sizes.tolist(), memory)
    memory.label[member] = np.array(number)[place]

    civilian_square = nearest_square(tables, member, people_mm)
    nearest_civilian = np.minimum.reduceat(civilian_square, start[:-1])
    extremes = np.minimum.reduceat(tables.extremes[:, member], start[:-1], axis=1)
    volume = np.bincount(place, weights=tables.volume[member])
    sides = free_sides(tables, fieryness, member, place, extremes)
    measures = zip(sides, extremes[4].tolist(), nearest_civilian.tolist(), volume.tolist(), strict=True)
    civilian_bounds = (CIVILIAN_LOW_MM * CIVILIAN_LOW_MM, CIVILIAN_MEDIUM_MM * CIVILIAN_MEDIUM_MM)
    return Sites(
        member=member,
        place=place,
        start=start,
        number=number,
        civilian_square=civilian_square,
        features=[
            (
                free.bit_count(),
                rank(center, tables.center_bounds),
                rank(civilian, civilian_bounds),
                rank(cubic_metres, tables.volume_bounds),
            )
            for free, center, civilian, cubic_metres in measures
        ],
        free_sides=sides,
        memory_before=before,
    )


def connect(near: Array, burning: Array) -> Array:
    """Find the connected sets of burning buildings.

    Both ends of a pair point at a root; where the roots differ, the higher is hung below the lower and all pointers
    jump to their new root, until no pair is left that joins two sets.

    Returns:
        (k,) for each of the k burning buildings the position of the first one of its set.
    """
    k, n = len(burning), near.shape[1]
    position = np.full(n + 1, k)
    position[burning] = np.arange(k)
    other = position[near[:, burning]]
    slot, high = np.nonzero(other < k)  # without the pairs of which one does not burn
    low = other[slot, high]
    root = np.arange(k)
    while len(low):
        root[np.maximum(low, high)] = np.minimum(low, high)
        jumped = root[root]
        while (jumped != root).any():
            root, jumped = jumped, jumped[jumped]
        low, high = root[low], root[high]
        apart = low != high
        low, high = low[apart], high[apart]
    return root


def inherit(labels: Array, place: Array, sizes: list[int], memory: Memory) -> list[int]:
    """Number the sites: every old number, rising, goes to the largest nameless site in which it occurs.

    So sites that merge keep the lowest number, and the largest part of a site that splits keeps it (of equal ones the
    first). Sites left without get new numbers in order.

    Args:
        labels: (k,) numbers that the burning buildings had in the last step, 0 none.
        place: (k,) site of each.
        sizes: (s,) buildings in each site.
        memory: the last number given is changed.
    """
    n_sites = len(sizes)
    number = [0] * n_sites
    claims = np.unique(labels * np.int64(n_sites) + place).tolist()
    claimants: dict[int, list[int]] = {}
    for claim in claims:
        claimants.setdefault(claim // n_sites, []).append(claim % n_sites)
    for old, places in claimants.items():
        nameless = [one for one in places if number[one] == 0]
        if old > 0 and nameless:
            number[max(nameless, key=lambda one: sizes[one])] = old
    for one in range(n_sites):
        if number[one] == 0:
            memory.last_number += 1
            number[one] = memory.last_number
    return number


def nearest_square(tables: SiteTables, buildings: Array, points_mm: Float64Array) -> Float64Array:
    """(k,) squared distance from each of k buildings to the nearest of (p, 2) points, FAR if there is none."""
    if not len(points_mm):
        return np.full(len(buildings), FAR)
    dx = points_mm[:, 0, None] - tables.x[buildings]
    dy = points_mm[:, 1, None] - tables.y[buildings]
    return (dx * dx + dy * dy).min(axis=0)


def free_sides(tables: SiteTables, fieryness: Array, member: Array, place: Array, extremes: Float64Array) -> list[int]:
    """Find the sides over which each site can spread: an unburnt building that it radiates to lies beyond them."""
    can_catch = np.append(tables.inflammable & ((fieryness == 0) | (fieryness == 4)), False)
    linked = tables.links[:, member]
    slot, column = np.nonzero(can_catch[linked])
    there, site = linked[slot, column], place[column]
    west, south, east, north = extremes[0], extremes[1], -extremes[2], -extremes[3]
    x, y = tables.x[there], tables.y[there]
    sides = np.zeros(extremes.shape[1], dtype=np.int64)
    for side, beyond in (
        (NORTH, y > north[site]),
        (EAST, x > east[site]),
        (SOUTH, y < south[site]),
        (WEST, x < west[site]),
    ):
        sides[site[beyond]] |= side
    return sides.tolist()


def rank(measure: float, bounds: tuple[float, ...]) -> int:
    """Return how many of the rising bounds a measure reaches."""
    return sum(measure >= bound for bound in bounds)


def lowest_id(tables: SiteTables, buildings: Array, measure: Float64Array) -> int:
    """Return the building of the least measure; of equal ones that with the lowest id."""
    best = buildings[measure == measure.min()]
    return int(best[0] if len(best) == 1 else best[np.argmin(tables.building_id[best])])
