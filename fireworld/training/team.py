"""Team file: what a team has learned, in what, and how; an .npz that numpy opens too."""

from __future__ import annotations

import hashlib
import json
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np

from fireworld.errors import OutputError, TrainingError, expected
from fireworld.kernels.arrays import Array
from fireworld.policy.kernel import KernelPolicy, from_tables

FORMAT: Final = "fireworld-team/1"
N_STATES: Final = (4320, 270)
FIXED_TIME: Final = (1980, 1, 1, 0, 0, 0)
SIZE_MAX_BYTES: Final = 1 << 30


@dataclass(frozen=True)
class Team:
    """Tables that brigades follow, one each (or one for all), and where they come from."""

    tables: Array  # (tables, states, 4) float64
    visits: Array  # (tables, states, 4) int64
    provenance: Mapping[str, Any] = field(default_factory=dict)
    """Curriculum, method, seed, repetition, version: plain values."""

    @property
    def digest(self) -> str:
        """SHA-256 of the tables."""
        content = hashlib.sha256(repr(self.tables.shape).encode())
        content.update(np.ascontiguousarray(self.tables, dtype="<f8").tobytes())
        return content.hexdigest()

    @property
    def commit(self) -> int:
        """Steps that a choice is kept for."""
        method = self.provenance.get("method", {})
        return int(method.get("commit", 1)) if isinstance(method, Mapping) else 1

    def policy(self) -> KernelPolicy:
        """Return the greedy policy of the team."""
        return from_tables(self.tables, commit=self.commit)


def save_team(team: Team, path: Path, *, force: bool = False, extra: Mapping[str, Array] | None = None) -> None:
    """Write a team file, beside and renamed; equal teams give equal bytes.

    Args:
        team: the team.
        path: the file to make.
        force: replace an existing file.
        extra: more arrays by name, as a checkpoint has.

    Raises:
        OutputError: the file exists, or cannot be written.
    """
    if path.exists() and not force:
        raise OutputError(
            expected(str(path), "", "a name that is free", "an existing file", "use --force to replace it")
        )
    header = json.dumps({"format": FORMAT, **team.provenance}, sort_keys=True)
    arrays: dict[str, Array] = {
        "header": np.frombuffer(header.encode(), dtype=np.uint8),
        "tables": np.ascontiguousarray(team.tables, dtype="<f8"),
        "visits": np.ascontiguousarray(team.visits, dtype="<i8"),
        **(extra or {}),
    }
    partial = path.with_name(path.name + ".partial")
    try:
        with zipfile.ZipFile(partial, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, array in arrays.items():
                with archive.open(zipfile.ZipInfo(f"{name}.npy", FIXED_TIME), "w", force_zip64=True) as file:
                    np.lib.format.write_array(file, array, allow_pickle=False)
        partial.replace(path)
    except OSError as error:
        partial.unlink(missing_ok=True)
        raise OutputError(f"{path}: cannot be written: {error.strerror or error}") from None


def load_team(path: Path) -> Team:
    """Read a team file.

    Raises:
        TrainingError: no such file, not a team file, of a newer format, or with tables that make no sense.
    """
    return read_team(path)[0]


def read_team(path: Path) -> tuple[Team, dict[str, Array]]:
    """Read a team file and the arrays it holds besides; errors as for `load_team`."""
    arrays = _read_arrays(path)
    header = _read_header(path, arrays.pop("header"))
    tables, visits = arrays.pop("tables"), arrays.pop("visits")
    if tables.ndim != 3 or tables.dtype != np.float64 or tables.shape[1] not in N_STATES or tables.shape[2] != 4:
        wanted = "float64 tables of shape (brigades, 4320 or 270, 4)"
        raise TrainingError(expected(str(path), "tables", wanted, f"{tables.dtype} {tables.shape}"))
    if not np.isfinite(tables).all():
        place = [int(k) for k in np.argwhere(~np.isfinite(tables))[0]]
        raise TrainingError(expected(str(path), f"tables{place}", "a finite number", float(tables[tuple(place)])))
    if visits.shape != tables.shape or visits.dtype != np.int64 or (visits < 0).any():
        wanted = f"int64 visits >= 0 of shape {tables.shape}"
        raise TrainingError(expected(str(path), "visits", wanted, f"{visits.dtype} {visits.shape}"))
    return Team(tables=tables, visits=visits, provenance=header), arrays


def _read_arrays(path: Path) -> dict[str, Array]:
    try:
        with zipfile.ZipFile(path) as archive:
            arrays = {}
            for item in archive.namelist() if _size_of(archive) <= SIZE_MAX_BYTES else ():
                with archive.open(item) as file:
                    arrays[item.removesuffix(".npy")] = np.lib.format.read_array(file, allow_pickle=False)
    except OSError as error:
        raise TrainingError(expected(str(path), "", "a team file", error.strerror or str(error))) from None
    except Exception as error:  # noqa: BLE001 - zipfile and numpy raise many kinds for a damaged file
        raise TrainingError(expected(str(path), "", "a team file (.npz)", f"{type(error).__name__}: {error}")) from None
    missing = {"header", "tables", "visits"} - arrays.keys()
    if missing:
        raise TrainingError(expected(str(path), "", "a team file", f"no {', '.join(sorted(missing))} in it"))
    return arrays


def _size_of(archive: zipfile.ZipFile) -> int:
    return sum(item.file_size for item in archive.infolist())


def _read_header(path: Path, text: Array) -> dict[str, Any]:
    try:
        header = json.loads(text.tobytes())
    except ValueError as error:
        raise TrainingError(expected(str(path), "header", "JSON", str(error))) from None
    form = header.pop("format", None) if isinstance(header, dict) else None
    if form != FORMAT:
        hint = "made by a later fireworld?" if isinstance(form, str) and form.startswith("fireworld-team/") else ""
        raise TrainingError(expected(str(path), "format", FORMAT, form, hint))
    return dict(header)
