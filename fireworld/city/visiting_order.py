"""The order in which the official program visits the buildings; the air exchange depends on it."""

from __future__ import annotations

import numpy as np

from fireworld.city.city import Int32Array, Int64Array


def visiting_order(building_id: Int64Array) -> Int32Array:
    """Order the buildings as the official program does, which walks a hash table of their identifiers.

    The key is (id ^ id >> 16) modulo the size of the table: the smallest power of two from 16 on that is at most
    three quarters full. Ties stay in file order.

    Args:
        building_id: (n,) identifiers, not negative.

    Returns:
        (n,) indices of the buildings, first visited first.
    """
    capacity = 16
    while len(building_id) > 0.75 * capacity:
        capacity *= 2
    key = (building_id ^ (building_id >> 16)) & (capacity - 1)
    return np.argsort(key, kind="stable").astype(np.int32)
