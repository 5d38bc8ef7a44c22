"""The official fire model: burning, water and radiation, one function a phase; the air is in `air`.

MODEL section 2 in the docs has every equation. All temperatures are degrees above ambient.
"""

from __future__ import annotations

import numpy as np
from numba import float32

from fireworld.draws import BURN_RATE
from fireworld.kernels.air import exchange_with_air, spread_air
from fireworld.kernels.arrays import Array, BuildingArrays, CoverArrays, FireConstants, FireState, LinkArrays
from fireworld.kernels.codes import can_catch, fieryness_of, is_alight, is_burning
from fireworld.kernels.draws import normal
from fireworld.kernels.episode_arrays import AGE, N_BLOCKS, SITES_CHANGED, Warmth
from fireworld.kernels.jit import inner, kernel
from fireworld.kernels.warmth import ONE, PERIOD, begin, bounds, follow_heat, narrow

AMBIENT_KELVIN = 293.0
STEFAN_BOLTZMANN = 5.6704e-8
LEAST_SHARE = np.float32(0.005)


@inner
def may_burn(first: int, end: int, buildings: BuildingArrays, fire: FireState) -> bool:
    """Return whether any of the buildings [first, end) is hot enough to burn."""
    hot = False
    for b in range(first, end):
        hot |= fire.energy[b] >= buildings.ignition_energy[b]
    return hot


@inner
def draw_burn_rates(
    buildings: BuildingArrays, fire: FireState, constants: FireConstants, seed: int, step: int, warmth: Warmth
) -> float:
    """Draw the burn rate of every burning building from N(mean, sd) and return their sum; MODEL 2.3.

    Keyed by the building's id and the step: which other buildings burn changes nobody's draws.
    """
    total = 0.0
    for k in range(warmth.number[N_BLOCKS]):
        first, end = bounds(warmth.block[k], len(fire.energy))
        if not may_burn(first, end, buildings, fire):
            continue
        for b in range(first, end):
            if is_burning(b, buildings, fire):
                deviate = normal(seed, BURN_RATE, buildings.building_id[b], step)
                rate = constants.burn_rate_mean + constants.burn_rate_sd * deviate
                fire.rate[b] = rate
                total += rate
    return total


@inner
def burn(buildings: BuildingArrays, fire: FireState, warmth: Warmth) -> None:
    """Turn fuel into heat in every burning building.

    used = min(fuel, fuel0 * max(0.005, T/1000 * fuel/fuel0 * rate)); MODEL 2.3. `fire.rate` holds the step's draws.
    """
    for k in range(warmth.number[N_BLOCKS]):
        first, end = bounds(warmth.block[k], len(fire.energy))
        if not may_burn(first, end, buildings, fire):
            continue
        for b in range(first, end):
            if is_burning(b, buildings, fire):
                fuel, full = fire.fuel[b], buildings.initial_fuel[b]
                temperature = fire.energy[b] / buildings.capacity[b]
                share = float32(float32(temperature / 1000.0) * (fuel / full) * fire.rate[b])
                used = min(fuel, full * max(share, LEAST_SHARE))
                fire.energy[b] += used
                fire.fuel[b] = fuel - used


@inner
def is_dry(water: Array, first: int, end: int) -> bool:
    """Return whether no water lies on any of the buildings [first, end)."""
    wet = False
    for b in range(first, end):
        wet |= water[b] != 0
    return not wet


@inner
def cool(buildings: BuildingArrays, fire: FireState, constants: FireConstants, warmth: Warmth) -> None:
    """Let the water lying on hot buildings take heat; MODEL 2.4."""
    for k in range(warmth.number[N_BLOCKS]):
        first, end = bounds(warmth.block[k], len(fire.energy))
        if is_dry(fire.water, first, end):
            continue
        for b in range(first, end):
            litres = fire.water[b]
            heat = fire.energy[b] / buildings.capacity[b] * buildings.capacity[b]  # rounds as T * capacity does
            if litres > 0 and heat > 0.0:
                burning = is_burning(b, buildings, fire)
                taken = litres * (constants.water_heat_burning if burning else constants.water_heat_unburnt)
                used = litres
                if taken > heat:
                    part = 1.0 - (taken - heat) / taken
                    taken *= part
                    used = int(litres * part)
                fire.water[b] = litres - used
                fire.energy[b] -= taken


@inner
def radiate(buildings: BuildingArrays, links: LinkArrays, fire: FireState, warmth: Warmth) -> None:
    """Send out every building's radiation and share it among the buildings it is linked to; MODEL 2.7.

    emitted = min(E, (T + 293)^4 * emission), for all buildings before any receives.
    """
    energy, emitted = fire.energy, warmth.emitted
    for k in range(warmth.number[N_BLOCKS]):
        first, end = bounds(warmth.block[k], len(energy))
        for b in range(first, end):
            heat = energy[b]
            kelvin = heat / buildings.capacity[b] + AMBIENT_KELVIN
            square = kelvin * kelvin
            emitted[b] = min(heat, square * square * buildings.emission[b])
    for k in range(warmth.number[N_BLOCKS]):
        first, end = bounds(warmth.block[k], len(energy))
        for b in range(first, end):
            sent = emitted[b]
            if sent != 0.0:
                for link in range(links.ptr[b], links.ptr[b + ONE]):
                    energy[links.building[link]] += sent * links.share[link]
                energy[b] -= sent


