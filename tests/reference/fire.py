"""The fire model in plain numpy: every phase of the official program, one function each.

Written to be read beside MODEL section 2 and to be as fast as plain numpy gets, because the benchmarks measure the
compiled kernels against it. On every trace of the official program no code, fuel or water differs. Temperatures are
degrees above ambient; n buildings, an air grid of nx * ny cells.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Final, Self

import numpy as np

from fireworld.city.city import AirCells, Array, City, Float32Array, Float64Array, Links
from fireworld.parameters import FireParameters

AMBIENT_KELVIN: Final = 293.0
STEFAN_BOLTZMANN: Final = 5.6704e-8
LEAST_SHARE: Final = np.float32(0.005)


def single(value: float) -> float:
    """Round to float32: the official program keeps its parameters in single precision."""
    return float(np.float32(value))


@dataclass(frozen=True)
class Covers:
    """Which building lies over which air cell, sorted by rank: the r-th building over a cell, as they are visited.

    No cell occurs twice in a rank, and only cells pass heat on from one building to the next: whole ranks, one after
    the other, therefore give exactly what the sequential exchange gives.
    """

    ranks: tuple[slice, ...]  # the covers of each rank
    building: Array  # (covers,)
    cell: Array  # (covers,) index into the flat, bordered air grid
    weight: Float64Array  # (covers,) energy per degree of difference

    @classmethod
    def of(cls, air: AirCells, order: Array, *, flow: float) -> Self:
        """Rank the covers of a city. `order` (n,) is the order in which buildings are visited."""
        n = len(order)
        building = np.repeat(np.arange(n), np.diff(air.ptr))
        cell = (air.x.astype(np.int64) + 1) * (air.shape[1] + 2) + air.y + 1
        turn = np.empty(n, dtype=np.int64)
        turn[order] = np.arange(n)
        by_cell = np.lexsort((turn[building], cell))
        place = np.arange(len(by_cell))
        starts = np.diff(cell[by_cell], prepend=-1) > 0
        rank = np.empty_like(place)
        rank[by_cell] = place - np.maximum.accumulate(np.where(starts, place, 0))
        by_rank = np.argsort(rank, kind="stable")
        ends = np.cumsum(np.bincount(rank)).tolist()
        return cls(
            ranks=tuple(slice(start, end) for start, end in zip([0, *ends], ends, strict=False)),
            building=building[by_rank],
            cell=cell[by_rank],
            weight=(flow * (air.percent / 100.0) * air.cell_mm)[by_rank],
        )


@dataclass(frozen=True)
class FireTables:
    """What is fixed during an episode."""

    capacity: Float64Array  # (n,) energy per degree, a float32 number
    initial_fuel: Float32Array  # (n,)
    ignition_point: Float64Array  # (n,)
    ignition_energy: Float64Array  # (n,) that a building set on fire is given
    inflammable: Array  # (n,) bool
    two_thirds: Float64Array  # (n,) fuel at which code 1 ends
    one_third: Float64Array  # (n,) fuel at which code 2 ends
    emission: Float64Array  # (n,) energy radiated per K^4
    covers: Covers
    link_from: Array  # (links,)
    link_to: Array  # (links,)
    link_share: Float64Array  # (links,) a float32 number
    air_shape: tuple[int, int]
    air_to_air_flow: float
    air_heat_kept: float
    cell_capacity: float  # energy per degree of an air cell
    water_heat_burning: float  # taken by a litre on a burning building
    water_heat_unburnt: float  # taken by a litre on any other
    flush_temperature: float

    @classmethod
    def of_city(cls, city: City, parameters: FireParameters) -> Self:
        """Prepare a city."""
        return cls.of_arrays(
            capacity=city.heat_capacity,
            initial_fuel=city.initial_fuel,
            ignition_point=city.ignition_point,
            inflammable=city.footprints.inflammable,
            wall_area_m2=city.wall_area_m2,
            order=city.order,
            air=city.air,
            links=city.links,
            parameters=parameters,
        )

    @classmethod
    def of_arrays(
        cls,
        *,
        capacity: Array,
        initial_fuel: Array,
        ignition_point: Array,
        inflammable: Array,
        wall_area_m2: Array,
        order: Array,
        air: AirCells,
        links: Links,
        parameters: FireParameters,
    ) -> Self:
        """Prepare plain arrays, (n,) each, with the types of `City`."""
        n = len(capacity)
        exact = capacity.astype(np.float64)
        cell_mm = np.float32(air.cell_mm)
        return cls(
            capacity=exact,
            initial_fuel=initial_fuel,
            ignition_point=ignition_point.astype(np.float64),
            ignition_energy=(capacity * ignition_point).astype(np.float64) * 1.5,
            inflammable=inflammable.astype(np.bool_),
            two_thirds=initial_fuel.astype(np.float64) * 0.66,
            one_third=initial_fuel.astype(np.float64) * 0.33,
            emission=wall_area_m2 * single(parameters.radiation_coefficient) * STEFAN_BOLTZMANN,
            covers=Covers.of(air, order, flow=single(parameters.air_to_building_flow)),
            link_from=np.repeat(np.arange(n), np.diff(links.ptr)),
            link_to=links.building.astype(np.int64),
            link_share=links.share.astype(np.float64),
            air_shape=air.shape,
            air_to_air_flow=single(parameters.air_to_air_flow),
            air_heat_kept=single(parameters.air_heat_kept),
            cell_capacity=float(np.float32(parameters.air_heat_capacity) * cell_mm),
            water_heat_burning=single(parameters.water_heat_per_litre),
            water_heat_unburnt=float(
                np.float32(parameters.water_heat_per_litre) * np.float32(parameters.water_unburnt_share)
            ),
            flush_temperature=parameters.flush_temperature,
        )


@dataclass
class FireState:
    """What a step changes."""

    energy: Float64Array  # (n,)
    fuel: Float32Array  # (n,)
    water: Array  # (n,) int64, litres lying on the building
    watered: Array  # (n,) bool, True once water has reached it
    fieryness: Array  # (n,) uint8, official code
    air: Float64Array  # (nx + 2, ny + 2), degrees; a border of zeros around the cells

    @classmethod
    def cold(cls, tables: FireTables) -> Self:
        """Nothing burns, nothing is warm."""
        n = len(tables.capacity)
        return cls(
            energy=np.zeros(n),
            fuel=tables.initial_fuel.copy(),
            water=np.zeros(n, dtype=np.int64),
            watered=np.zeros(n, dtype=np.bool_),
            fieryness=np.zeros(n, dtype=np.uint8),
            air=np.zeros((tables.air_shape[0] + 2, tables.air_shape[1] + 2)),
        )

    def copy(self) -> FireState:
        """Return an independent copy."""
        return FireState(**{item.name: getattr(self, item.name).copy() for item in fields(self)})

    @property
    def cells(self) -> Float64Array:
        """(nx, ny) view of the air without its border."""
        return self.air[1:-1, 1:-1]


def is_burning(tables: FireTables, fire: FireState) -> Array:
    """(n,) bool: hot enough, fuel left, inflammable; codes 1 to 3, as of this moment."""
    hot = fire.energy / tables.capacity >= tables.ignition_point
    return hot & (fire.fuel > 0) & tables.inflammable


def code(tables: FireTables, fire: FireState) -> Array:
    """(n,) uint8: the official fieryness codes, as of this moment."""
    burnt = (fire.fuel < tables.two_thirds).astype(np.uint8) + (fire.fuel < tables.one_third)
    codes = np.where(is_burning(tables, fire), 1 + burnt, 5 + burnt + (fire.fuel == 0))
    codes[(fire.fuel == tables.initial_fuel) & (codes == 5)] = 0
    codes[(codes == 0) & fire.watered] = 4
    codes[~tables.inflammable] = 0
    return codes.astype(np.uint8)


def ignite(tables: FireTables, fire: FireState, buildings: Array) -> None:
    """Set buildings on fire; acts on inflammable ones with code 0 or 4."""
    chosen = buildings[np.isin(fire.fieryness[buildings], (0, 4)) & tables.inflammable[buildings]]
    fire.energy[chosen] = tables.ignition_energy[chosen]
    fire.fieryness = code(tables, fire)


def pour(fire: FireState, building: int, litres: int) -> None:
    """Let water fall on a building; it acts when the building is next cooled."""
    fire.water[building] += litres
    fire.watered[building] = True


def burn(tables: FireTables, fire: FireState, rate: Float64Array) -> None:
    """Turn fuel into heat; MODEL 2.3. Fuel is single precision throughout.

    Args:
        tables: the city.
        fire: energy and fuel are changed.
        rate: (n,) burn rate of every building, burning or not.
    """
    b = np.flatnonzero(is_burning(tables, fire))
    fuel, full = fire.fuel[b], tables.initial_fuel[b]
    temperature = (fire.energy[b] / tables.capacity[b] / 1000.0).astype(np.float32)
    share = ((temperature * (fuel / full)).astype(np.float64) * rate[b]).astype(np.float32)
    used = np.minimum(fuel, full * np.maximum(share, LEAST_SHARE))
    fire.energy[b] += used
    fire.fuel[b] = fuel - used


def cool(tables: FireTables, fire: FireState) -> None:
    """Let water take heat; MODEL 2.4. Which buildings burn is judged anew: the phases before may have changed it."""
    if not fire.water.any():
        return
    heat = fire.energy / tables.capacity * tables.capacity
    b = np.flatnonzero((fire.water > 0) & (heat > 0))
    heat, litres = heat[b], fire.water[b]
    per_litre = np.where(is_burning(tables, fire)[b], tables.water_heat_burning, tables.water_heat_unburnt)
    taken = litres * per_litre
    part = np.where(taken > heat, 1.0 - (taken - heat) / taken, 1.0)
    fire.water[b] -= (litres * part).astype(np.int64)
    fire.energy[b] -= taken * part


def spread_air(tables: FireTables, fire: FireState) -> None:
    """Mix every cell with its eight neighbours and lose some heat; MODEL 2.5."""
    air, cells = fire.air, fire.cells
    rows = air[:-2] + air[1:-1]
    rows += air[2:]
    mean = rows[:, :-2] + rows[:, 1:-1]
    mean += rows[:, 2:]
    mean -= cells
    mean *= 0.125
    mean -= cells
    mean *= tables.air_to_air_flow
    mean += cells
    mean *= tables.air_heat_kept
    if tables.flush_temperature > 0:
        mean[mean <= tables.flush_temperature] = 0.0
    np.maximum(mean, 0.0, out=cells)


def exchange_with_air(tables: FireTables, fire: FireState) -> None:
    """Let each building in turn exchange heat with the cells under it; MODEL 2.6, rank by rank (see Covers)."""
    covers, air = tables.covers, fire.air.reshape(-1)
    warmth = (fire.energy / tables.capacity).take(covers.building)  # a building's temperature is fixed meanwhile
    gain = np.empty(len(covers.building))
    for rank in covers.ranks:
        degrees = air.take(covers.cell[rank])
        gain[rank] = (degrees - warmth[rank]) * covers.weight[rank]
        air[covers.cell[rank]] = degrees - gain[rank] / tables.cell_capacity
    fire.energy += np.bincount(covers.building, weights=gain, minlength=len(fire.energy))


def radiate(tables: FireTables, fire: FireState) -> None:
    """Send out every building's radiation and share it among those it is linked to; MODEL 2.7."""
    kelvin = fire.energy / tables.capacity + AMBIENT_KELVIN
    square = kelvin * kelvin
    emitted = np.minimum(fire.energy, square * square * tables.emission)
    received = emitted.take(tables.link_from) * tables.link_share
    fire.energy += np.bincount(tables.link_to, weights=received, minlength=len(emitted)) - emitted


def settle(tables: FireTables, fire: FireState) -> None:
    """Flush tiny heat to zero where asked, then give every building its code."""
    if tables.flush_temperature > 0:
        fire.energy[fire.energy < tables.flush_temperature * tables.capacity] = 0.0
    fire.fieryness = code(tables, fire)


def advance_fire(tables: FireTables, fire: FireState, rate: Float64Array) -> None:
    """Run phases 3 to 8 of a step, then the codes. `rate` is (n,), as of `burn`."""
    burn(tables, fire, rate)
    cool(tables, fire)
    spread_air(tables, fire)
    exchange_with_air(tables, fire)
    radiate(tables, fire)
    cool(tables, fire)
    settle(tables, fire)
