"""Small plans for the tests."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fireworld.city.city import Footprints, Plan, StreetMap
from fireworld.city.outlines import Building, Corner, assemble, centroid_mm, doubled_area_mm2


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
