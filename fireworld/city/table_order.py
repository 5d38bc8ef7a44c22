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
    key = _keys(known, len(known) if n_entries is None else n_entries)
    return np.argsort(key, kind="stable").astype(np.int32)


def fullest_place(ids: Sequence[int], *, n_entries: int) -> int:
    """Return how many identifiers share one place of a table; arguments as for `table_order`."""
    return int(np.bincount(_keys(np.asarray(ids, dtype=np.int64), n_entries)).max())


def _keys(ids: Int64Array, n_entries: int) -> Int64Array:
    capacity = 16
    while n_entries > 0.75 * capacity:
        capacity *= 2
    return (ids ^ (ids >> 16)) & (capacity - 1)
