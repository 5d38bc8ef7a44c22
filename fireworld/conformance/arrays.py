"""Reading the arrays of a trace file (.npz) with errors that name file, array and place."""

from __future__ import annotations

import io
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Never

import numpy as np

from fireworld.city.city import Array, Float64Array, Int64Array
from fireworld.errors import TraceError, expected
from fireworld.files import read_input
from fireworld.npz import ArchiveError, read_npz

N_BYTES_MAX: Final = 1 << 30


@dataclass(frozen=True)
class Arrays:
    """The arrays of one file. Shapes are asked for as lengths, None where any length will do."""

    where: str
    stored: Mapping[str, Array]

    def __contains__(self, key: str) -> bool:
        return key in self.stored

    def refuse(self, key: str, wanted: str, got: object) -> Never:
        """Raise for one array."""
        raise TraceError(expected(self.where, key, wanted, got))

    def refuse_first(self, key: str, wrong: Array, wanted: str, values: Array) -> None:
        """Raise for the first element where `wrong` is true, if there is one."""
        if wrong.any():
            place = np.unravel_index(int(np.argmax(wrong)), wrong.shape)
            index = "".join(f"[{int(i)}]" for i in place)
            self.refuse(key + index, wanted, values[place].item())

    def get(self, key: str) -> Array:
        """Return an array of numbers as it is stored."""
        found = self._there(key)
        if found.dtype.kind not in "biuf":
            self.refuse(key, "an array of numbers", f"one of {found.dtype}")
        return found

    def floats(self, key: str, *shape: int | None) -> Float64Array:
        """Read an array of finite numbers, stored in any precision."""
        found = self.get(key)
        self._check_shape(key, found, shape)
        with np.errstate(over="ignore"):
            numbers = found.astype(np.float64)
        self.refuse_first(key, ~np.isfinite(numbers), "a finite number", numbers)
        return numbers

    def integers(self, key: str, *shape: int | None, low: int, high: int) -> Int64Array:
        """Read an array of whole numbers from low to high, stored as any type of number."""
        found = self.get(key)
        self._check_shape(key, found, shape)
        fraction = found.dtype.kind == "f"
        if fraction:
            with np.errstate(over="ignore"):
                found = found.astype(np.float64)
        outside = ~((found >= low) & (found <= high))  # true for NaN too
        if fraction:
            outside |= np.floor(found) != found
        self.refuse_first(key, outside, f"a whole number from {low} to {high}", found)
        return found.astype(np.int64)

    def text(self, key: str) -> str:
        """Read a single text."""
        found = self._there(key)
        if found.size != 1 or found.dtype.kind not in "US":
            self.refuse(key, "a single text", f"{found.size} of {found.dtype}")
        single = found.reshape(-1)[0]
        return single.decode("utf-8", errors="replace") if isinstance(single, bytes) else str(single)

    def _there(self, key: str) -> Array:
        """Return what a key holds."""
        if key not in self.stored:
            self.refuse(key, "this array to be there", "a file without it")
        found: Array = self.stored[key]
        return found

    def _check_shape(self, key: str, found: Array, shape: tuple[int | None, ...]) -> None:
        """Raise for an array of another shape."""
        fits = len(found.shape) == len(shape) and all(
            wanted is None or length == wanted for length, wanted in zip(found.shape, shape, strict=True)
        )
        if not fits:
            lengths = ", ".join("any" if length is None else str(length) for length in shape)
            self.refuse(key, f"shape ({lengths})", f"shape ({', '.join(map(str, found.shape))})")


def read_arrays(path: Path, keys: Iterable[str]) -> Arrays:
    """Read those of the named arrays that a file has; others stay unread. Nothing in a file is ever executed."""
    content = read_input(path, what="a file that can be read", n_bytes_max=N_BYTES_MAX, error=TraceError)
    try:
        return Arrays(str(path), read_npz(io.BytesIO(content), set(keys)))
    except ArchiveError as error:
        raise TraceError(expected(str(path), error.key, error.wanted, error.got)) from None
