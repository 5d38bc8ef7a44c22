"""A run as tidy tables: which there are, what their columns are, and the rows that each step adds to them.

Which fields make which table follows from what they are declared to have entries for; see fireworld.records.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from operator import attrgetter
from typing import Any, Final

import numpy as np

from fireworld.errors import LogError, OutputError, expected, nearest
from fireworld.records import (
    ACTIONS,
    DTYPES,
    Array,
    Brigades,
    Buildings,
    CityRecord,
    Civilians,
    Decisions,
    Draws,
    Entity,
    Events,
    Observations,
    Rewards,
    Score,
    Steps,
    StoredRun,
)
from fireworld_recorder.header import to_metadata
from fireworld_recorder.schema import Commit, Field, message_of

_NUMPY_TYPES: Final[Mapping[str, str]] = {**DTYPES, "bool": "|b1"}
_CODES: Final = "<i4"


@dataclass(frozen=True)
class ExportColumn:
    """One column of a table."""

    name: str
    dtype: str
    """numpy type."""
    doc: str
    unit: str = ""
    names: tuple[str, ...] = ()
    """Texts that the numbers stand for; the column holds the texts, and nothing for a number that has none."""
    path: str = ""
    """Where a record of a step, or the city, has the values; empty for the numbers of the entities."""
    entry: int = 0
    width: int = 1
    """Which it is of the entries that each entity has there, and how many these are."""


@dataclass(frozen=True)
class ExportTable:
    """One table."""

    name: str
    """Also the name of its file."""
    doc: str
    """What a row is."""
    per: str
    """What there is a row for in each step; empty for the step itself."""
    columns: tuple[ExportColumn, ...]

    def read(self, record: Any, lacks: Callable[[str], bool] = lambda _: False) -> list[Array | None]:
        """Return the rows that a step adds (or the city, to the table `city`).

        Args:
            record: the step, or the city.
            lacks: whether the log does not have a field, as `RunHeader.lacks` does.

        Returns:
            An array for each column, all of one length; None for a field that is empty there.

        Raises:
            LogError: the fields have different lengths.
        """
        values = [attrgetter(column.path)(record) if column.path else None for column in self.columns]
        if not self.per:
            return [
                None if lacks(column.path) else np.array([value], column.dtype)
                for value, column in zip(values, self.columns, strict=True)
            ]
        pairs = list(zip(self.columns, values, strict=True))
        n_rows = max(len(value) // column.width for column, value in pairs if isinstance(value, np.ndarray))
        return [self._rows(column, value, n_rows, record) for column, value in pairs]

    def _rows(self, column: ExportColumn, value: Any, n_rows: int, record: Any) -> Array | None:
        """Return one column of the rows of a step."""
        if value is None:
            return np.arange(n_rows, dtype=column.dtype)
        if not isinstance(value, np.ndarray):
            return np.full(n_rows, value, column.dtype)
        if len(value) not in {0, n_rows * column.width}:
            where, field = f"step {record.step}" if self.name != "city" else "city", column.path.rpartition(".")[2]
            raise LogError(expected(where, f"{self.name}: {field}", f"{n_rows * column.width} values", len(value)))
        return value[column.entry :: column.width] if len(value) or not n_rows else None


def n_rows_of(values: Sequence[Array | None]) -> int:
    """Return how many rows `ExportTable.read` has returned."""
    return next(len(value) for value in values if value is not None)


def joined(column: ExportColumn, parts: Sequence[Array | None], lengths: Sequence[int]) -> np.ma.MaskedArray[Any, Any]:
    """Join the values of several steps; masked where there are none.

    Args:
        column: of names, the numbers that they stand for are joined; those without a name are masked, too.
        parts: of each step.
        lengths: rows of each step.
    """
    dtype = _CODES if column.names else column.dtype
    filled = [np.zeros(n, dtype) if part is None else part for part, n in zip(parts, lengths, strict=True)]
    values = np.concatenate([np.empty(0, dtype), *filled]).astype(dtype, copy=False)
    missing = np.repeat([part is None for part in parts], lengths).astype(bool)
    if column.names:
        missing |= (values < 0) | (values >= len(column.names))
    return np.ma.MaskedArray(values, missing)


def table_arrays(run: Steps, name: str) -> dict[str, Array]:
    """Return a table over all steps, in memory: an array for each column, as in the files of an export.

    A column of names is an array of texts, None where a number has no name; `find_table(name).columns` lists all names
    that a column can have, in their order. A column that is empty in some steps is a masked array, as pandas takes it.

    Args:
        run: the run; it is iterated over once.
        name: of the table.

    Raises:
        LogError: there is no such table, or a step makes no sense.
    """
    table = find_table(name)
    return arrays_of(table, [run.city] if name == "city" else run, run.header.lacks)


def to_pandas(run: Steps, name: str) -> Any:
    """Return a table over all steps as a data frame of pandas; columns of names are categorical.

    Args:
        run: the run; it is iterated over once.
        name: of the table.

    Raises:
        LogError: there is no such table, or a step makes no sense.
        OutputError: pandas is not installed.
    """
    table, pandas = find_table(name), import_frames("pandas")
    frame = pandas.DataFrame(table_arrays(run, name))
    for column in table.columns:
        if column.names:
            frame[column.name] = pandas.Categorical(frame[column.name], categories=column.names)
    return frame


def to_polars(run: Steps, name: str) -> Any:
    """Return a table over all steps as a data frame of polars; columns of names are of type Enum; as `to_pandas`."""
    table, polars = find_table(name), import_frames("polars")
    arrays, series = table_arrays(run, name), []
    for column in table.columns:
        if column.names:
            kind = polars.Enum(column.names)
            series.append(polars.Series(column.name, arrays[column.name].tolist(), dtype=kind))
            continue
        values = np.ma.asarray(arrays[column.name])
        found = polars.Series(column.name, values.data)
        missing = np.ma.getmaskarray(values)
        series.append(found.set(polars.Series(missing), None) if missing.any() else found)
    return polars.DataFrame(series)


def import_frames(name: str) -> Any:
    """Return the library pandas or polars; OutputError if it is not installed."""
    try:
        return import_module(name)
    except ImportError:
        raise OutputError(f"to_{name}: {name} is not installed; try pip install 'fireworld[frames]'") from None


def arrays_of(table: ExportTable, records: Iterable[Any], lacks: Callable[[str], bool]) -> dict[str, Array]:
    """Return the rows that some steps (or the city) add to a table, as `table_arrays` does; errors as for it."""
    read = [table.read(record, lacks) for record in records]
    lengths = [n_rows_of(values) for values in read]
    arrays: dict[str, Array] = {}
    for k, column in enumerate(table.columns):
        values = joined(column, [values[k] for values in read], lengths)
        if column.names:
            arrays[column.name] = np.array([*column.names, None], object)[values.filled(len(column.names))]
        else:
            arrays[column.name] = values if values.mask.any() else values.data
    return arrays


def facts_of(log: StoredRun) -> dict[str, str]:
    """Return what is known of a run as a whole: its header, how far it is good, its digest."""
    header = {key: text for key, text in to_metadata(log.header).items() if ":" not in key and key != "checksum"}
    facts = {"digest": log.digest, "state": log.state, "damage": log.damage or "", "n_steps": str(len(log))}
    return {f"fireworld.{key}": text for key, text in sorted({**header, **facts}.items())}


def find_table(name: str) -> ExportTable:
    """Return a table by its name.

    Raises:
        LogError: there is none of that name.
    """
    if name not in TABLES:
        raise LogError(expected("table", "", f"one of {', '.join(TABLES)}", name, nearest(name, TABLES)))
    return TABLES[name]


def _columns_of(topic: type[Any], per: str, prefix: str = "") -> Iterator[ExportColumn]:
    """Yield the columns of a topic's fields per entity: a coded field has a second one for its names."""
    path = "" if topic in {CityRecord, Commit} else f"{topic.topic[1:]}."
    for item in message_of(topic).fields:
        if item.per == per and item.width == 1:
            column = _column(item, prefix + item.name, item.doc, path=path + item.name)
            yield column
            if item.names:
                doc = f"name of {column.name}"
                yield ExportColumn(f"{column.name}_name", "U", doc, names=item.names, path=column.path)


