"""The state of a world in one piece of memory, so that a copy is a copy of bytes, and where in it each array lies."""

from __future__ import annotations

import hashlib
from typing import Any, Final

import numpy as np

from fireworld.kernels.addresses import address_row, fields_of
from fireworld.kernels.arrays import Array, WayState, WorldState
from fireworld.simulation.state import WAYS, named_arrays
from fireworld.simulation.ways import another

ALIGNED_BYTES: Final = 64


class Packing:
    """Where the arrays of a state lie in its memory: the same for all worlds of a start."""

    def __init__(self, state: WorldState) -> None:
        self._places: list[tuple[Any, tuple[int, ...], int]] = []
        row: list[int] = []
        where: list[bool] = []
        n_bytes = 0
        names = []
        for name, array in named_arrays(state):
            names.append(name)
            self._places.append((array.dtype, array.shape, n_bytes))
            row += (n_bytes, *array.shape)
            where += (True, *(False for _ in array.shape))
            n_bytes += -(-array.nbytes // ALIGNED_BYTES) * ALIGNED_BYTES
        layout = repr([(name, *place) for name, place in zip(names, self._places, strict=True)])
        self.digest = hashlib.sha256(layout.encode()).hexdigest()
        """Of the names, types, shapes and places of the arrays."""
        self._row, self._where, self._n_bytes = np.array(row, dtype=np.int64), np.array(where), n_bytes
        self._groups = [(name, kind) for name, kind in fields_of(WorldState) if name != WAYS]
        self.memory = self.fresh()
        for view, (_, array) in zip(self.views(self.memory), named_arrays(state), strict=True):
            view[...] = array
        self._ways = state.ways

    def fresh(self) -> Array:
        """Return memory for a state, (n_bytes,) uint8, with anything in it."""
        return np.empty(self._n_bytes, dtype=np.uint8)

    def views(self, memory: Array) -> list[Array]:
        """Return the arrays in a state's memory, in the order of `named_arrays`."""
        return [np.ndarray(shape, dtype, memory, offset) for dtype, shape, offset in self._places]

    def state(self, memory: Array, ways: WayState | None = None) -> WorldState:
        """Return the state in a memory; without ways given it has room for its own."""
        views = iter(self.views(memory))
        groups: dict[str, Any] = {name: kind(*(next(views) for _ in kind._fields)) for name, kind in self._groups}
        return WorldState(**groups, ways=another(self._ways) if ways is None else ways)

    def row(self, memory: Array, ways: WayState) -> Array:
        """Return the address row of the state in a memory, (k,) int64."""
        row = self._row.copy()
        row[self._where] += memory.__array_interface__["data"][0]
        return np.concatenate((row, address_row(ways)))
