"""The order of a hash table of identifiers, in which the official program walks through its buildings."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fireworld.city.city import Int32Array, Int64Array


def table_order(ids: Int64Array | Sequence[int], *, n_entries: int | None = None) -> Int32Array:
    """Return the (n,) indices of identifiers, given in the order in which they were put in, in the table's order.

    The key is (id ^ id >> 16) modulo the size of the table: the smallest power of two from 16 on that its `n_entries`
    (by default these) fill to at most three quarters. Ties stay in the order given.
    """
    known = np.asarray(ids, dtype=np.int64)
    capacity = 16
    while (len(known) if n_entries is None else n_entries) > 0.75 * capacity:
        capacity *= 2
    key = (known ^ (known >> 16)) & (capacity - 1)
    return np.argsort(key, kind="stable").astype(np.int32)
