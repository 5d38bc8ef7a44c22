"""Files of arrays with a header: what teams, rankings and checkpoints are kept in; .npz files that numpy opens too."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from fireworld.errors import OutputError, TrainingError, expected
from fireworld.records import Array

SUFFIX: Final = ".npz"
FIXED_TIME: Final = (1980, 1, 1, 0, 0, 0)
SIZE_MAX_BYTES: Final = 300_000_000
"""Above the tables of a thousand brigades, which are the most that a scenario can have."""


def check_free(path: Path, *, force: bool = False) -> None:
    """Refuse an output that could not be written, before the work is done that makes it.

    Raises:
        OutputError: the file exists, or there is no folder for it.
    """
    if path.exists() and not force:
        raise OutputError(
            expected(str(path), "", "a name that is free", "an existing file", "use --force to replace it")
        )
    if path.is_dir() or not path.parent.is_dir():
        got = "a folder" if path.is_dir() else "no such folder"
        raise OutputError(expected(str(path), "", "a file in an existing folder", got))


def write_arrays(path: Path, header: Mapping[str, Any], arrays: Mapping[str, Array], *, force: bool = False) -> None:
    """Write arrays and a header of plain values, beside and renamed; equal content gives equal bytes.

    Args:
        path: the file to make.
        header: its `format` says what kind of file it is.
        arrays: by name.
        force: replace an existing file.

    Raises:
        OutputError: the file exists, or cannot be written.
    """
    check_free(path, force=force)
    text = np.frombuffer(json.dumps(header, sort_keys=True).encode(), dtype=np.uint8)
    partial = path.with_name(path.name + ".partial")
    try:
        with zipfile.ZipFile(partial, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, array in {"header": text, **arrays}.items():
                with archive.open(_entry(name), "w", force_zip64=True) as file:
                    np.lib.format.write_array(file, array, allow_pickle=False)
        partial.replace(path)
    except OSError as error:
        partial.unlink(missing_ok=True)
        raise OutputError(f"{path}: cannot be written: {error.strerror or error}") from None


def read_bytes(path: Path) -> bytes:
    """Read a file that is meant to be a team file; TrainingError if it cannot be read."""
    try:
        if path.stat().st_size > SIZE_MAX_BYTES:
            raise TrainingError(
                expected(str(path), "", f"a team file of at most {SIZE_MAX_BYTES} bytes", "a larger one")
            )
        return path.read_bytes()
    except (OSError, ValueError) as error:
        raise TrainingError(
            expected(str(path), "", "a team file", getattr(error, "strerror", None) or str(error))
        ) from None


def parse_arrays(content: bytes, *, source: str) -> tuple[dict[str, Any], dict[str, Array]]:
    """Return the header and the arrays of a file.

    Args:
        content: of the file.
        source: what errors call it.

    Raises:
        TrainingError: it is not such a file.
    """
    arrays = {}
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            size = sum(item.file_size for item in archive.infolist())
            if size > SIZE_MAX_BYTES:
                raise ValueError(f"{size} bytes of arrays")  # noqa: TRY301 - the same complaint as for all damage
            for item in archive.namelist():
                with archive.open(item) as file:
                    arrays[item.removesuffix(".npy")] = np.lib.format.read_array(file, allow_pickle=False)
    except Exception as error:  # noqa: BLE001 - zipfile and numpy raise many kinds for a damaged file
        raise TrainingError(expected(source, "", "a team file (.npz)", f"{type(error).__name__}: {error}")) from None
    if "header" not in arrays:
        raise TrainingError(expected(source, "", "a team file", "no header in it"))
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
    """Return the directory entry of an array: nothing in it tells when and where the file was made."""
    entry = zipfile.ZipInfo(f"{name}.npy", FIXED_TIME)
    entry.compress_type = zipfile.ZIP_DEFLATED
    entry.create_system = 3  # Unix, wherever it is written
    return entry