@inner
def settle(buildings: BuildingArrays, fire: FireState, constants: FireConstants, warmth: Warmth) -> None:
    """Flush tiny heat to zero where asked, then give every building its code; MODEL 2 and its codes."""
    energy, doubtful = fire.energy, warmth.is_doubtful
    for k in range(warmth.number[N_BLOCKS]):
        block = warmth.block[k]
        first, end = bounds(block, len(energy))
        hot = False
        for b in range(first, end):
            heat = energy[b]
            heat = 0.0 if heat < constants.flush_temperature * buildings.capacity[b] else heat
            energy[b] = heat
            hot |= heat >= buildings.ignition_energy[b]
        if hot or doubtful[block] != 0:
            doubtful[block] = code_block(first, end, buildings, fire, warmth)


@inner
def code_block(first: int, end: int, buildings: BuildingArrays, fire: FireState, warmth: Warmth) -> bool:
    """Give the buildings [first, end) their codes; return whether one of them burns, and may not burn any more soon."""
    codes, changed, burns = fire.fieryness, False, False
    for b in range(first, end):
        burning, fuel, full = is_burning(b, buildings, fire), fire.fuel[b], buildings.initial_fuel[b]
        code = np.uint8(fieryness_of(burning, fuel, full, buildings.inflammable[b], fire.watered[b]))
        warmth.code[b] = code
        changed |= code != codes[b]
        burns |= is_alight(code)
    if changed:
        for b in range(first, end):
            if warmth.code[b] != codes[b]:
                change_code(b, warmth.code[b], fire, warmth)
    return burns


@inner
def change_code(b: int, code: int, fire: FireState, warmth: Warmth) -> None:
    """Give a building another code, and note whether fire sites can be others by that."""
    before = fire.fieryness[b]
    fire.fieryness[b] = code
    warmth.n_of_code[before] -= 1
    warmth.n_of_code[code] += 1
    if is_alight(code) != is_alight(before) or can_catch(code) != can_catch(before):
        warmth.number[SITES_CHANGED] = 1


@kernel
def ignite(b: int, buildings: BuildingArrays, fire: FireState) -> bool:
    """Set building b on fire: E = capacity * ignition point * 1.5; only from code 0 or 4, and if inflammable."""
    code = fire.fieryness[b]
    if buildings.inflammable[b] == 0 or code not in (0, 4):
        return False
    fire.energy[b] = float32(buildings.capacity[b] * buildings.ignition_point[b]) * 1.5
    fire.fieryness[b] = 1
    return True


@inner
def light(buildings: BuildingArrays, fire: FireState, step: int) -> int:
    """Light the fires of a step, before everything else in it; return how many there are."""
    n_lit = 0
    for k in range(len(buildings.later_step)):
        if buildings.later_step[k] == step:
            ignite(buildings.later_building[k], buildings, fire)
            n_lit += 1
    return n_lit


@kernel
def is_over(n_burning: int, later_step: Array, step: int) -> bool:
    """Return whether nothing burns after a step, and no fire is lit later; (k,) int64 steps, rising."""
    return n_burning == 0 and (len(later_step) == 0 or later_step[-1] <= step)


@inner
def burn_on(
    buildings: BuildingArrays,
    cover: CoverArrays,
    links: LinkArrays,
    fire: FireState,
    constants: FireConstants,
    warmth: Warmth,
) -> None:
    """Run phases 3 to 8 of a step: burn, cool, air, exchange, radiation, cool; then the codes."""
    if warmth.number[AGE] % PERIOD == 1:
        narrow(cover, links, fire, warmth)
    warmth.number[AGE] += 1
    burn(buildings, fire, warmth)
    cool(buildings, fire, constants, warmth)
    spread_air(cover, fire, constants, warmth)
    follow_heat(cover, links, fire, warmth)
    exchange_with_air(buildings, cover, fire, constants, warmth)
    follow_heat(cover, links, fire, warmth)
    radiate(buildings, links, fire, warmth)
    cool(buildings, fire, constants, warmth)
    settle(buildings, fire, constants, warmth)


@kernel
def advance_fire(
    buildings: BuildingArrays,
    cover: CoverArrays,
    links: LinkArrays,
    fire: FireState,
    constants: FireConstants,
    warmth: Warmth,
) -> None:
    """Run `burn_on` in whatever state the fire is."""
    begin(cover, fire, warmth)
    burn_on(buildings, cover, links, fire, constants, warmth)
