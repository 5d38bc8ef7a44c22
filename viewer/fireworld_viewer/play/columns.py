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

BLOCK: Final = 1 << 20
"""Numbers that are worked on at a time: those of a large city would fill the memory."""


class Columns:
    """Columns that a page gets: their bytes, and a table of what is where."""

    def __init__(self) -> None:
        self.table: dict[str, list[int | None]] = {}
        """By name: offset, rows, width, planes, digits, and the number that stands for none, or None."""
        self.parts: list[bytes] = []
        """The bytes of all columns, one after another."""
        self._n_bytes = 0

    def add(self, name: str, numbers: NDArray[Any], *, digits: int = 0) -> None:
        """Add a column.

        Args:
            name: of it.
            numbers: (rows,) or (rows, width); what is not finite is none.
            digits: after the point, that are shown.
        """
        table = numbers[:, np.newaxis] if numbers.ndim == 1 else numbers
        rows, width = table.shape
        known = np.isfinite(table)
        none = None if known.all() else int(_whole(table[known], digits).min(initial=0)) - 1
        wide = max(1, BLOCK // max(1, rows))
        blocks = [
            _planes(np.where(known[:, at : at + wide], _whole(table[:, at : at + wide], digits), none or 0))
            for at in range(0, width, wide)
        ]
        n_planes = max(map(len, blocks), default=1)
        self.table[name] = [self._n_bytes, rows, width, n_planes, digits, none]
        for plane in range(n_planes):
            self.parts += [block[plane] if plane < len(block) else bytes(len(block[0])) for block in blocks]
        self._n_bytes += n_planes * rows * width


def _whole(numbers: NDArray[Any], digits: int) -> NDArray[np.int64]:
    """Return numbers as whole ones of their last digit; 0 for what is none."""
    limit = GREATEST / 10**digits
    near = np.clip(np.nan_to_num(numbers.astype(np.float64), nan=0.0), -limit, limit)
    whole: NDArray[np.int64] = np.rint(near * 10**digits).astype(np.int64)
    return whole


def _planes(whole: NDArray[np.int64]) -> list[bytes]:
    """Return the lowest bytes of all changes, (rows, width), column by column; then the next; as many as are needed.

    A change c is written as 2 c, or as -2 c - 1 below zero, so that small ones have high bytes of zero.
    """
    change = np.diff(whole, axis=0, prepend=0)
    folded = np.ascontiguousarray(((change << 1) ^ (change >> 63)).T)
    n_planes = max(1, -(-int(folded.max(initial=0)).bit_length() // 8))
    return [((folded >> (8 * plane)) & 0xFF).astype(np.uint8).tobytes() for plane in range(n_planes)]
