"""The official fire model: burning, water and radiation, one function a phase; the air is in `air`.

MODEL section 2 in the docs has every equation. All temperatures are degrees above ambient.
"""

from __future__ import annotations

import numpy as np
from numba import float32

from fireworld.draws import BURN_RATE
from fireworld.kernels.air import exchange_with_air, spread_air
from fireworld.kernels.arrays import Array, BuildingArrays, CoverArrays, FireConstants, FireState, LinkArrays
from fireworld.kernels.draws import normal
from fireworld.kernels.jit import inner, kernel

AMBIENT_KELVIN = 293.0
STEFAN_BOLTZMANN = 5.6704e-8
LEAST_SHARE = np.float32(0.005)
BLOCK = np.uint64(64)
"""Buildings that are passed over at once when they are dry: most are, most of the time."""


@inner
def is_burning(energy: float, capacity: float, ignition_point: float, fuel: float, inflammable: int) -> bool:
    """Return whether a building burns: hot enough, fuel left, inflammable (codes 1 to 3).

    Takes numbers, not arrays: passing groups of arrays to a small function costs more than the function.
    """
    return energy > 0.0 and energy / capacity >= ignition_point and fuel > 0.0 and inflammable != 0


@inner
def fieryness_of(burning: bool, fuel: float, full: float, inflammable: int, watered: int) -> int:
    """Return the official code 0 to 8 of a building. fuel, full: energy left and at the start."""
    if inflammable == 0:
        return 0
    third = 1 if fuel >= full * 0.66 else 2 if fuel >= full * 0.33 else 3
    if burning:
        return third
    if fuel == full:
        return 4 if watered != 0 else 0
    return 4 + third if fuel > 0.0 else 8


@inner
def draw_burn_rates(
    buildings: BuildingArrays, fire: FireState, constants: FireConstants, seed: int, step: int
) -> float:
    """Draw the burn rate of every burning building from N(mean, sd) and return their sum; MODEL 2.3.

    Keyed by the building's id and the step: which other buildings burn changes nobody's draws.
    """
    total = 0.0
    for b in range(len(fire.energy)):
        hot = is_burning(
            fire.energy[b], buildings.capacity[b], buildings.ignition_point[b], fire.fuel[b], buildings.inflammable[b]
        )
        if hot:
            rate = constants.burn_rate_mean + constants.burn_rate_sd * normal(
                seed, BURN_RATE, buildings.building_id[b], step
            )
            fire.rate[b] = rate
            total += rate
    return total


@inner
def burn(buildings: BuildingArrays, fire: FireState) -> None:
    """Turn fuel into heat in every burning building.

    used = min(fuel, fuel0 * max(0.005, T/1000 * fuel/fuel0 * rate)); MODEL 2.3. `fire.rate` holds the step's draws.
    """
    for b in range(len(fire.energy)):
        fuel = fire.fuel[b]
        capacity = buildings.capacity[b]
        if is_burning(fire.energy[b], capacity, buildings.ignition_point[b], fuel, buildings.inflammable[b]):
            temperature = fire.energy[b] / capacity
            full = buildings.initial_fuel[b]
            share = float32(float32(temperature / 1000.0) * (fuel / full) * fire.rate[b])
            used = min(fuel, full * max(share, LEAST_SHARE))
            fire.energy[b] += used
            fire.fuel[b] = fuel - used


@inner
def is_dry(water: Array, start: int, end: int) -> bool:
    """Return whether no water lies on any building of a block."""
    wet = False
    for b in range(start, end):
        wet |= water[b] != 0
    return not wet


