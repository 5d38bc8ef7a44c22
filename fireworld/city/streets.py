"""Streets ready for driving: their lengths, and where each building is reached."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from fireworld.city.city import Int32Array, Int64Array, StreetMap, Streets
from fireworld.errors import CityError, expected

NODES_MAX: Final = 1_000_000
"""As many nodes as cities of half a million buildings have, and more."""


def streets_of(street_map: StreetMap, centroid_mm: Int32Array) -> Streets:
    """Work out the lengths of streets and the access points of buildings, by their (n, 2) centroids.

    It has at least one street and need not be connected.
    """
    node = street_map.node_mm.astype(np.int64)
    street = street_map.street.astype(np.int64)
    span = node[street[:, 1]] - node[street[:, 0]]
    exact = np.sqrt((span * span).sum(axis=1).astype(np.float64))
    length = np.maximum(1, np.floor(exact + 0.5).astype(np.int64))
    access_street, access_offset, access_mm = _access_points(node, street, length, centroid_mm.astype(np.int64))
    return Streets(
        node_mm=street_map.node_mm,
        street=street_map.street,
        street_length_mm=length,
        hydrant_node=street_map.hydrant_node,
        access_street=access_street.astype(np.int32),
        access_offset_mm=access_offset,
        access_mm=access_mm.astype(np.int32),
    )


def check_nodes(n_nodes: int, *, where: str = "city") -> None:
    """Raise CityError for a map of more nodes than a city can have."""
    if n_nodes > NODES_MAX:
        raise CityError(expected(where, "streets", f"at most {NODES_MAX} nodes", n_nodes))


def _access_points(
    node: Int64Array, street: Int64Array, length: Int64Array, centroid: Int64Array
) -> tuple[Int64Array, Int64Array, Int64Array]:
    """Find the point of any street nearest to each centroid; ties go to the lowest street.

    Returns the street (n,), the way from its first node (n,) mm, and the point (n, 2) mm.
    """
    import shapely

    lines: Any = shapely.linestrings(node[street])
    points = shapely.points(centroid)
    tree = shapely.STRtree(lines)
    (building, _), distance = tree.query_nearest(points, return_distance=True)
    reach = np.zeros(len(centroid))
    reach[building] = distance
    # Points are whole millimetres, so the nearest one of them may be on a street up to 2 mm farther away.
    building, candidate = tree.query(points, predicate="dwithin", distance=reach + 2.0)

    start, span = node[street[candidate, 0]], node[street[candidate, 1]] - node[street[candidate, 0]]
    part = ((centroid[building] - start) * span).sum(axis=1) / np.maximum((span * span).sum(axis=1), 1)
    part = np.clip(part, 0.0, 1.0)
    point = start + np.floor(span * part[:, None] + 0.5).astype(np.int64)
    offset = np.floor(length[candidate] * part + 0.5).astype(np.int64)
    away = point - centroid[building]
    best = np.lexsort((candidate, (away * away).sum(axis=1), building))
    best = best[np.unique(building[best], return_index=True)[1]]
    return candidate[best], offset[best], point[best]
