"""Turn a City and its parameters into the tables and constants that kernels work on."""

from __future__ import annotations

import math

import numpy as np

from fireworld.city.city import City, Streets
from fireworld.kernels.arrays import (
    Array,
    BrigadeConstants,
    BuildingArrays,
    CityArrays,
    CoverArrays,
    FireConstants,
    GeometryArrays,
    HealthConstants,
    LinkArrays,
    NearArrays,
    ObservationConstants,
    StreetArrays,
)
from fireworld.kernels.fire import STEFAN_BOLTZMANN
from fireworld.kernels.warmth import TILE, WORD, tiles_of
from fireworld.parameters import BrigadeParameters, FireParameters, HealthParameters
from fireworld.scenario.observed import FLAGS, Observed

CIVILIAN_LOW_M = 30.0
CIVILIAN_MEDIUM_M = 80.0
JUMP_MM = 10_000.0
"""The widest street that fire jumps, where streets keep it: those of generated cities have 8 m."""
LANES = 4
"""Air cells that the exchange handles at once; rows of cells are padded to a multiple of it."""
BORDER = 1
"""Empty rows and cells around the air grid."""


def single(value: float) -> float:
    """Round to single precision, as the official program keeps most of its parameters."""
    return float(np.float32(value))


def building_arrays(city: City, fire: FireParameters) -> BuildingArrays:
    """Collect what the fire model needs of every building."""
    return BuildingArrays(
        building_id=city.footprints.building_id.astype(np.int64),
        capacity=city.heat_capacity.astype(np.float64),
        initial_fuel=city.initial_fuel.astype(np.float32),
        ignition_point=city.ignition_point.astype(np.float64),
        ignition_energy=ignition_energy(city.heat_capacity.astype(np.float64), city.ignition_point.astype(np.float64)),
        emission=city.wall_area_m2 * single(fire.radiation_coefficient) * STEFAN_BOLTZMANN,
        inflammable=city.footprints.inflammable.astype(np.uint8),
        later_step=np.zeros(0, dtype=np.int64),
        later_building=np.zeros(0, dtype=np.int64),
    )


def ignition_energy(capacity: Array, ignition_point: Array) -> Array:
    """Return the least energy above 0 at which energy / capacity, rounded, is the ignition point; (n,) float64 all."""
    least: Array = np.maximum(ignition_point * capacity, np.nextafter(0.0, 1.0))
    lower = np.nextafter(least, 0.0)
    while (enough := (lower > 0.0) & (lower / capacity >= ignition_point)).any():
        least = np.where(enough, lower, least)
        lower = np.nextafter(least, 0.0)
    while (short := least / capacity < ignition_point).any():
        least = np.where(short, np.nextafter(least, np.inf), least)
    return least


def cover_arrays(city: City, fire: FireParameters) -> CoverArrays:
    """Lay each building's air cells out as a dense block, so that the exchange reads rows of cells in one go."""
    air = city.air
    starts, ends = air.ptr[:-1], air.ptr[1:]
    west, south = np.minimum.reduceat(air.x, starts), np.minimum.reduceat(air.y, starts)
    rows = np.maximum.reduceat(air.x, starts) - west + 1
    width = (np.maximum.reduceat(air.y, starts) - south) // LANES * LANES + LANES
    ptr = np.concatenate([[0], np.cumsum(rows * width)])
    owner = np.repeat(np.arange(city.n_buildings), ends - starts)
    weight = np.zeros(int(ptr[-1]))
    place = ptr[owner] + (air.x - west[owner]) * width[owner] + (air.y - south[owner])
    weight[place] = single(fire.air_to_building_flow) * (air.percent / 100.0) * air.cell_mm
    west, south = west + BORDER, south + BORDER
    tile_ptr, tile_position = tiles_over(west, south, rows, width, city.order, tiles_of(air_shape(city)))
    return CoverArrays(
        x0=west.astype(np.uint32),
        y0=south.astype(np.uint32),
        rows=rows.astype(np.uint32),
        width=width.astype(np.uint32),
        ptr=ptr[:-1].astype(np.uint32),
        weight=weight,
        order=city.order.astype(np.uint32),
        tile_ptr=tile_ptr,
        tile_position=tile_position,
    )


