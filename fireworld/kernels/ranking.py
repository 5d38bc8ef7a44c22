"""Ranking: how much a brigade would like to fight a burning building, by weights of what it sees of it or a network."""

from __future__ import annotations

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
    NetworkArrays,
    SiteState,
)
from fireworld.kernels.jit import inlined, inner, kernel
from fireworld.kernels.network import value_by_network
from fireworld.kernels.observation import N_ACTIONS, find_target, site_place

N_OF_BUILDING, N_OF_BRIGADE, N_OF_TEAM = 7, 3, 3
N_TARGET_FEATURES = N_OF_BUILDING + N_OF_BRIGADE + N_OF_TEAM
N_WEIGHTS = N_TARGET_FEATURES + N_ACTIONS
"""Weights of a ranking: one for each feature of a target, then one for each of the four actions that may name it."""
OWN_TARGET = N_ACTIONS
"""The action of a brigade that names a building by itself."""
DEGREES, METERS_100, METERS_50_SQUARE, METERS_MOST = 500.0, 1e5, 2.5e9, 3.0
"""Units of the features: degrees; lengths in mm; the longest distance that is distinguished, in hundreds of metres."""
WATER_HEAT_LEAST = 1e-6
"""So that water that takes no heat needs very many steps, not infinitely many."""


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
def describe_target(
    brigade: int,
    b: int,
    known: Array,
    described: Array,
    brigades: BrigadeState,
    geometry: GeometryArrays,
    range_square: float,
    out: Array,
) -> None:
    """Write the 13 features of a building that a brigade sees into the first places of `out`, float64; MODEL 7.

    `known` (b,) is what the brigades go for, -1 nothing; `described` (7,) the building's features; the range in mm^2.
    """
    for k in range(N_OF_BUILDING):
        out[k] = described[k]
    x, y = geometry.x[b], geometry.y[b]
    dx, dy = x - brigades.x[brigade], y - brigades.y[brigade]
    square = dx * dx + dy * dy
    out[7], out[8] = 1.0, 0.0
    if square > range_square:
        out[7], out[8] = 0.0, min((np.sqrt(square) - np.sqrt(range_square)) / METERS_100, METERS_MOST)
    out[9] = 1.0 if brigades.target[brigade] == b else 0.0
    here, near = 0.0, 0.0
    for other in range(len(known)):
        target = known[other]
        if other != brigade and target >= 0:
            dx, dy = x - geometry.x[target], y - geometry.y[target]
            near += 1.0 / (1.0 + (dx * dx + dy * dy) / METERS_50_SQUARE)
            if target == b:
                here += 1.0
    out[10], out[11] = here, near
    out[12] = 1.0 if here > 0.0 and here >= described[6] * described[6] else 0.0


@inlined
def see_target(
    brigade: int,
    b: int,
    step: int,
    known: Array,
    described: Array,
    described_at: Array,
    brigades: BrigadeState,
    buildings: BuildingArrays,
    links: LinkArrays,
    geometry: GeometryArrays,
    fire: FireState,
    sites: SiteState,
    fire_constants: FireConstants,
    brigade_constants: BrigadeConstants,
    out: Array,
) -> None:
    """Write the 13 features of a building that a brigade sees; arguments as of `rank` and `describe_target`."""
    if described_at[b] != step:
        power = brigade_constants.power
        describe_building(b, buildings, links, geometry, fire, sites, fire_constants, power, described[b])
        described_at[b] = step
    describe_target(brigade, b, known, described[b], brigades, geometry, brigade_constants.range_square, out)


@inner
def weigh(weights: Array, seen: Array) -> float:
    """Return the value of a target by the (17,) weights of a ranking; `seen` (17,) are its features."""
    value = 0.0
    for k in range(10):
        value += weights[k] * seen[k]
    value += weights[10] * seen[10] + weights[11] * seen[11]  # first these two: digests hang on the order
    for k in range(12, N_WEIGHTS):
        value += weights[k] * seen[k]
    return value


@kernel
def rank(
    brigade: int,
    own: bool,
    step: int,
    known: Array,
    weights: Array,
    network: NetworkArrays,
    described: Array,
    described_at: Array,
    brigades: BrigadeState,
    buildings: BuildingArrays,
    links: LinkArrays,
    geometry: GeometryArrays,
    fire: FireState,
    sites: SiteState,
    fire_constants: FireConstants,
    brigade_constants: BrigadeConstants,
    seen: Array,
    work: Array,
    values: Array,
) -> tuple[np.int64, np.int64]:
    """Return the action with the target that a brigade values most, and that target; -1, -1 without a site.

    The four targets that the actions name are valued, each with the weight of its action on top; where the brigade may
    name a target of its own, all burning buildings of its site are instead, and its action is OWN_TARGET. Ties: the
    lowest action, the lowest building id.

    `weights` (17,) are the ranking's; a network with layers values targets instead of them. `known` (b,) is what the
    brigades go for, as far as this one knows, -1 nothing. What is known of a building is worked out once a step: in
    `described` (n, 7) float64, each row in the step of `described_at` (n,) int64, -1 at first. Scratch is `seen` (17,)
    float64 and `work` (2, w), w as `widest` says. Written: `values` (5,) float64, of the four targets, without the
    weights of the actions where it may name its own, and of the one chosen.
    """
    best_action, best = np.int64(-1), np.int64(-1)
    site = site_place(brigade, brigades.site, sites)
    if site < 0:
        return best_action, best
    start, n_members = np.int64(sites.start[site]), sites.start[site + 1] - sites.start[site]
    best_value = 0.0
    for k in range(N_ACTIONS + (n_members if own else 0)):
        if k < N_ACTIONS:
            b = np.int64(find_target(brigade, k, brigades, buildings, fire, geometry, sites))
        else:
            b = np.int64(sites.member[start + k - N_ACTIONS])
        see_target(
            brigade,
            b,
            step,
            known,
            described,
            described_at,
            brigades,
            buildings,
            links,
            geometry,
            fire,
            sites,
            fire_constants,
            brigade_constants,
            seen,
        )
        for action in range(N_ACTIONS):
            seen[N_TARGET_FEATURES + action] = 1.0 if action == k and not own else 0.0
        value = value_by_network(network, seen, work) if len(network.layer) > 0 else weigh(weights, seen)
        if k < N_ACTIONS:
            values[k] = value
            if own:
                continue
        lower = own and value == best_value and buildings.building_id[b] < buildings.building_id[best]
        if best < 0 or value > best_value or lower:
            best_action, best, best_value = np.int64(OWN_TARGET if own else k), b, value
    values[N_ACTIONS] = best_value
    return best_action, best
