"""What a building is to a fire: volume, heat capacity, fuel, ignition point and radiating wall."""

from __future__ import annotations

from typing import Final

import numpy as np

from fireworld.city.city import Array, Float32Array, Float64Array, Footprints
from fireworld.city.outlines import walls_of
from fireworld.parameters import FireParameters
from fireworld.records import MATERIALS

FLOOR_HEIGHT_M: Final = 3


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
