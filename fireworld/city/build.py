"""From a plan to a City: physics, air cells, radiation links, fire-site neighbours and streets."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fireworld.city.air import cover_cells
from fireworld.city.city import Array, City, Int32Array, Int64Array, Links, Plan, freeze
from fireworld.city.links import radiation_links
from fireworld.city.near import near_relation
from fireworld.city.physics import physics_of
from fireworld.city.streets import streets_of
from fireworld.parameters import FireParameters


def build_city(plan: Plan, fire: FireParameters, *, seed: int) -> City:
    """Build a city from its plan; all its arrays are read-only. `seed`: of the rays that measure radiation.

    Raises CityError if the plan is too large for the air grid, or a building covers no air cell.
    """
    footprints = plan.footprints
    air = cover_cells(footprints, fire.air_cell_mm, where=plan.name)
    order = visiting_order(footprints.building_id)
    links = radiation_links(footprints, order, fire, seed=seed)
    city = City(
        name=plan.name,
        footprints=footprints,
        **physics_of(footprints, fire),
        order=order,
        air=air,
        links=links,
        near=near_relation(footprints, links),
        streets=streets_of(plan.streets, footprints.centroid_mm),
    )
    return freeze(city)


def with_links(city: City, *, ptr: Array, building: Array, share: Array) -> City:
    """Return the city with radiation links measured elsewhere, such as those of a trace; `near` follows them.

    As CSR: ptr (n+1,) start of each building's links, (links,) the buildings that they lead to, in any order, and
    shares.
    """
    emitter = np.repeat(np.arange(city.n_buildings), np.diff(ptr))
    rising = np.lexsort((building, emitter))
    links = Links(
        ptr=ptr.astype(np.int32), building=building[rising].astype(np.int32), share=share[rising].astype(np.float32)
    )
    return freeze(replace(city, links=links, near=near_relation(city.footprints, links)))


def with_order(city: City, order: Array) -> City:
    """Return the city with buildings visited in another order, (n,) indices, such as that of a trace."""
    return freeze(replace(city, order=order.astype(np.int32)))


def visiting_order(building_id: Int64Array) -> Int32Array:
    """Return the (n,) indices of the buildings in the order in which the official program visits them.

    The air exchange depends on it. The program walks a hash table; the key is (id ^ id >> 16) modulo its size: the
    smallest power of two from 16 on that is at most three quarters full. Ties stay in file order.
    """
    capacity = 16
    while len(building_id) > 0.75 * capacity:
        capacity *= 2
    key = (building_id ^ (building_id >> 16)) & (capacity - 1)
    return np.argsort(key, kind="stable").astype(np.int32)