def tiles_over(
    x0: Array, y0: Array, rows: Array, width: Array, order: Array, tiles: tuple[int, int]
) -> tuple[Array, Array]:
    """Return the positions in the order of visits of the blocks of air that reach into each tile, as CSR.

    Args:
        x0: (n,) first row of each block.
        y0: (n,) its first cell.
        rows: (n,) rows.
        width: (n,) cells.
        order: (n,) the order of visits.
        tiles: rows and columns of tiles.
    """
    first_row, first_column = x0 // TILE, y0 // TILE
    n_rows, n_columns = (x0 + rows - 1) // TILE + 1 - first_row, (y0 + width - 1) // TILE + 1 - first_column
    sizes = n_rows * n_columns
    block = np.repeat(np.arange(len(x0)), sizes)
    k = np.arange(len(block)) - np.repeat(np.cumsum(sizes) - sizes, sizes)  # which of its block's tiles
    row, column = first_row[block] + k // n_columns[block], first_column[block] + k % n_columns[block]
    tile = row * tiles[1] + column
    by_tile = np.argsort(tile, kind="stable")
    position = np.empty(len(order), dtype=np.uint32)
    position[order] = np.arange(len(order))
    ptr = np.concatenate([[0], np.cumsum(np.bincount(tile, minlength=tiles[0] * tiles[1]))])
    return ptr.astype(np.uint32), position[block[by_tile]]


def geometry_arrays(city: City) -> GeometryArrays:
    """Collect where the buildings are and how big they are."""
    outline, starts = city.footprints.outline_mm.astype(np.float64), city.footprints.outline_ptr[:-1]
    low, high = np.minimum.reduceat(outline, starts), np.maximum.reduceat(outline, starts)
    x, y = city.footprints.centroid_mm.astype(np.float64).T.copy()
    middle_x, middle_y = city.middle_mm
    floor_area = city.footprints.ground_area_m2.astype(np.float64) * city.footprints.floors
    return GeometryArrays(
        x=x,
        y=y,
        west=low[:, 0].copy(),
        south=low[:, 1].copy(),
        east=high[:, 0].copy(),
        north=high[:, 1].copy(),
        center_square=(x - middle_x) ** 2 + (y - middle_y) ** 2,
        volume=city.volume_m3.astype(np.float64),
        floor_area=floor_area,
    )


def street_arrays(streets: Streets, refuge: Array) -> StreetArrays:
    """Collect the street graph, with the streets at each node as CSR, and the refuges on it, building indices."""
    first, second = streets.street[:, 0], streets.street[:, 1]
    node = np.concatenate([first, second])
    other = np.concatenate([second, first])
    street = np.tile(np.arange(len(first)), 2)
    arcs = np.lexsort((street, node))
    n_nodes = len(streets.node_mm)
    return StreetArrays(
        node_x=streets.node_mm[:, 0].astype(np.float64),
        node_y=streets.node_mm[:, 1].astype(np.float64),
        first=first.astype(np.int32),
        second=second.astype(np.int32),
        length=streets.street_length_mm.astype(np.int64),
        arc_ptr=np.concatenate([[0], np.cumsum(np.bincount(node, minlength=n_nodes))]).astype(np.int32),
        arc_node=other[arcs].astype(np.int32),
        arc_street=street[arcs].astype(np.int32),
        access_street=streets.access_street.astype(np.int32),
        access_offset=streets.access_offset_mm.astype(np.int64),
        refuge=refuge.astype(np.int32),
        hydrant_node=streets.hydrant_node.astype(np.int32),
    )


def city_arrays(city: City, fire: FireParameters) -> CityArrays:
    """Build all tables of a city."""
    return CityArrays(
        buildings=building_arrays(city, fire),
        cover=cover_arrays(city, fire),
        links=link_arrays(city),
        geometry=geometry_arrays(city),
        near=near_arrays(city.near.ptr, city.near.building),
        streets=street_arrays(city.streets, np.flatnonzero(city.footprints.refuge)),
    )


def near_arrays(ptr: Array, building: Array) -> NearArrays:
    """Put near buildings, (n+1,) start of each one's and their numbers, rising, into words of bits."""
    owner = np.repeat(np.arange(len(ptr) - 1), np.diff(ptr))
    word = building.astype(np.int64) // WORD
    is_first = np.ones(len(word), dtype=bool)
    is_first[1:] = (owner[1:] != owner[:-1]) | (word[1:] != word[:-1])
    first = np.flatnonzero(is_first)
    bit = np.uint64(1) << (building.astype(np.uint64) % np.uint64(WORD))
    sizes = np.bincount(owner[first], minlength=len(ptr) - 1)
    return NearArrays(
        ptr=np.concatenate([[0], np.cumsum(sizes)]).astype(np.uint32),
        word=word[first].astype(np.uint32),
        bits=np.bitwise_or.reduceat(bit, first) if len(first) else bit,
    )


def link_arrays(city: City) -> LinkArrays:
    """Collect the radiation links."""
    ptr, building = city.links.ptr, city.links.building
    owner = np.repeat(np.arange(city.n_buildings), np.diff(ptr))
    burns = city.footprints.inflammable[building] != 0
    centroid = city.footprints.centroid_mm[building[burns]].astype(np.float64)
    low, high = np.full((2, city.n_buildings), np.inf), np.full((2, city.n_buildings), -np.inf)
    for axis in range(2):
        np.minimum.at(low[axis], owner[burns], centroid[:, axis])
        np.maximum.at(high[axis], owner[burns], centroid[:, axis])
    return LinkArrays(
        ptr=ptr.astype(np.uint32),
        building=building.astype(np.uint32),
        share=city.links.share.astype(np.float64),
        west=low[0].copy(),
        south=low[1].copy(),
        east=high[0].copy(),
        north=high[1].copy(),
    )


