"""Small plans for the tests, and the walls that rays meet."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from fireworld.city.city import Array, Footprints, Int32Array, Int64Array, Plan, StreetMap
from fireworld.city.formats.json_text import plan_text
from fireworld.city.links import wall_grid, wall_table
from fireworld.city.outlines import Building, Corner, assemble, centroid_mm, doubled_area_mm2
from fireworld.kernels.rays import first_hit
from fireworld.parameters import FireParameters


def rectangle(x: int, y: int, width: int, depth: int) -> list[Corner]:
    return [(x, y), (x + width, y), (x + width, y + depth), (x, y + depth)]


def footprints(*outlines: Sequence[Corner], ids: Sequence[int] | None = None) -> Footprints:
    return assemble(
        [
            Building(
                building_id=index if ids is None else ids[index],
                corners_mm=outline,
                centroid_mm=centroid_mm(outline),
                floors=1,
                material=0,
                ground_area_m2=abs(doubled_area_mm2(outline)) // 2_000_000,
                inflammable=True,
                refuge=False,
            )
            for index, outline in enumerate(outlines)
        ]
    )


def street_map(nodes: Sequence[Corner], streets: Sequence[tuple[int, int]]) -> StreetMap:
    return StreetMap(
        node_mm=np.array(nodes, dtype=np.int32),
        street=np.array(streets, dtype=np.int32).reshape(-1, 2),
        hydrant_node=np.empty(0, dtype=np.int32),
    )


def plan(*outlines: Sequence[Corner]) -> Plan:
    return Plan("small", footprints(*outlines), street_map([(0, 0), (1000, 0)], [(0, 1)]))


def dump_plan(plan: Plan) -> dict[str, Any]:
    """Turn a plan into a city document: `parse_plan` of its JSON gives the same plan."""
    document: dict[str, Any] = json.loads(plan_text(plan))
    return document


def walls_hit(
    footprints: Footprints,
    order: Int32Array,
    *,
    source: Array,
    start_mm: Array,
    end_mm: Array,
) -> Int64Array:
    """Find the first wall that each given ray meets, -1 where there is none.

    Args:
        footprints: the buildings.
        order: (n,) in which the official program visits the buildings.
        source: (r,) wall that each ray leaves from, an index into `walls_of(footprints)`.
        start_mm: (r, 2) start of each ray.
        end_mm: (r, 2) end of each ray.
    """
    walls = wall_table(footprints, order, FireParameters())
    grid = wall_grid(walls)
    starts, ways = start_mm.astype(np.int64), (end_mm - start_mm).astype(np.int64)
    rays = zip(source.tolist(), starts.tolist(), ways.tolist(), strict=True)
    return np.array([first_hit(walls, grid, wall, *start, *way)[0] for wall, start, way in rays], dtype=np.int64)
