"""What brigades see of burning buildings: the features that rankings and networks weigh, `fireworld.kernels.ranks`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fireworld.kernels.arrays import (
    Array,
    BrigadeConstants,
    BrigadeState,
    BuildingArrays,
    FireConstants,
    FireState,
    GeometryArrays,
    LinkArrays,
    SiteState,
    StreetArrays,
)
from fireworld.kernels.jit import inner
from fireworld.kernels.observation import N_ACTIONS

N_OF_BUILDING, N_OF_BRIGADE, N_OF_TEAM = 7, 3, 3
N_TARGET_FEATURES = N_OF_BUILDING + N_OF_BRIGADE + N_OF_TEAM
BEYOND = N_OF_BUILDING + 1
"""The feature that says how far beyond its range a brigade is."""
N_WEIGHTS = N_TARGET_FEATURES + N_ACTIONS
"""Weights of a ranking: one for each feature of a target, then one for each of the four actions that may name it."""
OWN_TARGET = N_ACTIONS
"""The action of a brigade that names a building by itself."""
DEGREES, METERS_100, METERS_50_SQUARE, METERS_MOST = 500.0, 1e5, 2.5e9, 3.0
"""Units of the features: degrees; lengths in mm; the longest distance that is distinguished, in hundreds of metres."""
WATER_HEAT_LEAST = 1e-6
"""So that water that takes no heat needs very many steps, not infinitely many."""


class Sight(NamedTuple):
    """What brigades that value targets look at."""

    buildings: BuildingArrays
    links: LinkArrays
    geometry: GeometryArrays
    streets: StreetArrays
    fire: FireState
    brigades: BrigadeState
    sites: SiteState
    fire_constants: FireConstants
    brigade_constants: BrigadeConstants
    described: Array  # (n, 7) float64, features of buildings, each row in the step of the next one
    described_at: Array  # (n,) int64, -1 at first


@inner
def describe_building(
    b: int,
    buildings: BuildingArrays,
    links: LinkArrays,
    geometry: GeometryArrays,
    fire: FireState,
    sites: SiteState,
    fire_constants: FireConstants,
    power: int,
    out: Array,
) -> None:
    """Write the features of a burning building that are the same for every brigade, (7,) float64; MODEL 7.

    Only arithmetic and roots: they give the same bits on every machine. `power`: litres that a brigade sprays in a
    step.
    """
    capacity = buildings.capacity[b]
    out[0] = fire.energy[b] / capacity / DEGREES
    out[1] = np.sqrt(geometry.volume[b] / 1000.0)
    out[2] = fire.fuel[b] / buildings.initial_fuel[b]
    out[3] = min(np.sqrt(sites.building_civilian_square[b]) / METERS_100, METERS_MOST)
    exposure, kindling = 0.0, 0.0
    for k in range(links.ptr[b], links.ptr[b + 1]):
        other = links.building[k]
        if fire.fieryness[other] in (0, 4) and buildings.inflammable[other] != 0:
            share = links.share[k]
            exposure += share
            warmth = fire.energy[other] / buildings.capacity[other] / buildings.ignition_point[other]
            kindling += share * min(warmth, 1.0)
    out[4] = 3.0 * exposure
    out[5] = 5.0 * kindling
    heat = fire.energy[b] - buildings.ignition_point[b] * capacity
    litres = heat / max(fire_constants.water_heat_burning, WATER_HEAT_LEAST) - fire.water[b]
    out[6] = np.sqrt(max(litres, 0.0) / max(power, 1))


@inner
def beyond(square: float, range_square: float) -> float:
    """Return how far beyond its range a brigade is from a building, in hundreds of metres; squares in mm^2."""
    return min((np.sqrt(square) - np.sqrt(range_square)) / METERS_100, METERS_MOST) if square > range_square else 0.0


@inner
def nearness(dx: float, dy: float) -> float:
    """Return how near two buildings are, 1 down to 0, of their distances in mm."""
    return 1.0 / (1.0 + (dx * dx + dy * dy) / METERS_50_SQUARE)


@inner
def is_enough(here: float, needed: float) -> bool:
    """Return whether the brigades that go for a building can put it out in a step, so that no other is needed."""
    return here > 0.0 and here >= needed


@inner
def others_at(b: int, brigade: int, known: Array, geometry: GeometryArrays) -> tuple[float, float]:
    """Return how many other brigades go for a building, and how near to it all are that go for one, added up."""
    here, near = 0.0, 0.0
    for other in range(len(known)):
        target = known[other]
        if other != brigade and target >= 0:
            near += nearness(geometry.x[b] - geometry.x[target], geometry.y[b] - geometry.y[target])
            if target == b:
                here += 1.0
    return here, near


@inner
def describe_target(
    brigade: int,
    b: int,
    here: float,
    near: float,
    described: Array,
    brigades: BrigadeState,
    geometry: GeometryArrays,
    range_square: float,
    out: Array,
) -> None:
    """Write the 13 features of a building that a brigade sees into the first places of `out`, float64; MODEL 7.

    `here` and `near` are what `others_at` returns; `described` (7,) the building's features; the range in mm^2.
    """
    for k in range(N_OF_BUILDING):
        out[k] = described[k]
    dx, dy = geometry.x[b] - brigades.x[brigade], geometry.y[b] - brigades.y[brigade]
    square = dx * dx + dy * dy
    out[7], out[8] = 1.0 if square <= range_square else 0.0, beyond(square, range_square)
    out[9] = 1.0 if brigades.target[brigade] == b else 0.0
    out[10], out[11] = here, near
    out[12] = 1.0 if is_enough(here, described[6] * described[6]) else 0.0


@inner
def know_building(b: int, step: int, sight: Sight) -> None:
    """Describe a building in a step in which nobody has yet."""
    if sight.described_at[b] != step:
        describe_building(
            b,
            sight.buildings,
            sight.links,
            sight.geometry,
            sight.fire,
            sight.sites,
            sight.fire_constants,
            sight.brigade_constants.power,
            sight.described[b],
        )
        sight.described_at[b] = step


@inner
def see_target(brigade: int, b: int, step: int, known: Array, sight: Sight, out: Array) -> None:
    """Write the 13 features of a building that a brigade sees; `known` (b,) is what the brigades go for, -1 nothing."""
    know_building(b, step, sight)
    here, near = others_at(b, brigade, known, sight.geometry)
    range_square = sight.brigade_constants.range_square
    describe_target(brigade, b, here, near, sight.described[b], sight.brigades, sight.geometry, range_square, out)
