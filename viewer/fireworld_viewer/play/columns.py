"""Columns of numbers for a page: rounded to the digits that it shows, as changes from row to row, in planes of bytes.

Most changes are small, and so most bytes above the lowest are zero: deflated, a building takes a byte for many steps.
`unpack.js` is the other side.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

GREATEST: Final = 1 << 44
"""Of the whole numbers that are written: their changes are exact in a browser; what is beyond is cut off there."""


class Columns:
    """Columns that a page gets: their bytes, and a table of what is where."""

    def __init__(self) -> None:
        self.table: dict[str, list[int | None]] = {}
        """By name: offset, rows, width, planes, digits, and the number that stands for none, or None."""
        self._parts: list[bytes] = []
        self._n_bytes = 0

    def add(self, name: str, numbers: NDArray[Any], *, digits: int = 0) -> None:
        """Add a column.

        Args:
            name: of it.
            numbers: (rows,) or (rows, width); what is not finite is none.
            digits: after the point, that are shown.
        """
        whole, none = _rounded(numbers, digits)
        planes = _planes(np.diff(whole, axis=0, prepend=0))
        rows, width = whole.shape
        self.table[name] = [self._n_bytes, rows, width, len(planes), digits, none]
        self._parts += planes
        self._n_bytes += sum(map(len, planes))

    @property
    def content(self) -> bytes:
        """The bytes of all columns."""
        return b"".join(self._parts)


def _rounded(numbers: NDArray[Any], digits: int) -> tuple[NDArray[np.int64], int | None]:
    """Return whole numbers of the last digit, (rows, width), and the one that stands for none, if there is one."""
    table = np.asarray(numbers, dtype=np.float64)
    table = table[:, np.newaxis] if table.ndim == 1 else table
    known = np.isfinite(table)
    limit = GREATEST / 10**digits
    scaled = np.rint(np.clip(np.where(known, table, 0.0), -limit, limit) * 10**digits).astype(np.int64)
    if known.all():
        return scaled, None
    none = int(scaled.min(initial=0)) - 1
    return np.where(known, scaled, none), none


def _planes(change: NDArray[np.int64]) -> list[bytes]:
    """Return the lowest bytes of all changes, (rows, width), column by column; then the next; as many as are needed.

    A change is written as 2 c, or as -2 c - 1 below zero, so that small ones have high bytes of zero.
    """
    folded = np.ascontiguousarray(((change << 1) ^ (change >> 63)).T)
    n_planes = max(1, -(-int(folded.max(initial=0)).bit_length() // 8))
    return [((folded >> (8 * plane)) & 0xFF).astype(np.uint8).tobytes() for plane in range(n_planes)]
