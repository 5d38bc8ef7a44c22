"""A file of results: how every run came out that was ever made for a comparison, so that none is made twice.

One row a run, as Parquet. A run is identified by the digests of its scenario and its policy, its seed and the version
of the simulator; runs that agree in all four have the same outcome.
"""

from __future__ import annotations

import io
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from fireworld.errors import OutputError, expected
from fireworld.evaluation.runs import KINDS, Row
from fireworld.files import read_input, write_file

FORMAT: Final = "fireworld-results/1"
KEYS: Final[dict[str, type]] = {
    **dict.fromkeys(("scenario", "policy", "scenario_digest", "policy_digest"), str),
    "seed": int,
    "version": str,
}
"""The first columns: which run it is. `outcome.COLUMNS` follow: how it came out."""
N_BYTES_MAX: Final = 1 << 28
N_ROWS_FREE: Final = 100_000
ROW_BYTES_MIN: Final = 4
"""A file of n bytes may hold that many rows more than n / 4: each takes more than 4 bytes, packed."""
UNPACKED_BYTES_MAX: Final = 1 << 29
N_FIRST: Final = 14
"""Columns of the first version, none of which may be empty; a later one is, in a row that is older."""


@dataclass(frozen=True, order=True)
class RunKey:
    """What identifies a run."""

    scenario_digest: str
    policy_digest: str
    seed: int
    version: str


@dataclass(frozen=True)
class Result:
    """How a run came out, and the names it was asked for by."""

    scenario: str
    policy: str
    row: Row  # None stands where the file is older than the column


@dataclass
class Results:
    """Results by run: those of a file, if there is one, and those added since."""

    path: Path | None  # None: held in memory only
    by_run: dict[RunKey, Result] = field(default_factory=dict)
    n_unsaved: int = 0

    def has(self, key: RunKey) -> bool:
        """Return whether a run is known, in every column."""
        result = self.by_run.get(key)
        return result is not None and None not in result.row

    def add(self, key: RunKey, result: Result) -> None:
        """Add a run."""
        self.by_run[key] = result
        self.n_unsaved += 1

    def save(self) -> None:
        """Write the file if there is anything new: what it holds by now, and what was added.

        Equal results give equal bytes, whatever the order they came in. OutputError if it cannot be written, or if what
        is there by now is no results file.
        """
        if self.path is None or not self.n_unsaved:
            return
        if self.path.exists():
            self.by_run = read_results(self.path) | self.by_run
        write_file(self.path, _write(self.by_run))
        self.n_unsaved = 0


def open_results(path: Path | None) -> Results:
    """Open a file of results, or begin one; None holds them in memory.

    OutputError if pyarrow is not installed, or as for `read_results`; the file is left as it is.
    """
    if path is None:
        return Results(None)
    try:
        import pyarrow.parquet  # noqa: F401 - is it there?
    except ImportError:
        raise OutputError("--results: pyarrow is not installed; try pip install 'fireworld[archive]'") from None
    if not path.exists():
        if not path.parent.is_dir():
            raise OutputError(f"{path}: cannot be written: no folder {path.parent}")
        return Results(path)
    return Results(path, read_results(path))


def read_results(path: Path) -> dict[RunKey, Result]:
    """Read a file of results; OutputError if it cannot be read, is damaged or no results file."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    content = read_input(path, what="a file of results", n_bytes_max=N_BYTES_MAX, error=OutputError)
    try:
        data = pa.BufferReader(content)
        schema = pq.read_schema(data)
        texts = [name for name in schema.names if KEYS.get(name) is str]  # few different ones, again and again
        with pq.ParquetFile(data, page_checksum_verification=True, read_dictionary=texts) as file:
            _check_size(path, len(content), file.metadata)
            table = _written_out(path, file.read(), schema)
    except OutputError:
        raise
    except Exception as error:  # noqa: BLE001 - pyarrow raises many kinds for a damaged file
        raise _not_results(path, " ".join(str(error).split())) from None
    wanted = _schema(len(table.schema))
    if len(table.schema) < N_FIRST or not table.schema.equals(wanted, check_metadata=True):
        raise _not_results(path, "a table with other columns, or of a later fireworld")
    later: list[Any] = [None] * (len(KINDS) + len(KEYS) - len(wanted))
    results: dict[RunKey, Result] = {}
    for row in zip(*(column.to_pylist() for column in table.columns), strict=True):
        scenario, policy, scenario_digest, policy_digest, seed, version, *values = *row, *later
        key = RunKey(scenario_digest, policy_digest, seed, version)
        known = results.setdefault(key, Result(scenario, policy, tuple(values)))
        if known.row != tuple(values):
            raise _not_results(path, f"two outcomes of {scenario}, {policy}, seed {seed}")
    return results


def _check_size(path: Path, n_bytes: int, metadata: Any) -> None:
    """Raise OutputError for a table that claims more than such a file holds, before it is unpacked."""
    n_rows_max = N_ROWS_FREE + n_bytes // ROW_BYTES_MIN
    if metadata.num_rows > n_rows_max:
        raise _not_results(path, f"{metadata.num_rows} rows in {n_bytes} bytes, where {n_rows_max} are the most")
    unpacked = sum(metadata.row_group(index).total_byte_size for index in range(metadata.num_row_groups))
    if unpacked > UNPACKED_BYTES_MAX:
        raise _not_results(path, f"{unpacked} bytes of rows, where {UNPACKED_BYTES_MAX} are the most")


def _written_out(path: Path, table: Any, schema: Any) -> Any:
    """Return a table with its texts written out, not as numbers of a list; OutputError for more than results have."""
    import pyarrow as pa
    import pyarrow.compute as pc

    n_bytes = 0
    for column in table.columns:
        for chunk in column.chunks if pa.types.is_dictionary(column.type) else ():
            n_bytes += pc.sum(pc.take(pc.binary_length(chunk.dictionary), chunk.indices)).as_py() or 0
    if n_bytes > UNPACKED_BYTES_MAX:
        raise _not_results(path, f"{n_bytes} bytes of text, where {UNPACKED_BYTES_MAX} are the most")
    return table.cast(schema)


def _write(results: dict[RunKey, Result]) -> bytes:
    import pyarrow as pa
    import pyarrow.parquet as pq

    schema = _schema()
    rows = [
        (result.scenario, result.policy, key.scenario_digest, key.policy_digest, key.seed, key.version, *result.row)
        for key, result in sorted(results.items(), key=lambda item: item[0])
    ]
    table = pa.Table.from_pylist([dict(zip(schema.names, row, strict=True)) for row in rows], schema=schema)
    data = io.BytesIO()
    pq.write_table(table, data, compression="zstd", write_page_checksum=True)
    return data.getvalue()


def _schema(n_columns: int | None = None) -> Any:
    """Return the columns, or the first ones: what the first version had is never empty; the file says what it is."""
    import pyarrow as pa

    types = {str: pa.string(), int: pa.int64(), float: pa.float64(), bool: pa.bool_()}
    columns = [*(KEYS | KINDS).items()][:n_columns]
    fields = [pa.field(name, types[kind], nullable=k >= N_FIRST) for k, (name, kind) in enumerate(columns)]
    return pa.schema(fields, metadata={"format": FORMAT})


def _not_results(path: Path, got: str) -> OutputError:
    hint = "it is left as it is; give --results another name"
    return OutputError(expected(str(path), "", f"a results file ({FORMAT})", got, hint))
