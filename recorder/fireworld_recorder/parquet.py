"""A recording as Parquet files, one for each table, for pandas, polars, DuckDB and the like."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Final, Self

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from fireworld.errors import LogError
from fireworld.files import new_folder
from fireworld.records import Array, StepRecord, StoredRun
from fireworld_recorder.reader import Log
from fireworld_recorder.tables import TABLES, ExportColumn, ExportTable, facts_of, find_table, joined, n_rows_of

SUFFIX: Final = ".parquet"
ROWS_PER_GROUP: Final = 1 << 17
"""Rows of a table that are held in memory before they are written."""


def export(
    log: StoredRun,
    folder: Path,
    *,
    tables: Collection[str] | None = None,
    force: bool = False,
    rows_per_group: int = ROWS_PER_GROUP,
    on_step: Callable[[StepRecord], object] = lambda _: None,
) -> dict[str, int]:
    """Write the steps of a run as a folder of Parquet files, which is there only once it is complete.

    Args:
        log: the run, complete or not; every file has that in its metadata, as `fireworld.state`.
        folder: the folder to make.
        tables: names of the tables to write; None: all.
        force: replace an earlier export.
        rows_per_group: rows of a table that are held in memory before they are written.
        on_step: called after each step.

    Returns:
        Rows by table.

    Raises:
        LogError: there is no such table, the log changed since it was opened, or a step in it makes no sense.
        OutputError: the folder exists, or cannot be written.
    """
    metadata = facts_of(log)
    chosen = [find_table(name) for name in (TABLES if tables is None else tables)]
    own = {f"{name}{SUFFIX}" for name in TABLES}
    with new_folder(folder, own=own, force=force) as scratch, ExitStack() as stack:
        writers = {
            name: stack.enter_context(_TableWriter(table, scratch, metadata, rows_per_group, log.header.lacks))
            for name, table in TABLES.items()
            if table in chosen
        }
        try:
            if "city" in writers:
                writers["city"].add(log.city)
            by_step = [writer for name, writer in writers.items() if name != "city"]
            for record in log if by_step else ():
                for writer in by_step:
                    writer.add(record)
                on_step(record)
        except LogError as error:
            if not isinstance(log, Log) or str(error).startswith(str(log.path)):
                raise
            raise LogError(f"{log.path}: {error}") from None
        for writer in writers.values():
            writer.flush()
    return {name: writer.n_rows for name, writer in writers.items()}


class _TableWriter:
    """Writes one table, a group of rows after the other."""

    def __init__(
        self,
        table: ExportTable,
        folder: Path,
        metadata: Mapping[str, str],
        rows_per_group: int,
        lacks: Callable[[str], bool],
    ) -> None:
        self.n_rows = 0
        self._table, self._lacks = table, lacks
        self._rows_per_group = rows_per_group
        self._held: list[list[Array | None]] = []
        self._n_held = 0
        self._schema = schema_of(table, metadata)
        self._file = (folder / f"{table.name}{SUFFIX}").open("wb")  # arrow itself takes no names of any bytes
        self._writer = pq.ParquetWriter(self._file, self._schema, compression="zstd")

    def add(self, record: Any) -> None:
        """Add the rows of a step, or of the city."""
        values = self._table.read(record, self._lacks)
        n_rows = n_rows_of(values)
        if n_rows:
            self._held.append(values)
            self._n_held += n_rows
        if self._n_held >= self._rows_per_group:
            self.flush()

    def flush(self) -> None:
        """Write the rows that are held."""
        if not self._n_held:
            return
        lengths = [n_rows_of(values) for values in self._held]
        arrays = [
            _arrow(column, joined(column, [values[k] for values in self._held], lengths))
            for k, column in enumerate(self._table.columns)
        ]
        self._writer.write_table(pa.Table.from_arrays(arrays, schema=self._schema), row_group_size=self._n_held)
        self.n_rows += self._n_held
        self._held, self._n_held = [], 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        with self._file:
            self._writer.close()


def schema_of(table: ExportTable, metadata: Mapping[str, str]) -> Any:
    """Return the Arrow schema of a table: units and meanings as field metadata, the run as the file's.

    Units are given once more for the whole file, since few readers show the metadata of a field.
    """
    fields = []
    for column in table.columns:
        facts = {"doc": column.doc} | ({"unit": column.unit} if column.unit else {})
        fields.append(pa.field(column.name, _arrow_type(column), metadata=facts))
    units = {column.name: column.unit for column in table.columns if column.unit}
    facts = {"fireworld.table": table.doc, "fireworld.units": json.dumps(units)}
    return pa.schema(fields, metadata={**metadata, **facts})


def _arrow_type(column: ExportColumn) -> Any:
    return pa.dictionary(pa.int8(), pa.string()) if column.names else pa.from_numpy_dtype(np.dtype(column.dtype))


def _arrow(column: ExportColumn, values: np.ma.MaskedArray[Any, Any]) -> Any:
    """Make an Arrow array; masked values become nulls."""
    if not column.names:
        return pa.array(values.data, _arrow_type(column), mask=values.mask if values.mask.any() else None)
    codes = pa.array(values.filled(0).astype(np.int8), mask=values.mask)
    return pa.DictionaryArray.from_arrays(codes, pa.array(column.names))
