"""Team file: what a team has learned, in what, and how; an .npz that numpy opens too."""

from __future__ import annotations

import hashlib
import io
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
from fireworld.policy.words import N_STATES, N_STATES_ALONE

FORMAT: Final = "fireworld-team/1"
SUFFIX: Final = ".npz"
COMMIT_MAX: Final = 1_000_000
FIXED_TIME: Final = (1980, 1, 1, 0, 0, 0)
SIZE_MAX_BYTES: Final = 1 << 30


@dataclass(frozen=True)
class Team:
    """Tables that brigades follow, one each (or one for all), and where they come from."""

    tables: Array  # (tables, states, 4) float64
    visits: Array  # (tables, states, 4) int64
    provenance: Mapping[str, Any] = field(default_factory=dict)
    """Curriculum, method, seed, version: plain values."""

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
    check_free(path, force=force)
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
                with archive.open(_entry(name), "w", force_zip64=True) as file:
                    np.lib.format.write_array(file, array, allow_pickle=False)
        partial.replace(path)
    except OSError as error:
        partial.unlink(missing_ok=True)
        raise OutputError(f"{path}: cannot be written: {error.strerror or error}") from None


def load_team(path: Path) -> Team:
    """Read a team file.

    Raises:
        TrainingError: no such file, not a team file, of another format, or with tables that make no sense.
    """
    return read_team(path)[0]


def read_team(path: Path) -> tuple[Team, dict[str, Array]]:
    """Read a team file and the arrays it holds besides; errors as for `load_team`."""
    return parse_team(read_bytes(path), source=str(path))


def read_bytes(path: Path) -> bytes:
    """Read a file that is meant to be a team file; errors as for `load_team`."""
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


def parse_team(content: bytes, *, source: str) -> tuple[Team, dict[str, Array]]:
    """Read the content of a team file and the arrays it holds besides.

    Args:
        content: of the file.
        source: what errors call it.

    Raises:
        TrainingError: as for `load_team`.
    """
    arrays = _read_arrays(content, source)
    header = _read_header(source, arrays.pop("header"))
    tables, visits = arrays.pop("tables"), arrays.pop("visits")
    fits = (
        tables.ndim == 3
        and tables.shape[0] >= 1
        and tables.shape[1] in (N_STATES, N_STATES_ALONE)
        and tables.shape[2] == 4
    )
    if not fits or tables.dtype != np.float64:
        wanted = "float64 tables of shape (brigades, 4320 or 270, 4)"
        raise TrainingError(expected(source, "tables", wanted, f"{tables.dtype} {tables.shape}"))
    if not np.isfinite(tables).all():
        place = [int(k) for k in np.argwhere(~np.isfinite(tables))[0]]
        raise TrainingError(expected(source, f"tables{place}", "a finite number", float(tables[tuple(place)])))
    if visits.shape != tables.shape or visits.dtype != np.int64 or (visits < 0).any():
        wanted = f"int64 visits >= 0 of shape {tables.shape}"
        raise TrainingError(expected(source, "visits", wanted, f"{visits.dtype} {visits.shape}"))
    team = Team(tables=np.ascontiguousarray(tables), visits=np.ascontiguousarray(visits), provenance=header)
    return team, arrays


def _entry(name: str) -> zipfile.ZipInfo:
    """Return the directory entry of an array: nothing in it tells when and where the file was made."""
    entry = zipfile.ZipInfo(f"{name}.npy", FIXED_TIME)
    entry.compress_type = zipfile.ZIP_DEFLATED
    entry.create_system = 3  # Unix, wherever it is written
    return entry


def _read_arrays(content: bytes, source: str) -> dict[str, Array]:
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
    missing = {"header", "tables", "visits"} - arrays.keys()
    if missing:
        raise TrainingError(expected(source, "", "a team file", f"no {', '.join(sorted(missing))} in it"))
    return arrays


def _read_header(source: str, text: Array) -> dict[str, Any]:
    try:
        header = json.loads(text.tobytes())
    except ValueError as error:
        raise TrainingError(expected(source, "header", "JSON", str(error))) from None
    form = header.pop("format", None) if isinstance(header, dict) else None
    if form != FORMAT:
        hint = "made by a later fireworld?" if isinstance(form, str) and form.startswith("fireworld-team/") else ""
        raise TrainingError(expected(source, "format", FORMAT, form, hint))
    method = header.get("method", {})
    commit = method.get("commit", 1) if isinstance(method, dict) else None
    if type(commit) is not int or not 1 <= commit <= COMMIT_MAX:
        raise TrainingError(expected(source, "method.commit", f"a whole number from 1 to {COMMIT_MAX}", commit))
    return dict(header)
