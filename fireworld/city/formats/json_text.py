"""City files: Plan to JSON, which `json_plan` reads back to the same plan."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from fireworld.city.city import Plan


def plan_text(plan: Plan) -> str:
    """Return a plan as the text of a city file: a line for each building, streets and hydrants on one line each.

    What the plan says of its source is written as it is; its notes are not, for a reader makes his own.
    """
    head = {"name": plan.name} | ({} if plan.source is None else {"source": plan.source})
    lines = [f"{json.dumps(key)}: {json.dumps(value)}" for key, value in head.items()]
    buildings = ",\n".join(json.dumps(building) for building in _buildings(plan))
    lines += [f'"buildings": [\n{buildings}\n]', f'"streets": {json.dumps(_streets(plan))}']
    lines.append(f'"hydrants": {json.dumps(_hydrants(plan))}')
    return "{" + ",\n".join(lines) + "}\n"


def _buildings(plan: Plan) -> Iterator[dict[str, Any]]:
    """Yield the object of each building."""
    footprints = plan.footprints
    corners, ptr = footprints.outline_mm.ravel().tolist(), (2 * footprints.outline_ptr.astype("int64")).tolist()
    columns = zip(
        footprints.building_id.tolist(),
        footprints.refuge.tolist(),
        footprints.floors.tolist(),
        footprints.material.tolist(),
        footprints.ground_area_m2.tolist(),
        footprints.centroid_mm.tolist(),
        footprints.inflammable.tolist(),
        strict=True,
    )
    for b, (building_id, refuge, floors, material, ground_area, centroid, inflammable) in enumerate(columns):
        yield {
            "id": building_id,
            "type": "refuge" if refuge else "building",
            "apexes": corners[ptr[b] : ptr[b + 1]],
            "floors": floors,
            "code": material,
            "ground_area": int(ground_area),
            "x": centroid[0],
            "y": centroid[1],
            "inflammable": bool(inflammable),
        }


def _streets(plan: Plan) -> dict[str, Any]:
    """Return the street graph."""
    return {"nodes": plan.streets.node_mm.tolist(), "edges": plan.streets.street.tolist()}


def _hydrants(plan: Plan) -> list[dict[str, int]]:
    """List the hydrants; their identifiers come after the buildings' highest."""
    next_id = int(plan.footprints.building_id.max()) + 1
    places = plan.streets.node_mm[plan.streets.hydrant_node].tolist()
    return [{"id": next_id + k, "x": x, "y": y} for k, (x, y) in enumerate(places)]
