"""Files of arrays with a header: of teams and checkpoints; .npz files that numpy opens too."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any, Final

import numpy as np

from fireworld.errors import TrainingError, expected
from fireworld.files import read_input
from fireworld.npz import ArchiveError, read_npz
from fireworld.records import Array

SUFFIX: Final = ".npz"
FIXED_TIME: Final = (1980, 1, 1, 0, 0, 0)
SIZE_MAX_BYTES: Final = 300_000_000
"""Above the tables of a thousand brigades, which are the most that a scenario can have."""
HEADER_BYTES_MAX: Final = 1 << 24


def pack_arrays(place: Path | IO[bytes], header: Mapping[str, Any], arrays: Mapping[str, Array]) -> None:
    """Write arrays and a header of plain values, whose `format` says what they are; equal content gives equal bytes."""
    text = np.frombuffer(json.dumps(header, sort_keys=True).encode(), dtype=np.uint8)
    with zipfile.ZipFile(place, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, array in {"header": text, **arrays}.items():
            with archive.open(_entry(name), "w", force_zip64=True) as file:
                np.lib.format.write_array(file, array, allow_pickle=False)


def read_bytes(path: Path) -> bytes:
    """Read a file that is meant to be a team file; TrainingError if it cannot be read, or is too large."""
    return read_input(path, what="a team file", n_bytes_max=SIZE_MAX_BYTES, error=TrainingError)


def parse_arrays(content: bytes, *, source: str) -> tuple[dict[str, Any], dict[str, Array]]:
    """Return the header and the arrays of such a file; TrainingError, which names the source, if it is none."""
    try:
        arrays = read_npz(io.BytesIO(content))
    except ArchiveError as error:
        raise TrainingError(expected(source, "", "a team file (.npz)", error.detail)) from None
    if "header" not in arrays:
        raise TrainingError(expected(source, "", "a team file", "no header in it"))
    if arrays["header"].nbytes > HEADER_BYTES_MAX:
        wanted = f"at most {HEADER_BYTES_MAX} bytes"
        raise TrainingError(expected(source, "header", wanted, arrays["header"].nbytes))
    try:
        header = json.loads(arrays.pop("header").tobytes())
    except (ValueError, RecursionError) as error:
        raise TrainingError(expected(source, "header", "JSON", str(error))) from None
    return (header if isinstance(header, dict) else {}), arrays


def check_arrays(arrays: Mapping[str, Array], *names: str, source: str) -> None:
    """Raise TrainingError if a file lacks one of these arrays."""
    missing = set(names) - arrays.keys()
    if missing:
        raise TrainingError(expected(source, "", "a team file", f"no {', '.join(sorted(missing))} in it"))


def check_finite(array: Array, name: str, *, source: str) -> None:
    """Raise TrainingError if an array holds a number that is not finite."""
    if not np.isfinite(array).all():
        place = [int(k) for k in np.argwhere(~np.isfinite(array))[0]]
        raise TrainingError(expected(source, f"{name}{place}", "a finite number", float(array[tuple(place)])))


def _entry(name: str) -> zipfile.ZipInfo:
    """Return the directory entry of an array: it holds no time and place."""
    entry = zipfile.ZipInfo(f"{name}.npy", FIXED_TIME)
    entry.compress_type = zipfile.ZIP_DEFLATED
    entry.create_system = 3  # Unix, wherever it is written
    return entry
