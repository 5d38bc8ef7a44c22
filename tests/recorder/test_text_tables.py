"""Tables as text and as data frames: what is in them is what is in the log, step by step."""

import csv
import json

import numpy as np
import pytest
from fireworld_recorder.reader import open_log
from fireworld_recorder.tables import TABLES, table_arrays, to_pandas, to_polars
from fireworld_recorder.text_tables import COLUMNS_FILE, FACTS_FILE, export_text

from fireworld.errors import LogError, OutputError
from tests.recorder import synthetic
from tests.recorder.conftest import write_log


def wanted(log, name):
    """The rows of a table as plain values; None where there is none."""
    arrays = table_arrays(log, name)
    return [*arrays], [list(row) for row in zip(*(one.tolist() for one in arrays.values()), strict=True)]


def as_csv(value):
    return "" if value is None else str(value)


def test_csv_files_have_the_rows_of_the_log(log_path, tmp_path):
    log = open_log(log_path)
    n_rows = export_text(log, tmp_path / "run", "csv")
    assert sorted(path.name for path in (tmp_path / "run").iterdir()) == sorted(
        [COLUMNS_FILE, FACTS_FILE, *(f"{name}.csv" for name in TABLES)]
    )
    for name in TABLES:
        with (tmp_path / "run" / f"{name}.csv").open(newline="") as file:
            names, *rows = csv.reader(file)
        columns, known = wanted(log, name)
        assert names == columns
        assert rows == [[as_csv(value) for value in row] for row in known]
        assert n_rows[name] == len(rows)


def test_columns_and_facts_are_documented(log_path, tmp_path):
    log = open_log(log_path)
    export_text(log, tmp_path / "run", "csv", tables=["buildings", "steps"])
    with (tmp_path / "run" / COLUMNS_FILE).open(newline="") as file:
        head, *rows = csv.reader(file)
    assert head == ["table", "column", "unit", "meaning"]
    assert [row[1] for row in rows if row[0] == "buildings"] == [one.name for one in TABLES["buildings"].columns]
    assert all(row[3] for row in rows)
    facts = json.loads((tmp_path / "run" / FACTS_FILE).read_text())
    assert (facts["fireworld.digest"], facts["fireworld.state"]) == (log.digest, "complete")


def test_json_lines_have_the_rows_of_the_log(log_path, tmp_path):
    log = open_log(log_path)
    n_rows = export_text(log, tmp_path / "run.jsonl", "jsonl")
    first, *lines = [json.loads(line) for line in (tmp_path / "run.jsonl").read_text().splitlines()]
    assert first["facts"]["fireworld.digest"] == log.digest
    assert {one["table"] for one in first["columns"]} == set(TABLES)
    for name in TABLES:
        columns, known = wanted(log, name)
        rows = [line for line in lines if line["of"] == name]
        assert len(rows) == n_rows[name]
        for row, values in zip(rows, known, strict=True):
            plain = [None if isinstance(one, float) and not np.isfinite(one) else one for one in values]
            assert row == {"of": name, **dict(zip(columns, plain, strict=True))}


@pytest.mark.parametrize("form", ["csv", "jsonl"])
def test_steps_are_written_while_the_log_is_read(log_path, tmp_path, form):
    log = open_log(log_path)
    sizes = []

    def size(_):
        files = [path for path in tmp_path.rglob("*") if path.is_file()]
        sizes.append(sum(path.stat().st_size for path in files))

    export_text(log, tmp_path / "out", form, on_step=size)
    assert len(sizes) == len(log)
    assert 0 < sizes[len(sizes) // 2] < sizes[-1]


@pytest.mark.parametrize(("form", "place"), [("csv", "run"), ("jsonl", "run.jsonl")])
def test_what_is_there_is_replaced_only_if_asked(log_path, tmp_path, form, place):
    log = open_log(log_path)
    export_text(log, tmp_path / place, form, tables=["steps"])
    with pytest.raises(OutputError, match="--force"):
        export_text(log, tmp_path / place, form)
    assert export_text(log, tmp_path / place, form, tables=["city"], force=True).keys() == {"city"}
    with pytest.raises(LogError, match=r"table: expected one of city, .*, got 'bildings'; try buildings"):
        export_text(log, tmp_path / "other", form, tables=["bildings"])
    assert [path.name for path in tmp_path.iterdir()] == [place]


def test_of_a_log_that_was_cut_off(log_path, tmp_path):
    path = tmp_path / "cut.mcap"
    path.write_bytes(log_path.read_bytes()[: log_path.stat().st_size * 2 // 3])
    log = open_log(path, partial=True)
    n_rows = export_text(log, tmp_path / "run", "csv", tables=["steps"])
    assert n_rows == {"steps": len(log)}
    assert json.loads((tmp_path / "run" / FACTS_FILE).read_text())["fireworld.damage"]


@pytest.mark.parametrize("name", TABLES)
def test_data_frames_have_the_rows_of_the_log(log_path, name):
    pytest.importorskip("pandas")
    pytest.importorskip("polars")
    log = open_log(log_path)
    columns, known = wanted(log, name)
    frame = to_polars(log, name)
    assert frame.columns == columns
    assert [list(row) for row in frame.rows()] == known
    other = to_pandas(log, name)
    assert [*other.columns] == columns
    for column in columns:
        same = [None if one != one else one for one in other[column].astype(object)]  # noqa: PLR0124 - nan
        assert same == [None if one is None or one != one else one for one in frame[column]]  # noqa: PLR0124 - nan


def test_what_is_not_installed_is_named(log_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "polars", None)
    with pytest.raises(OutputError, match=r"to_polars: polars is not installed; try pip install 'fireworld\[frames\]'"):
        to_polars(open_log(log_path), "steps")


def test_of_an_empty_table(tmp_path):
    path = tmp_path / "a.mcap"
    write_log(path, synthetic.run(2)[:1])
    export_text(open_log(path), tmp_path / "run", "csv", tables=["decisions"])
    assert (tmp_path / "run" / "decisions.csv").read_text().startswith("step,brigade,site,")
