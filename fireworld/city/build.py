"""From a plan to a City: physics, air cells, radiation links, fire-site neighbours and streets."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from fireworld.city.air import cover_cells
from fireworld.city.city import (
    Array,
    City,
    Float32Array,
    Float64Array,
    Footprints,
    Int32Array,
    Int64Array,
    Links,
    Plan,
    freeze,
)
from fireworld.city.entrances import at_entrances
from fireworld.city.links import radiation_links
from fireworld.city.near import near_relation
from fireworld.city.outlines import walls_of
from fireworld.city.streets import streets_of
from fireworld.city.table_order import table_order
from fireworld.parameters import FireParameters
from fireworld.records import MATERIALS

FLOOR_HEIGHT_M: Final = 3


def build_city(plan: Plan, fire: FireParameters, *, seed: int) -> City:
    """Build a city from its plan; all its arrays are read-only. `seed`: of the rays that measure radiation.

    Raises CityError if the plan is too large for the air grid, a building covers no air cell, the walls are so long
    that they send too many rays, or so many lie on or around one another that looking at them would take minutes.
    """
    footprints = plan.footprints
    air = cover_cells(footprints, fire.air_cell_mm, where=plan.name)
    order = visiting_order(footprints.building_id)
    if plan.links is None:
        links = radiation_links(footprints, order, fire, seed=seed, where=plan.name)
    else:
        links = _rising(plan.links)
    city = City(
        name=plan.name,
        footprints=footprints,
        **physics_of(footprints, fire),
        order=order,
        air=air,
        links=links,
        near=near_relation(footprints, links, where=plan.name),
        streets=at_entrances(streets_of(plan.streets, footprints.centroid_mm), plan.streets.entrance_node),
        attribution=plan.attribution,
    )
    return freeze(city)


def with_links(city: City, *, ptr: Array, building: Array, share: Array) -> City:
    """Return the city with radiation links measured elsewhere, such as those of a trace; `near` follows them.

    As CSR: ptr (n+1,) start of each building's links, (links,) the buildings that they lead to, in any order, and
    shares.
    """
    links = _rising(Links(ptr=ptr, building=building, share=share))
    return freeze(replace(city, links=links, near=near_relation(city.footprints, links)))


def _rising(links: Links) -> Links:
    """Return links with the buildings that each leads to in rising order."""
    emitter = np.repeat(np.arange(len(links.ptr) - 1), np.diff(links.ptr))
    rising = np.lexsort((links.building, emitter))
    return Links(
        ptr=links.ptr.astype(np.int32),
        building=links.building[rising].astype(np.int32),
        share=links.share[rising].astype(np.float32),
    )


def with_order(city: City, order: Array) -> City:
    """Return the city with buildings visited in another order, (n,) indices, such as that of a trace."""
    return freeze(replace(city, order=order.astype(np.int32)))


def visiting_order(building_id: Int64Array) -> Int32Array:
    """Return the (n,) indices of the buildings in the order in which the official program visits them.

    The air exchange depends on it. The program walks a hash table of the buildings; ties stay in file order.
    """
    return table_order(building_id)


def physics_of(footprints: Footprints, fire: FireParameters) -> dict[str, Array]:
    """Work out the constants of each building, (n,) by their names in `City`; MODEL section 1.

    volume = ground area * floors * 3 m; fuel and heat capacity are proportional to it by material. All but the walls
    are single precision, as in the official program.
    """
    floors = footprints.floors.astype(np.float32)
    volume = footprints.ground_area_m2 * floors * np.float32(FLOOR_HEIGHT_M)
    return {
        "volume_m3": volume,
        "heat_capacity": volume * _by_material(footprints, fire, "heat_capacity"),
        "initial_fuel": volume * _by_material(footprints, fire, "fuel_density"),
        "ignition_point": _by_material(footprints, fire, "ignition_point"),
        "wall_area_m2": wall_area_m2(footprints),
    }


def wall_area_m2(footprints: Footprints) -> Float64Array:
    """Return the radiating wall of each building, (n,): one storey high, without the closing wall.

    Summed wall by wall in the official order of operations, so that even the last bit agrees.
    """
    walls = walls_of(footprints)
    area_mm_m = walls.length_mm * (FLOOR_HEIGHT_M * 1000)
    counted = ~walls.closing
    # bincount adds one after another, unlike numpy's sums, which split a long row differently on each processor.
    total = np.bincount(walls.building[counted], weights=area_mm_m[counted], minlength=len(footprints.building_id))
    return total.astype(np.float64) / 1e6


def _by_material(footprints: Footprints, fire: FireParameters, name: str) -> Float32Array:
    """Look up a parameter of each building by its material."""
    values = [getattr(fire, f"{name}_{material}") for material in MATERIALS]
    return np.array(values, dtype=np.float32)[footprints.material]
