"""From a plan to a City: physics, air cells, radiation links, fire-site neighbours and streets."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fireworld.city.air import cover_cells
from fireworld.city.city import Array, City, Links, Plan
from fireworld.city.freeze import freeze
from fireworld.city.links import radiation_links
from fireworld.city.near import near_relation
from fireworld.city.physics import physics_of
from fireworld.city.streets import streets_of
from fireworld.city.visiting_order import visiting_order
from fireworld.parameters import FireParameters


def build_city(plan: Plan, fire: FireParameters, *, seed: int) -> City:
    """Build a city from its plan; all its arrays are read-only.

    Args:
        plan: made by a generator or loaded from a file.
        fire: the physical parameters.
        seed: of the rays that measure the radiation between buildings.

    Raises:
        CityError: the plan is too large for the air grid, or a building covers no air cell.
    """
    footprints = plan.footprints
    air = cover_cells(footprints, fire.air_cell_mm, where=plan.name)
    physics = physics_of(footprints, fire)
    order = visiting_order(footprints.building_id)
    links = radiation_links(footprints, order, fire, seed=seed)
    city = City(
        name=plan.name,
        footprints=footprints,
        volume_m3=physics.volume_m3,
        heat_capacity=physics.heat_capacity,
        initial_fuel=physics.initial_fuel,
        ignition_point=physics.ignition_point,
        wall_area_m2=physics.wall_area_m2,
        order=order,
        air=air,
        links=links,
        near=near_relation(footprints, links),
        streets=streets_of(plan.streets, footprints.centroid_mm),
    )
    return freeze(city)


def with_links(city: City, *, ptr: Array, building: Array, share: Array) -> City:
    """Return the city with radiation links measured elsewhere, such as those of a trace; `near` follows them.

    Args:
        city: the city.
        ptr: (n+1,) start of each building's links.
        building: (links,) index of the building that each link leads to, in any order.
        share: (links,) share of the rays.
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
