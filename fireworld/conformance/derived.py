"""The tables that fireworld derives from a city, against those of a trace."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from fireworld.city.city import Array, City
from fireworld.city.links import wall_table
from fireworld.conformance.arrays import Arrays
from fireworld.parameters import FireParameters

BUILDING_TABLES: Final[Mapping[str, Callable[[City], Array]]] = {
    "x": lambda city: city.footprints.centroid_mm[:, 0],
    "y": lambda city: city.footprints.centroid_mm[:, 1],
    "floors": lambda city: city.footprints.floors,
    "code": lambda city: city.footprints.material,
    "ground_area": lambda city: city.footprints.ground_area_m2,
    "inflammable": lambda city: city.footprints.inflammable,
    "wall_area": lambda city: city.wall_area_m2,
    "volume": lambda city: city.volume_m3,
    "capacity": lambda city: city.heat_capacity,
    "init_fuel": lambda city: city.initial_fuel,
    "ignition_point": lambda city: city.ignition_point,
    "order": lambda city: city.order,
}
"""Tables with an entry for each building, by name, in the units and shapes that they have in a trace."""
OTHER_TABLES: Final[Mapping[str, Callable[[City], Array]]] = {
    "apex_ptr": lambda city: city.footprints.outline_ptr,
    "apexes": lambda city: city.footprints.outline_mm,
    "cell_size": lambda city: np.array([city.air.cell_mm]),
    "grid_origin": lambda city: np.array(city.air.origin_mm),
    "grid_shape": lambda city: np.array(city.air.shape),
    "cell_ptr": lambda city: city.air.ptr,
    "cell_x": lambda city: city.air.x,
    "cell_y": lambda city: city.air.y,
    "cell_pct": lambda city: city.air.percent,
}
DERIVED: Final = (*BUILDING_TABLES, *OTHER_TABLES, "ray_base", "walls")
RELATIVE_TOLERANCE: Final = 1e-9


@dataclass(frozen=True)
class TableDifference:
    """A table that fireworld derives differently from the trace."""

    table: str
    n_entries: int
    n_differing: int
    sentence: str


def differing_tables(arrays: Arrays, city: City, fire: FireParameters, *, with_rays: bool) -> list[TableDifference]:
    """Compare every table that a trace has with fireworld's own: of a city that has nothing from the trace.

    `with_rays`: the parameters hold the trace's rate of rays, so that their number can be compared.
    """
    derived = {name: table(city) for name, table in {**BUILDING_TABLES, **OTHER_TABLES}.items()}
    if with_rays:
        walls = wall_table(city.footprints, city.order, fire)
        ends = (walls.x, walls.y, walls.x + walls.dx, walls.y + walls.dy)
        derived["ray_base"] = np.bincount(walls.building, weights=walls.n_rays).astype(np.int64)
        derived["walls"] = np.column_stack([walls.building, *ends, walls.n_rays])
    found = []
    for name, ours in derived.items():
        if name in arrays:
            length = city.n_buildings if name in (*BUILDING_TABLES, "ray_base") else None
            theirs = arrays.floats(name, length, *ours.shape[1:])
            difference = _compare(name, ours, theirs, city, stored=arrays.get(name).dtype)
            if difference is not None:
                found.append(difference)
    return found


def _compare(name: str, ours: Array, theirs: Array, city: City, *, stored: np.dtype) -> TableDifference | None:
    """Compare one table: whole numbers and single precision exactly, double precision within rounding."""
    if len(ours) != len(theirs):
        sentence = f"{name}: {len(ours)} entries here, {len(theirs)} in the trace"
        return TableDifference(name, len(theirs), abs(len(ours) - len(theirs)), sentence)
    if ours.dtype == np.float64:
        rounding = float(np.finfo(stored).eps) if stored.kind == "f" else 0.0
        differs = np.abs(ours - theirs) > max(RELATIVE_TOLERANCE, rounding) * np.abs(theirs)
    else:
        with np.errstate(over="ignore"):
            differs = ours.astype(np.float64) != (theirs.astype(np.float32) if ours.dtype == np.float32 else theirs)
    differs = differs.reshape(len(ours), -1).any(axis=1)
    if not differs.any():
        return None
    k = int(np.argmax(differs))
    of_building = name in BUILDING_TABLES and name != "order"
    entry = f"building {int(city.footprints.building_id[k])}" if of_building or name == "ray_base" else f"entry {k}"
    values = f"{ours[k].tolist()} here, {theirs[k].tolist()} in the trace"
    sentence = f"{name}: {int(differs.sum())} of {len(ours)} differ, the first is {entry}: {values}"
    return TableDifference(name, len(ours), int(differs.sum()), sentence)
