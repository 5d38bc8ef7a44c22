"""A table on its way into a Parquet file, a group of rows after the other."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, Self

import numpy as np

from fireworld.errors import OutputError
from fireworld.records import Array

SUFFIX: Final = ".parquet"
ROWS_PER_GROUP: Final = 1 << 17
Rows = dict[str, Array]
"""Columns by name, all of one length; what has a second axis becomes lists of that length."""


class RowsFile:
    """Writes one table; as a context manager it closes the file, whatever happens.

    Args:
        path: the file.
        facts: its metadata.
    """

    def __init__(self, path: Path, facts: Mapping[str, str]) -> None:
        self._path, self._facts = path, facts
        self._held: list[Rows] = []
        self._n_held = self._n_rows = 0
        self._writer: Any = None
        self._file: Any = None

    def add(self, rows: Rows) -> None:
        """Add rows."""
        self._held.append(rows)
        self._n_held += len(next(iter(rows.values())))
        if self._n_held >= ROWS_PER_GROUP:
            self._flush()

    def finish(self) -> int:
        """Write what is held; return the number of rows."""
        self._flush()
        return self._n_rows

    def close(self) -> None:
        """Close the file."""
        if self._writer is not None:
            with self._file:
                self._writer.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _flush(self) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        if not self._held:
            return
        table = pa.table({key: _column([rows[key] for rows in self._held]) for key in self._held[0]})
        if self._writer is None:
            schema = table.schema.with_metadata(self._facts)
            self._file = self._path.open("wb")  # arrow itself takes no names of any bytes
            self._writer = pq.ParquetWriter(self._file, schema, compression="zstd")
        self._writer.write_table(table.replace_schema_metadata(self._facts))
        self._n_rows += self._n_held
        self._held, self._n_held = [], 0


def check_pyarrow(who: str) -> None:
    """Raise OutputError if pyarrow is not installed."""
    from importlib.util import find_spec

    if find_spec("pyarrow") is None:
        raise OutputError(f"{who}: pyarrow is not installed; try pip install 'fireworld[archive]'")


def _column(parts: list[Array]) -> Any:
    """Return a column as Arrow has it."""
    import pyarrow as pa

    values = np.concatenate(parts)
    if values.dtype.kind in "UO":
        return pa.array(values.tolist())
    if values.ndim == 1:
        return pa.array(values)
    return pa.FixedSizeListArray.from_arrays(pa.array(values.reshape(-1)), values.shape[1])