def fire_constants(fire: FireParameters) -> FireConstants:
    """Round the fire model's scalars as the official program does (single precision, and products of such)."""
    cell = np.float32(fire.air_heat_capacity) * np.float32(fire.air_cell_mm)
    return FireConstants(
        burn_rate_mean=float(fire.burn_rate_mean),
        burn_rate_sd=float(fire.burn_rate_sd),
        air_to_air_flow=single(fire.air_to_air_flow),
        air_heat_kept=single(fire.air_heat_kept),
        cell_share=1.0 / float(cell),
        water_heat_burning=single(fire.water_heat_per_litre),
        water_heat_unburnt=float(np.float32(fire.water_heat_per_litre) * np.float32(fire.water_unburnt_share)),
        flush_temperature=float(fire.flush_temperature),
    )


def health_constants(health: HealthParameters) -> HealthConstants:
    """Turn the three probabilities into the bounds of one uniform draw."""
    slight = health.slight_probability
    serious = slight + health.serious_probability
    return HealthConstants(
        slight_damage=float(health.slight_damage),
        slight_below=slight,
        serious_damage=float(health.serious_damage),
        serious_below=serious,
        critical_damage=float(health.critical_damage),
        critical_below=serious + health.critical_probability,
        growth=float(health.growth),
        constant=float(health.constant),
        noise_mean=float(health.noise_mean),
        noise_sd=float(health.noise_sd),
        brigade_share=float(health.brigade_share),
        initial_hp=health.initial_hp,
    )


def brigade_constants(brigades: BrigadeParameters, *, free: bool = False, keeps: bool = False) -> BrigadeConstants:
    """Turn metres into millimetres."""
    range_mm = round(brigades.range_m * 1000.0)  # whole, so that a brigade exactly at its range may spray
    return BrigadeConstants(
        tank=brigades.tank_litres,
        power=brigades.power_litres,
        refuge_refill=brigades.refuge_refill_litres,
        hydrant_refill=brigades.hydrant_refill_litres,
        range_square=float(range_mm * range_mm),
        speed=round(brigades.speed_m * 1000.0),
        free=free,
        keeps=keeps,
    )


def observation_constants(
    city: City, unit_volume_m3: float | None, *, in_turn: bool, observed: Observed | None = None
) -> ObservationConstants:
    """Derive the thresholds of the features: thirds of the half diagonal, 30 and 80 m, the unit volume."""
    seen = Observed() if observed is None else observed
    third = city.half_diagonal_mm / 3.0
    near, far = third * third, 4.0 * third * third
    if seen.center_shares is not None:
        near, far = ((share * city.half_diagonal_mm) ** 2 for share in seen.center_shares)
    mean_volume = math.fsum(city.volume_m3.tolist()) / city.n_buildings
    low, medium = (length * 1000.0 for length in seen.civilian_m or (CIVILIAN_LOW_M, CIVILIAN_MEDIUM_M))
    places, burns = city.footprints.centroid_mm, city.footprints.inflammable != 0
    places = places[burns] if burns.any() else places
    return ObservationConstants(
        center_low_square=near,
        center_medium_square=far,
        civilian_low_square=low * low,
        civilian_medium_square=medium * medium,
        unit_volume=float(unit_volume_m3) if unit_volume_m3 is not None else 2.0 * mean_volume,
        in_turn=in_turn,
        volume_growth=2.0 if seen.volume_growth is None else float(seen.volume_growth),
        own_flags=seen.flags_of == "all",
        flags=FLAGS.index(seen.flags or "action"),
        heated=seen.easiest == "heated",
        jump=JUMP_MM if seen.free_edges == "streets" else math.inf,
        edge_by_city=seen.free_edges == "city",
        west=float(places[:, 0].min()),
        south=float(places[:, 1].min()),
        east=float(places[:, 0].max()),
        north=float(places[:, 1].max()),
    )


def air_shape(city: City) -> tuple[int, int]:
    """Return rows and pitch of the padded air array."""
    nx, ny = city.air.shape
    return nx + 2 * BORDER, ny + 2 * BORDER + LANES - 1


def air_inside(city: City, air: Array) -> Array:
    """Return the (nx, ny) air cells without border and padding."""
    nx, ny = city.air.shape
    inside: Array = air[BORDER : BORDER + nx, BORDER : BORDER + ny]
    return inside
