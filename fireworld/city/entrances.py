"""Buildings reached at their entrances, and places on streets."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fireworld.city.city import Int32Array, Int64Array, Streets


def place_of_node(streets: Streets, node: Int64Array | Int32Array) -> tuple[Int64Array, Int64Array]:
    """Return the street and the way along it, in mm, at which nodes are: (k,) each, the lowest street of each node."""
    n_streets = len(streets.street)
    lowest = np.full(len(streets.node_mm), n_streets, dtype=np.int64)
    for end in (0, 1):
        np.minimum.at(lowest, streets.street[:, end], np.arange(n_streets))
    street = lowest[node]
    offset = np.where(streets.street[street, 0] == node, 0, streets.street_length_mm[street])
    return street, offset


def at_entrances(streets: Streets, entrance_node: Int32Array) -> Streets:
    """Return streets on which buildings with an entrance are reached there; (n,) nodes, -1 none; empty: nobody."""
    with_entrance = np.flatnonzero(entrance_node >= 0)
    if len(with_entrance) == 0:
        return streets
    node = entrance_node[with_entrance]
    access_street, access_offset = streets.access_street.copy(), streets.access_offset_mm.copy()
    access_mm = streets.access_mm.copy()
    street, offset = place_of_node(streets, node)
    access_street[with_entrance], access_offset[with_entrance] = street, offset
    access_mm[with_entrance] = streets.node_mm[node]
    return replace(streets, access_street=access_street, access_offset_mm=access_offset, access_mm=access_mm)
