"""Tables as text: a folder of CSV files, or one file of JSON lines; written row by row, so that little is in memory."""

from __future__ import annotations

import csv
import json
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, Final

from fireworld.errors import LogError, OutputError, expected
from fireworld.files import check_output, json_line, new_folder, written_beside
from fireworld.records import Array, StepRecord, StoredRun
from fireworld_recorder.reader import Log
from fireworld_recorder.tables import TABLES, arrays_of, facts_of, find_table

CSV: Final = "csv"
JSONL: Final = "jsonl"
TEXT_FORMS: Final = (CSV, JSONL)
COLUMNS_FILE: Final = "columns.csv"
FACTS_FILE: Final = "run.json"
OF: Final = "of"
"""The key of a line of JSON that names its table; no column is called so."""
COLUMNS_HEAD: Final = ("table", "column", "unit", "meaning")
ColumnDoc = tuple[str, str, str, str]
"""Table, column, unit and meaning."""


class TextTables(ABC):
    """Tables on their way into text; `n_rows` are the rows of each so far."""

    def __init__(self) -> None:
        self.n_rows: dict[str, int] = {}

    def add(self, table: str, columns: Mapping[str, Array]) -> None:
        """Add rows to a table: an array for each column, masked where there is no value; all of one length."""
        values = [one.tolist() for one in columns.values()]
        if table not in self.n_rows:
            self.n_rows[table] = 0
            self._begin(table, [*columns])
        self.n_rows[table] += len(values[0])
        self._write(table, [*columns], zip(*values, strict=True))

    @abstractmethod
    def _begin(self, table: str, names: Sequence[str]) -> None: ...

    @abstractmethod
    def _write(self, table: str, names: Sequence[str], rows: Iterator[tuple[Any, ...]]) -> None: ...


class _Csv(TextTables):
    """A file for each table in a folder; nothing stands for no value."""

    def __init__(self, folder: Path, stack: ExitStack) -> None:
        super().__init__()
        self._folder, self._stack, self._writers = folder, stack, dict[str, Any]()

    def _begin(self, table: str, names: Sequence[str]) -> None:
        file = self._stack.enter_context((self._folder / f"{table}.csv").open("w", encoding="utf-8", newline=""))
        self._writers[table] = csv.writer(file, lineterminator="\n")
        self._writers[table].writerow(names)

    def _write(self, table: str, names: Sequence[str], rows: Iterator[tuple[Any, ...]]) -> None:
        del names  # they are in the first line
        self._writers[table].writerows(rows)


class _Jsonl(TextTables):
    """A line for each row, with its table; null stands for no value, and for what is no finite number."""

    def __init__(self, write: Callable[[str], object]) -> None:
        super().__init__()
        self._put = write

    def _begin(self, table: str, names: Sequence[str]) -> None:
        pass

    def _write(self, table: str, names: Sequence[str], rows: Iterator[tuple[Any, ...]]) -> None:
        for row in rows:
            self._put(json_line({OF: table, **dict(zip(names, row, strict=True))}))


@contextmanager
def text_tables(
    form: str, place: Path, *, tables: Collection[str], facts: Mapping[str, str], docs: Sequence[ColumnDoc], force: bool
) -> Iterator[TextTables]:
    """Yield what writes tables as text; they are there only once they are complete.

    Args:
        form: "csv" or "jsonl".
        place: the folder, or the file, to make.
        tables: names of all tables that an export can have.
        facts: about the whole recording.
        docs: what columns mean; into columns.csv, or the first line.
        force: replace an earlier export.

    Raises:
        OutputError: there is no such form, the place is taken, or it cannot be written.
    """
    if form == CSV:
        own = {COLUMNS_FILE, FACTS_FILE, *(f"{name}.csv" for name in tables)}
        with new_folder(place, own=own, force=force) as scratch, ExitStack() as stack:
            (scratch / FACTS_FILE).write_text(json.dumps(facts, indent=2) + "\n", encoding="utf-8")
            with (scratch / COLUMNS_FILE).open("w", encoding="utf-8", newline="") as file:
                csv.writer(file, lineterminator="\n").writerows([COLUMNS_HEAD, *docs])
            yield _Csv(scratch, stack)
    elif form == JSONL:
        check_output(place, force=force)
        with written_beside(place) as partial, partial.open("w", encoding="utf-8") as file:
            columns = [dict(zip(COLUMNS_HEAD, one, strict=True)) for one in docs]
            file.write(json_line({OF: "", "facts": facts, "columns": columns}))
            yield _Jsonl(file.write)
    else:
        raise OutputError(expected("export", "form", f"parquet, {', '.join(TEXT_FORMS)}", form))


def export_text(
    log: StoredRun,
    place: Path,
    form: str,
    *,
    tables: Collection[str] | None = None,
    force: bool = False,
    on_step: Callable[[StepRecord], object] = lambda _: None,
) -> dict[str, int]:
    """Write the steps of a run as text, one step in memory at a time.

    Args:
        log: the run, complete or not.
        place: the folder (CSV), or the file (JSON lines), to make.
        form: "csv" or "jsonl".
        tables: names of the tables to write; None: all.
        force: replace an earlier export.
        on_step: called after each step.

    Returns:
        Rows by table.

    Raises:
        LogError: there is no such table, the log changed since it was opened, or a step in it makes no sense.
        OutputError: the place is taken, or cannot be written.
    """
    chosen = [find_table(name) for name in (TABLES if tables is None else tables)]
    docs = [(table.name, one.name, one.unit, one.doc) for table in chosen for one in table.columns]
    by_step = [table for table in chosen if table.name != "city"]
    with text_tables(form, place, tables=TABLES, facts=facts_of(log), docs=docs, force=force) as text:
        try:
            for table in chosen:
                text.add(table.name, arrays_of(table, [log.city] if table not in by_step else [], log.header.lacks))
            for record in log if by_step else ():
                for table in by_step:
                    text.add(table.name, arrays_of(table, [record], log.header.lacks))
                on_step(record)
        except LogError as error:
            if not isinstance(log, Log) or str(error).startswith(str(log.path)):
                raise
            raise LogError(f"{log.path}: {error}") from None
    return text.n_rows
