"""How many shortest ways a world keeps: all of them in a small city, in a large one those that its brigades drive."""

from __future__ import annotations

from typing import Final

import numpy as np

from fireworld.kernels.arrays import WAYS, StreetArrays, WayState
from fireworld.kernels.ways import find_all_ways

N_NODES_COMPLETE: Final = 256
"""Up to so many nodes, all ways are looked for at once and shared by all worlds: half a megabyte at most."""
KEPT_BYTES: Final = 64 << 20
"""What a world keeps takes no more than this."""


def fresh_ways(streets: StreetArrays, n_brigades: int) -> WayState:
    """Return the ways that a world begins with: all of a small city, none yet of a large one.

    There is room for the two ends of the street that each brigade drives to, and of each refuge's, as far as KEPT_BYTES
    allow; what is asked for beyond that takes the place of what has not been asked for longest.
    """
    n_nodes = len(streets.node_x)
    if n_nodes <= N_NODES_COMPLETE:
        ways = empty_ways(streets, n_nodes)
        find_all_ways(streets, ways)
        return ways._replace(line=ways.line[:0])
    n_kept = min(2 * (n_brigades + len(streets.refuge)), KEPT_BYTES // (8 * n_nodes))
    return empty_ways(streets, max(n_kept, 2))


def empty_ways(streets: StreetArrays, n_kept: int) -> WayState:
    """Return room for the ways to so many nodes. It takes memory only where it is used."""
    n_nodes, n_arcs = len(streets.node_x), len(streets.arc_node)
    return WayState(
        line=np.zeros(n_nodes + 1, dtype=np.int64),
        table=np.zeros((n_kept, WAYS + n_nodes), dtype=np.int64),
        heap=np.zeros((2, n_nodes + n_arcs), dtype=np.int64),
    )


def another(ways: WayState) -> WayState:
    """Return what a copy of a world keeps: a complete set is shared, and of others each world has its own."""
    return ways if len(ways.line) == 0 else WayState(*(np.zeros(a.shape, a.dtype) for a in ways))