@inner
def cool(buildings: BuildingArrays, fire: FireState, constants: FireConstants) -> None:
    """Let the water lying on hot buildings take heat; MODEL 2.4. Whole blocks of dry buildings are passed over."""
    n = np.uint64(len(fire.energy))
    for start in range(np.uint64(0), n, BLOCK):
        end = min(start + BLOCK, n)
        if is_dry(fire.water, start, end):
            continue
        for b in range(start, end):
            litres = fire.water[b]
            if litres <= 0:
                continue
            heat = fire.energy[b] / buildings.capacity[b] * buildings.capacity[b]  # rounds as T * capacity does
            if heat > 0.0:
                burning = is_burning(
                    fire.energy[b],
                    buildings.capacity[b],
                    buildings.ignition_point[b],
                    fire.fuel[b],
                    buildings.inflammable[b],
                )
                taken = litres * (constants.water_heat_burning if burning else constants.water_heat_unburnt)
                used = litres
                if taken > heat:
                    part = 1.0 - (taken - heat) / taken
                    taken *= part
                    used = int(litres * part)
                fire.water[b] = litres - used
                fire.energy[b] -= taken


@inner
def radiate(buildings: BuildingArrays, links: LinkArrays, fire: FireState) -> None:
    """Send out every building's radiation and share it among the buildings it is linked to; MODEL 2.7.

    emitted = min(E, (T + 293)^4 * emission), for all buildings before any receives.
    """
    energy, emitted = fire.energy, fire.emitted
    for b in range(len(energy)):
        heat = energy[b]
        kelvin = heat / buildings.capacity[b] + AMBIENT_KELVIN
        square = kelvin * kelvin
        emitted[b] = min(heat, square * square * buildings.emission[b])
    for b in range(len(energy)):
        sent = emitted[b]
        if sent != 0.0:
            for k in range(links.ptr[b], links.ptr[b + 1]):
                energy[links.building[k]] += sent * links.share[k]
            energy[b] -= sent


@inner
def settle(buildings: BuildingArrays, fire: FireState, constants: FireConstants) -> None:
    """Flush tiny heat to zero where asked, then give every building its code; MODEL 2 and its codes."""
    for b in range(len(fire.energy)):
        capacity = buildings.capacity[b]
        if fire.energy[b] < constants.flush_temperature * capacity:
            fire.energy[b] = 0.0
        inflammable, fuel = buildings.inflammable[b], fire.fuel[b]
        burning = is_burning(fire.energy[b], capacity, buildings.ignition_point[b], fuel, inflammable)
        fire.fieryness[b] = fieryness_of(burning, fuel, buildings.initial_fuel[b], inflammable, fire.watered[b])


@kernel
def ignite(b: int, buildings: BuildingArrays, fire: FireState) -> bool:
    """Set building b on fire: E = capacity * ignition point * 1.5; only from code 0 or 4, and if inflammable."""
    code = fire.fieryness[b]
    if buildings.inflammable[b] == 0 or code not in (0, 4):
        return False
    fire.energy[b] = float32(buildings.capacity[b] * buildings.ignition_point[b]) * 1.5
    fire.fieryness[b] = 1
    return True


@kernel
def light(buildings: BuildingArrays, fire: FireState, step: int) -> None:
    """Light the fires of a step, before everything else in it."""
    for k in range(len(buildings.later_step)):
        if buildings.later_step[k] == step:
            ignite(buildings.later_building[k], buildings, fire)


@kernel
def is_over(n_burning: int, later_step: Array, step: int) -> bool:
    """Return whether nothing burns after a step, and no fire is lit later; (k,) int64 steps, rising."""
    return n_burning == 0 and (len(later_step) == 0 or later_step[-1] <= step)


@kernel
def advance_fire(
    buildings: BuildingArrays, cover: CoverArrays, links: LinkArrays, fire: FireState, constants: FireConstants
) -> None:
    """Run phases 3 to 8 of a step: burn, cool, air, exchange, radiation, cool; then the codes."""
    burn(buildings, fire)
    cool(buildings, fire, constants)
    spread_air(fire, constants)
    exchange_with_air(buildings, cover, fire, constants)
    radiate(buildings, links, fire)
    cool(buildings, fire, constants)
    settle(buildings, fire, constants)
