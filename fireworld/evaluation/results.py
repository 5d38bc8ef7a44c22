"""A file of results: how every run ended that was ever made for a comparison, so that none is made twice.

One row a run, as Parquet. A run is known by the digest of its scenario, the digest of its policy, its seed and the
version of the simulator; what has the same four has the same outcome.
"""

from __future__ import annotations

import hashlib
import io
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

from fireworld import __version__
from fireworld.errors import OutputError, expected
from fireworld.evaluation.runs import Row
from fireworld.policy.names import NamedPolicy

FORMAT: Final = "fireworld-results/1"
COLUMNS: Final = {
    "scenario": "string",
    "policy": "string",
    "scenario_digest": "string",
    "policy_digest": "string",
    "seed": "int64",
    "version": "string",
    "score": "double",
    "score_max": "double",
    "burnt_out": "int64",
    "steps": "int64",
    "completed": "bool",
    "civilians_alive": "int64",
    "total_reward": "double",
    "water_litres": "double",
}
"""The file's columns and their types; after the six that say which run it is, QUANTITIES in their order."""
_SIMULATOR: Final = (
    "city", "draws.py", "kernels", "parameters.py", "planning", "policy", "scenario", "simulation"
)  # fmt: skip


@dataclass(frozen=True, order=True)
class RunKey:
    """What identifies a run."""

    scenario_digest: str
    policy_digest: str
    seed: int
    version: str


@dataclass(frozen=True)
class Result:
    """How a run ended, and the names it was asked for by."""

    scenario: str
    policy: str
    row: Row


@dataclass
class Archive:
    """Results by run: those of a file, if there is one, and those added since."""

    path: Path | None
    """None: kept in memory only."""
    results: dict[RunKey, Result] = field(default_factory=dict)
    n_unsaved: int = 0

    def add(self, key: RunKey, result: Result) -> None:
        """Note a run."""
        self.results[key] = result
        self.n_unsaved += 1

    def to_bytes(self) -> bytes:
        """Return the content of the file as it is to be: what it holds by now, and what was added.

        Equal results give equal bytes, whatever the order they came in.

        Raises:
            OutputError: what is there by now is no results file.
        """
        assert self.path is not None, "there is no file to write"  # noqa: S101 - a mistake of ours, not of a user
        if self.path.exists():
            self.results = read_results(self.path) | self.results
        return _write(self.results)


def open_archive(path: Path | None) -> Archive:
    """Open a file of results, or begin one.

    Args:
        path: the file; None keeps results in memory.

    Raises:
        OutputError: pyarrow is not installed, or the file cannot be read, is damaged or none of ours; it is left as
            it is.
    """
    if path is None:
        return Archive(None)
    try:
        import pyarrow.parquet  # noqa: F401 - is it there?
    except ImportError:
        raise OutputError("--results: pyarrow is not installed; try pip install 'fireworld[archive]'") from None
    if not path.exists():
        if not path.parent.is_dir():
            raise OutputError(f"{path}: cannot be written: no folder {path.parent}")
        return Archive(path)
    return Archive(path, read_results(path))


def policy_identity(named: NamedPolicy) -> str:
    """Return what tells a policy from every other: the digest of what it does, if it says so itself.

    Of a policy of the user's own, only the file is known, which may hold several: so its class goes with it.
    """
    own = getattr(named.policy, "digest", None)
    return own if isinstance(own, str) else f"{named.digest}:{type(named.policy).__qualname__}"


@lru_cache(maxsize=1)
def simulator_version() -> str:
    """Return the version, and what the sources of all that computes a run come to: "0.1.0+4a6f0c1d2e3b"."""
    folder = Path(__file__).parents[1]
    content = hashlib.sha256()
    for name in _SIMULATOR:
        place = folder / name
        for path in sorted(place.rglob("*")) if place.is_dir() else [place]:
            if path.suffix in {".py", ".npy"}:
                content.update(path.relative_to(folder).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return f"{__version__}+{content.hexdigest()[:12]}"


def read_results(path: Path) -> dict[RunKey, Result]:
    """Read a file of results.

    Raises:
        OutputError: it cannot be read, is damaged or none of ours.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        content = path.read_bytes()
    except OSError as error:
        raise _refusal(path, error.strerror or str(error)) from None
    try:
        with pq.ParquetFile(pa.BufferReader(content), page_checksum_verification=True) as file:
            table = file.read()
    except Exception as error:  # noqa: BLE001 - pyarrow raises many kinds for a damaged file
        raise _refusal(path, " ".join(str(error).split())) from None
    if not table.schema.equals(_schema(), check_metadata=True):
        raise _refusal(path, "a table with other columns, or of a later fireworld")
    return _results(path, zip(*(table.column(name).to_pylist() for name in COLUMNS), strict=True))


def _results(path: Path, rows: Iterable[tuple[Any, ...]]) -> dict[RunKey, Result]:
    results: dict[RunKey, Result] = {}
    for row in rows:
        scenario, policy, scenario_digest, policy_digest, seed, version, *quantities = row
        key = RunKey(scenario_digest, policy_digest, seed, version)
        known = results.setdefault(key, Result(scenario, policy, tuple(quantities)))
        if known.row != tuple(quantities):
            raise _refusal(path, f"two outcomes of {scenario}, {policy}, seed {seed}")
    return results


def _write(results: dict[RunKey, Result]) -> bytes:
    import pyarrow as pa
    import pyarrow.parquet as pq

    rows = [
        (result.scenario, result.policy, key.scenario_digest, key.policy_digest, key.seed, key.version, *result.row)
        for key, result in sorted(results.items(), key=lambda item: item[0])
    ]
    table = pa.Table.from_pylist([dict(zip(COLUMNS, row, strict=True)) for row in rows], schema=_schema())
    data = io.BytesIO()
    pq.write_table(table, data, compression="zstd", write_page_checksum=True)
    return data.getvalue()


def _schema() -> Any:
    """Return the columns: none may be empty, and the file says what it is."""
    import pyarrow as pa

    types = {"string": pa.string(), "int64": pa.int64(), "double": pa.float64(), "bool": pa.bool_()}
    fields = [pa.field(name, types[kind], nullable=False) for name, kind in COLUMNS.items()]
    return pa.schema(fields, metadata={"format": FORMAT})


def _refusal(path: Path, got: str) -> OutputError:
    hint = "it is left as it is; give --results another name"
    return OutputError(expected(str(path), "", f"a results file ({FORMAT})", got, hint))
