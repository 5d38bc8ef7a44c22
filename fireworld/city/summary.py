"""What a city file holds, in a few lines: how large the city is, where it comes from, what is odd about it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from fireworld.city.city import Plan
from fireworld.city.formats import read_plan
from fireworld.errors import CityError
from fireworld.files import read_input
from fireworld.scenario.scenario import CITY_BYTES_MAX


def load_plan(path: Path) -> Plan:
    """Read the plan of a city from its file; CityError if it cannot be read or makes no city."""
    content = read_input(path, what="a city file", n_bytes_max=CITY_BYTES_MAX, error=CityError)
    return read_plan(content, file=path, where=str(path))


def plan_summary(plan: Plan) -> dict[str, Any]:
    """Return what a plan holds as JSON can hold it; lengths in metres."""
    footprints, streets = plan.footprints, plan.streets
    span = footprints.outline_mm.max(axis=0).astype(np.int64) - footprints.outline_mm.min(axis=0)
    return {
        "name": plan.name,
        "n_buildings": len(footprints.building_id),
        "n_corners": len(footprints.outline_mm),
        "n_refuges": int(footprints.refuge.sum()),
        "n_inflammable": int(footprints.inflammable.sum()),
        "ground_area_m2": int(footprints.ground_area_m2.astype(np.float64).sum()),
        "extent_m": [int(side) / 1000.0 for side in span],
        "n_nodes": len(streets.node_mm),
        "n_streets": len(streets.street),
        "n_hydrants": len(streets.hydrant_node),
        "source": None if plan.source is None else dict(plan.source),
        "notes": list(plan.notes),
    }


def describe_plan(plan: Plan) -> Iterator[tuple[str, str]]:
    """Yield the same for people: a label, "" for more of the same, and a line."""
    found = plan_summary(plan)
    width, height = found["extent_m"]
    yield "city", f"{found['name']}, {width:.0f} m by {height:.0f} m"
    kinds = f"{found['n_inflammable']} can burn, {found['n_refuges']} are refuges"
    yield "buildings", f"{found['n_buildings']}: {kinds}; {found['n_corners']} corners, {found['ground_area_m2']} m2"
    yield "streets", f"{found['n_streets']} between {found['n_nodes']} nodes, {found['n_hydrants']} hydrants"
    for k, (key, value) in enumerate((found["source"] or {}).items()):
        said = value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
        yield "" if k else "source", f"{key}: {said}"
    for note in plan.notes:
        yield "note", note
