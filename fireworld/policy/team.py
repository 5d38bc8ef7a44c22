"""Team file: what a team has learned, in what, and how; an .npz that numpy opens too."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np

from fireworld.errors import TrainingError, expected
from fireworld.kernels.arrays import Array
from fireworld.policy.kernel import KernelPolicy, from_tables
from fireworld.policy.npz import check_arrays, check_finite, parse_arrays, read_bytes, write_arrays
from fireworld.policy.words import N_STATES, N_STATES_ALONE

FORMAT: Final = "fireworld-team/1"
COMMIT_MAX: Final = 1_000_000


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

    @property
    def choices(self) -> str:
        """The scenario's `choices` that the brigades were trained with; empty if the file does not tell."""
        method = self.provenance.get("method", {})
        found = method.get("choices") if isinstance(method, Mapping) else None
        return str(found) if found in ("in-turn", "simultaneous") else ""

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
    arrays: dict[str, Array] = {
        "tables": np.ascontiguousarray(team.tables, dtype="<f8"),
        "visits": np.ascontiguousarray(team.visits, dtype="<i8"),
        **(extra or {}),
    }
    write_arrays(path, {"format": FORMAT, **team.provenance}, arrays, force=force)


def load_team(path: Path) -> Team:
    """Read a team file.

    Raises:
        TrainingError: no such file, not a team file, of another format, or with tables that make no sense.
    """
    return read_team(path)[0]


def read_team(path: Path) -> tuple[Team, dict[str, Array]]:
    """Read a team file and the arrays it holds besides; errors as for `load_team`."""
    return parse_team(read_bytes(path), source=str(path))


def parse_team(content: bytes, *, source: str) -> tuple[Team, dict[str, Array]]:
    """Read the content of a team file and the arrays it holds besides.

    Args:
        content: of the file.
        source: what errors call it.

    Raises:
        TrainingError: as for `load_team`.
    """
    return team_of(*parse_arrays(content, source=source), source=source)


def team_of(header: dict[str, Any], arrays: dict[str, Array], *, source: str) -> tuple[Team, dict[str, Array]]:
    """Make a team of the header and the arrays of its file, which this takes apart; as `parse_team`."""
    _check_header(source, header)
    check_arrays(arrays, "tables", "visits", source=source)
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
    check_finite(tables, "tables", source=source)
    if visits.shape != tables.shape or visits.dtype != np.int64 or (visits < 0).any():
        wanted = f"int64 visits >= 0 of shape {tables.shape}"
        raise TrainingError(expected(source, "visits", wanted, f"{visits.dtype} {visits.shape}"))
    team = Team(tables=np.ascontiguousarray(tables), visits=np.ascontiguousarray(visits), provenance=header)
    return team, arrays


def _check_header(source: str, header: dict[str, Any]) -> None:
    form = header.pop("format", None)
    if form != FORMAT:
        hint = "made by a later fireworld?" if isinstance(form, str) and form.startswith("fireworld-team/") else ""
        raise TrainingError(expected(source, "format", FORMAT, form, hint))
    method = header.get("method", {})
    commit = method.get("commit", 1) if isinstance(method, dict) else None
    if type(commit) is not int or not 1 <= commit <= COMMIT_MAX:
        raise TrainingError(expected(source, "method.commit", f"a whole number from 1 to {COMMIT_MAX}", commit))
