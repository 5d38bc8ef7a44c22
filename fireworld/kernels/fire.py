"""The official fire model: burning, water, air and radiation, one function a phase.

MODEL section 2 in the docs has every equation. All temperatures are degrees above ambient.
"""

from __future__ import annotations

import numpy as np
from numba import float32

from fireworld.draws import BURN_RATE
from fireworld.kernels.arrays import Array, BuildingTables, CoverTables, FireConstants, FireState, LinkTables
from fireworld.kernels.draws import normal
from fireworld.kernels.jit import inner, kernel

AMBIENT_KELVIN = 293.0
STEFAN_BOLTZMANN = 5.6704e-8
LEAST_SHARE = np.float32(0.005)
ONE, TWO, THREE, FOUR = np.uint32(1), np.uint32(2), np.uint32(3), np.uint32(4)
PADDING = 5
"""Cells of a row of air that are no cells of the city: one before, four behind them."""


@inner
def is_burning(energy: float, capacity: float, ignition_point: float, fuel: float, inflammable: int) -> bool:
    """Tell whether a building burns: hot enough, fuel left, inflammable (codes 1 to 3).

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


@kernel
def draw_burn_rates(
    buildings: BuildingTables, fire: FireState, constants: FireConstants, seed: int, step: int
) -> float:
    """Draw the burn rate of every burning building from N(mean, sd) and return their sum; MODEL 2.3.

    Keyed by the building's id and the step: which other buildings burn changes nobody's luck.
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
def burn(buildings: BuildingTables, fire: FireState) -> None:
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
def cool(buildings: BuildingTables, fire: FireState, constants: FireConstants) -> None:
    """Let the water lying on hot buildings take heat; MODEL 2.4."""
    for b in range(len(fire.energy)):
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
def spread_air(fire: FireState, constants: FireConstants) -> None:
    """Mix every air cell with its eight neighbours and lose some heat; MODEL 2.5. Only the warm rows are touched.

    Heat reaches one cell farther than before, so the warm box first grows by one on every side, within the grid. Works
    in place: two rows of `scratch` keep the row before and the row itself as they were. Whole rows, one array a row
    and no bounds but their length: that is what the compiler turns into vector instructions.
    """
    air, warm = fire.air, fire.warm
    if warm[1] <= warm[0]:
        return
    flow, kept, flush = constants.air_to_air_flow, constants.air_heat_kept, constants.flush_temperature
    rows, pitch = air.shape
    warm[0], warm[1] = max(1, warm[0] - 1), min(rows - 1, warm[1] + 1)
    warm[2], warm[3] = max(1, warm[2] - 1), min(pitch - PADDING + 1, warm[3] + 1)
    before, here, sums = fire.scratch[0], fire.scratch[1], fire.scratch[2]
    for y in range(pitch):
        before[y] = 0.0
    for x in range(warm[0], warm[1]):
        row, after = air[x], air[x + 1]
        for y in range(len(row)):
            here[y] = row[y]
            sums[y] = before[y] + row[y] + after[y]
        for y in range(len(row) - PADDING):
            old = here[y + 1]
            mean = (sums[y] + sums[y + 1] + sums[y + 2] - old) * 0.125
            warmth = (old + (mean - old) * flow) * kept
            row[y + 1] = warmth if warmth > flush else 0.0
        before, here = here, before
    shrink(air, warm)


@inner
def is_cold(air: Array, x0: int, x1: int, y0: int, y1: int) -> bool:
    """Tell whether all cells of a block of air are exactly zero."""
    for x in range(x0, x1):
        for y in range(y0, y1):
            if air[x, y] != 0.0:
                return False
    return True


@inner
def shrink(air: Array, warm: Array) -> None:
    """Draw the warm box in to the cells that are not zero."""
    while warm[0] < warm[1] and is_cold(air, warm[0], warm[0] + 1, warm[2], warm[3]):
        warm[0] += 1
    while warm[0] < warm[1] and is_cold(air, warm[1] - 1, warm[1], warm[2], warm[3]):
        warm[1] -= 1
    while warm[2] < warm[3] and is_cold(air, warm[0], warm[1], warm[2], warm[2] + 1):
        warm[2] += 1
    while warm[2] < warm[3] and is_cold(air, warm[0], warm[1], warm[3] - 1, warm[3]):
        warm[3] -= 1


