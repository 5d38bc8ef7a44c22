"""What a building is to a fire: volume, heat capacity, fuel, ignition point and radiating wall."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from fireworld.city.city import Float32Array, Float64Array, Footprints
from fireworld.city.walls import walls_of
from fireworld.parameters import FireParameters

FLOOR_HEIGHT_M: Final = 3


@dataclass(frozen=True)
class Physics:
    """The constants of each building, (n,) each; single precision as in the official program."""

    volume_m3: Float32Array
    heat_capacity: Float32Array
    initial_fuel: Float32Array
    ignition_point: Float32Array
    wall_area_m2: Float64Array


def physics_of(footprints: Footprints, fire: FireParameters) -> Physics:
    """Work out the constants of each building; MODEL section 1.

    volume = ground area * floors * 3 m; fuel and heat capacity are proportional to it by material.
    """
    floors = footprints.floors.astype(np.float32)
    volume = footprints.ground_area_m2 * floors * np.float32(FLOOR_HEIGHT_M)
    density = _by_material(footprints, fire.fuel_density_wood, fire.fuel_density_steel, fire.fuel_density_concrete)
    capacity = _by_material(footprints, fire.heat_capacity_wood, fire.heat_capacity_steel, fire.heat_capacity_concrete)
    ignition = _by_material(
        footprints, fire.ignition_point_wood, fire.ignition_point_steel, fire.ignition_point_concrete
    )
    return Physics(
        volume_m3=volume,
        heat_capacity=volume * capacity,
        initial_fuel=volume * density,
        ignition_point=ignition,
        wall_area_m2=wall_area_m2(footprints),
    )


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


def _by_material(footprints: Footprints, wood: float, steel: float, concrete: float) -> Float32Array:
    """Look up one figure per building by its material."""
    return np.array([wood, steel, concrete], dtype=np.float32)[footprints.material]
