"""The tables that fireworld derives from a city, against those of a trace."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from fireworld.city.city import Array, City
from fireworld.city.links import wall_table
from fireworld.conformance.arrays import Arrays
from fireworld.conformance.measure import RELATIVE_TOLERANCE
from fireworld.parameters import FireParameters

BUILDING_TABLES: Final = (
    "x",
    "y",
    "floors",
    "code",
    "ground_area",
    "inflammable",
    "wall_area",
    "volume",
    "capacity",
    "init_fuel",
    "ignition_point",
    "order",
)
"""Tables with an entry for each building."""
OTHER_TABLES: Final = (
    "apex_ptr",
    "apexes",
    "cell_size",
    "grid_origin",
    "grid_shape",
    "cell_ptr",
    "cell_x",
    "cell_y",
    "cell_pct",
)
RAY_TABLES: Final = ("ray_base", "walls")
DERIVED: Final = (*BUILDING_TABLES, *OTHER_TABLES, *RAY_TABLES)


@dataclass(frozen=True)
class TableDifference:
    """A table that fireworld derives otherwise than the trace."""

    table: str
    n_entries: int
    n_differing: int
    sentence: str


def derived_tables(city: City, fire: FireParameters) -> dict[str, Array]:
    """Collect the tables of a city under the names, and in the units and shapes, that they have in a trace."""
    footprints, air = city.footprints, city.air
    walls = wall_table(footprints, city.order, fire)
    start = np.column_stack([walls.x, walls.y])
    end = start + np.column_stack([walls.dx, walls.dy])
    return {
        "x": footprints.centroid_mm[:, 0],
        "y": footprints.centroid_mm[:, 1],
        "floors": footprints.floors,
        "code": footprints.material,
        "ground_area": footprints.ground_area_m2,
        "inflammable": footprints.inflammable,
        "wall_area": city.wall_area_m2,
        "volume": city.volume_m3,
        "capacity": city.heat_capacity,
        "init_fuel": city.initial_fuel,
        "ignition_point": city.ignition_point,
        "order": city.order,
        "apex_ptr": footprints.outline_ptr,
        "apexes": footprints.outline_mm,
        "cell_size": np.array([air.cell_mm]),
        "grid_origin": np.array(air.origin_mm),
        "grid_shape": np.array(air.shape),
        "cell_ptr": air.ptr,
        "cell_x": air.x,
        "cell_y": air.y,
        "cell_pct": air.percent,
        "ray_base": np.bincount(walls.building, weights=walls.n_rays).astype(np.int64),
        "walls": np.column_stack([walls.building, start, end, walls.n_rays]),
    }


def differing_tables(arrays: Arrays, city: City, fire: FireParameters, *, with_rays: bool) -> list[TableDifference]:
    """Compare every table that a trace has with fireworld's own.

    Args:
        arrays: of the trace.
        city: as fireworld builds it, nothing of it taken from the trace.
        fire: the trace's parameters.
        with_rays: whether these hold the trace's rate of rays, so that their number can be compared.

    Raises:
        TraceError: a table has a wrong shape or something that is no number.
    """
    found = []
    for name, ours in derived_tables(city, fire).items():
        if name in arrays and (with_rays or name not in RAY_TABLES):
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
