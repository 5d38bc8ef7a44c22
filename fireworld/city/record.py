"""The city as it is recorded: once a run, in metres."""

from __future__ import annotations

from typing import Any

import numpy as np

from fireworld.city.city import Array, City
from fireworld.parameters import BrigadeParameters
from fireworld.records import CityRecord


def city_record(
    city: City,
    *,
    civilian_mm: Array,
    civilian_building: Array,
    civilian_hp: Array,
    n_brigades: int,
    brigades: BrigadeParameters,
) -> CityRecord:
    """Put a city and who is in it into the record that opens a recording.

    Args:
        city: the city.
        civilian_mm: (n_civilians, 2) where the civilians are.
        civilian_building: (n_civilians,) building each civilian is in, -1 outdoors.
        civilian_hp: (n_civilians,) health points at the start.
        n_brigades: brigades of the team; all have the same vehicle.
        brigades: the vehicle.
    """
    footprints, streets, air = city.footprints, city.streets, city.air
    middle_x, middle_y = city.middle_mm
    return CityRecord(
        name=city.name,
        building_id=footprints.building_id.astype(np.int32),
        outline_ptr=footprints.outline_ptr,
        **_in_metres("outline", footprints.outline_mm),
        **_in_metres("center", footprints.centroid_mm),
        floors=footprints.floors,
        material=footprints.material,
        inflammable=footprints.inflammable,
        ground_area_m2=footprints.ground_area_m2,
        volume_m3=city.volume_m3,
        initial_fuel=city.initial_fuel,
        heat_capacity=city.heat_capacity,
        ignition_point=city.ignition_point,
        wall_area_m2=city.wall_area_m2,
        link_ptr=city.links.ptr,
        link_building=city.links.building,
        link_share=city.links.share,
        **_in_metres("node", streets.node_mm),
        street_from=np.ascontiguousarray(streets.street[:, 0]),
        street_to=np.ascontiguousarray(streets.street[:, 1]),
        refuge_building=np.flatnonzero(footprints.refuge).astype(np.int32),
        **_in_metres("hydrant", streets.node_mm[streets.hydrant_node]),
        **_in_metres("civilian", np.asarray(civilian_mm).reshape(-1, 2)),
        civilian_building=np.asarray(civilian_building, dtype=np.int32),
        civilian_hp=np.asarray(civilian_hp, dtype=np.int32),
        brigade_tank_litres=np.full(n_brigades, brigades.tank_litres, dtype=np.int32),
        brigade_power_litres=np.full(n_brigades, brigades.power_litres, dtype=np.int32),
        brigade_range_m=np.full(n_brigades, brigades.range_m, dtype=np.float64),
        air_origin_x_m=air.origin_mm[0] / 1000.0,
        air_origin_y_m=air.origin_mm[1] / 1000.0,
        air_cell_m=air.cell_mm / 1000.0,
        air_nx=air.shape[0],
        air_ny=air.shape[1],
        middle_x_m=middle_x / 1000.0,
        middle_y_m=middle_y / 1000.0,
    )


def _in_metres(name: str, points_mm: Array) -> dict[str, Any]:
    """Return the fields with the coordinates of points, (n, 2) whole millimetres."""
    return {f"{name}_{axis}_m": points_mm[:, k] / 1000.0 for k, axis in enumerate("xy")}
