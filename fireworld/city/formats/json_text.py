"""City files: Plan to JSON, which `json_plan` reads back to the same plan."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from fireworld.city.city import Plan
from fireworld.city.formats.json_plan import BUILDING_TYPES
from fireworld.city.formats.json_roads import links_json, roads_json


def plan_text(plan: Plan) -> str:
    """Return a plan as the text of a city file: a line for each building, streets and hydrants on one line each.

    What the plan says of its source is written as it is; its notes are not, for a reader makes his own.
    """
    head = {"name": plan.name} | ({} if plan.source is None else {"source": plan.source})
    lines = [f"{json.dumps(key)}: {json.dumps(value)}" for key, value in head.items()]
    buildings = ",\n".join(json.dumps(building) for building in _buildings(plan))
    lines.append(f'"buildings": [\n{buildings}\n]')
    if plan.roads is None:
        lines.append(f'"streets": {json.dumps(_streets(plan))}')
    else:
        items, passages = roads_json(plan.roads)
        roads = ",\n".join(map(json.dumps, items))
        lines += [f'"roads": [\n{roads}\n]', f'"passages": {json.dumps(passages)}']
    if plan.links is not None:
        lines.append(f'"links": {json.dumps(links_json(plan.links))}')
    lines.append(f'"hydrants": {json.dumps(_hydrants(plan))}')
    return "{" + ",\n".join(lines) + "}\n"


def _buildings(plan: Plan) -> Iterator[dict[str, Any]]:
    """Yield the object of each building."""
    footprints = plan.footprints
    corners, ptr = footprints.outline_mm.ravel().tolist(), (2 * footprints.outline_ptr.astype("int64")).tolist()
    sources = plan.source_id
    kinds = (footprints.refuge if plan.kind is None else plan.kind).tolist()  # 0 building, 1 refuge in either
    columns = zip(
        footprints.building_id.tolist(),
        footprints.floors.tolist(),
        footprints.material.tolist(),
        footprints.ground_area_m2.tolist(),
        footprints.centroid_mm.tolist(),
        footprints.inflammable.tolist(),
        strict=True,
    )
    for b, (building_id, floors, material, ground_area, centroid, inflammable) in enumerate(columns):
        yield {
            "id": building_id,
            "type": BUILDING_TYPES[kinds[b]],
            "apexes": corners[ptr[b] : ptr[b + 1]],
            "floors": floors,
            "code": material,
            "ground_area": int(ground_area),
            "x": centroid[0],
            "y": centroid[1],
            "inflammable": bool(inflammable),
            **({"source": sources[b]} if sources and sources[b] else {}),
        }


def _streets(plan: Plan) -> dict[str, Any]:
    """Return the street graph."""
    return {"nodes": plan.streets.node_mm.tolist(), "edges": plan.streets.street.tolist()}


def hydrants_of(plan: Plan) -> list[dict[str, int]]:
    """List the hydrants of a city with roads, by the ids of their roads."""
    if plan.roads is None:
        return []
    if len(plan.streets.entrance_node):  # else footpaths: no road leads anywhere
        roads = plan.streets.hydrant_node.tolist()
    else:
        centroids = [tuple(one) for one in plan.roads.centroid_mm.tolist()]
        roads = [centroids.index(tuple(one)) for one in plan.streets.node_mm[plan.streets.hydrant_node].tolist()]
    ids, places = plan.roads.road_id.tolist(), plan.roads.centroid_mm.tolist()
    return [{"id": ids[road], "x": places[road][0], "y": places[road][1]} for road in roads]


def _hydrants(plan: Plan) -> list[dict[str, int]]:
    """List the hydrants: by the ids of their roads, else with ids that come after the buildings' highest."""
    if plan.roads is not None:
        return hydrants_of(plan)
    next_id = int(plan.footprints.building_id.max()) + 1
    places = plan.streets.node_mm[plan.streets.hydrant_node].tolist()
    return [{"id": next_id + k, "x": x, "y": y} for k, (x, y) in enumerate(places)]