def _column(item: Field, name: str, doc: str, *, path: str, entry: int = 0) -> ExportColumn:
    return ExportColumn(name, _NUMPY_TYPES[item.wire], doc, item.unit, path=path, entry=entry, width=item.width)


_COMMIT: Final = {item.name: item for item in message_of(Commit).fields}
_STEP: Final = _column(_COMMIT["step"], "step", "step, a simulated minute; 0 is the state before", path="step")
_INDICES: Final = {
    "building": "index of the building, the same in every table",
    "brigade": "index of the brigade",
    "civilian": "index of the civilian",
    "event": "number of the event in its step",
}
"""Columns that number entities; fire sites have numbers of their own."""


def _table(name: str, doc: str, per: Entity, *topics: type[Any]) -> ExportTable:
    """Make the table with a row for each step and entity, of all fields of some topics per entity."""
    index = [ExportColumn(per, "<i4", _INDICES[per])] if per in _INDICES else []
    columns = [column for topic in topics for column in _columns_of(topic, per)]
    return ExportTable(name, doc, per, (*([] if name == "city" else [_STEP]), *index, *columns))


def _decisions() -> ExportTable:
    """Make the table of what the brigades saw and chose, with a column for the Q-value of each action."""
    doc = "what each brigade saw, chose and why; from step 1 on"
    table = _table("decisions", doc, "brigade", Observations, Decisions)
    (item,) = (item for item in message_of(Decisions).fields if item.width > 1)
    path = f"decisions.{item.name}"
    q_values = (
        _column(item, f"q_{action.replace('-', '_')}", f"value of the action `{action}`", path=path, entry=k)
        for k, action in enumerate(ACTIONS)
    )
    return ExportTable(table.name, doc, table.per, (*table.columns, *q_values))


def _steps() -> ExportTable:
    """Make the table with a row for each step, of all fields with a single value; those of some get a prefix."""
    prefixes: dict[type[Any], str] = {Draws: "draw_", Decisions: "", Rewards: "reward_", Score: ""}
    columns = [column for topic, prefix in prefixes.items() for column in _columns_of(topic, "", prefix)]
    endings = [_column(_COMMIT[name], name, _COMMIT[name].doc, path=name) for name in ("terminated", "truncated")]
    doc = "random draws, reward and score of a step, and how the run ended"
    return ExportTable("steps", doc, "", (_STEP, *columns, *endings))


TABLES: Final[Mapping[str, ExportTable]] = {
    table.name: table
    for table in (
        _table("city", "a building: what never changes", "building", CityRecord),
        _table("buildings", "a building after a step", "building", Buildings),
        _table("brigades", "a brigade after a step", "brigade", Brigades),
        _decisions(),
        _table("civilians", "a civilian after a step", "civilian", Civilians),
        _table("sites", "a fire site before the brigades chose", "site", Observations),
        _table("events", "something that happened in a step", "event", Events),
        _steps(),
    )
}
"""All tables by name; `city` is read from the city, all others from each step."""