@inner
def exchange_with_air(buildings: BuildingTables, cover: CoverTables, fire: FireState, constants: FireConstants) -> None:
    """Let each building in turn exchange heat with the air cells under it; MODEL 2.6.

    q = (T_cell - T_building) * weight; the cell loses q * cell_share, the building gains the sum. A building without
    heat over cells without heat is passed over: nothing would change. Four cells go at once, with a sum each, because
    one sum would make every cell wait for the one before; unsigned indices spare numba's test for negative ones.
    """
    energy, air, weight, warm = fire.energy, fire.air, cover.weight, fire.warm
    share = constants.cell_share
    first, end, low, high = warm[0], warm[1], warm[2], warm[3]
    for k in range(len(buildings.order)):
        b = buildings.order[k]
        x0, y0 = cover.x0[b], cover.y0[b]
        x1, y1 = x0 + cover.rows[b], y0 + cover.width[b]
        if energy[b] == 0.0:
            if x1 <= first or x0 >= end or y1 <= low or y0 >= high or is_cold(air, x0, x1, y0, y1):
                continue
        elif end <= first:
            first, end, low, high = x0, x1, y0, y1
        else:
            first, end, low, high = min(first, x0), max(end, x1), min(low, y0), max(high, y1)
        temperature = energy[b] / buildings.capacity[b]
        p = cover.ptr[b]
        gain_0 = gain_1 = gain_2 = gain_3 = 0.0
        for x in range(x0, x1):
            y = y0
            while y < y1:
                cell_0, cell_1, cell_2, cell_3 = air[x, y], air[x, y + ONE], air[x, y + TWO], air[x, y + THREE]
                q_0 = (cell_0 - temperature) * weight[p]
                q_1 = (cell_1 - temperature) * weight[p + ONE]
                q_2 = (cell_2 - temperature) * weight[p + TWO]
                q_3 = (cell_3 - temperature) * weight[p + THREE]
                air[x, y] = cell_0 - q_0 * share
                air[x, y + ONE] = cell_1 - q_1 * share
                air[x, y + TWO] = cell_2 - q_2 * share
                air[x, y + THREE] = cell_3 - q_3 * share
                gain_0 += q_0
                gain_1 += q_1
                gain_2 += q_2
                gain_3 += q_3
                p += FOUR
                y += FOUR
        energy[b] += (gain_0 + gain_1) + (gain_2 + gain_3)
    warm[0], warm[1], warm[2], warm[3] = first, end, low, high


@inner
def radiate(buildings: BuildingTables, links: LinkTables, fire: FireState) -> None:
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
def settle(buildings: BuildingTables, fire: FireState, constants: FireConstants) -> None:
    """Flush tiny heat to zero where asked, then give every building its code; MODEL 2 and its codes."""
    for b in range(len(fire.energy)):
        capacity = buildings.capacity[b]
        if fire.energy[b] < constants.flush_temperature * capacity:
            fire.energy[b] = 0.0
        inflammable, fuel = buildings.inflammable[b], fire.fuel[b]
        burning = is_burning(fire.energy[b], capacity, buildings.ignition_point[b], fuel, inflammable)
        fire.fieryness[b] = fieryness_of(burning, fuel, buildings.initial_fuel[b], inflammable, fire.watered[b])


@kernel
def ignite(b: int, buildings: BuildingTables, fire: FireState) -> bool:
    """Set building b on fire: E = capacity * ignition point * 1.5; only from code 0 or 4, and if inflammable."""
    code = fire.fieryness[b]
    if buildings.inflammable[b] == 0 or code not in (0, 4):
        return False
    fire.energy[b] = float32(buildings.capacity[b] * buildings.ignition_point[b]) * 1.5
    fire.fieryness[b] = 1
    return True


@kernel
def advance_fire(
    buildings: BuildingTables, cover: CoverTables, links: LinkTables, fire: FireState, constants: FireConstants
) -> None:
    """Run phases 3 to 8 of a step: burn, cool, air, exchange, radiation, cool; then the codes."""
    burn(buildings, fire)
    cool(buildings, fire, constants)
    spread_air(fire, constants)
    exchange_with_air(buildings, cover, fire, constants)
    radiate(buildings, links, fire)
    cool(buildings, fire, constants)
    settle(buildings, fire, constants)
