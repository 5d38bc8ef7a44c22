"""`fireworld export --csv` and `--jsonl` of trainings: what is in them is what is in the log; data frames too."""

from __future__ import annotations

import csv
import json

import pytest

from fireworld.errors import OutputError
from fireworld.recording.export import export
from fireworld.training.log.export import table_arrays, tables_of
from fireworld.training.log.reader import open_training


@pytest.mark.parametrize("method", ["paper", "search", "targets", "evolution", "gates", "imitation", "rollouts"])
def test_rows_are_those_of_the_log(here, fireworld, make_log, method):
    path = make_log(method)
    log = open_training(path)
    assert fireworld("export", path, "--csv", "tables").code == 0
    done = fireworld("export", path, "--jsonl", "tables.jsonl", "--json")
    assert done.code == 0, done.err
    first, *lines = [json.loads(line) for line in (here / "tables.jsonl").read_text().splitlines()]
    assert first["facts"]["fireworld.digest"] == log.digest
    for name in tables_of(log):
        known = {key: values.tolist() for key, values in table_arrays(log, name).items()}
        with (here / "tables" / f"{name}.csv").open(newline="") as file:
            names, *rows = csv.reader(file)
        assert names == [*known]
        assert rows == [["" if one is None else str(one) for one in row] for row in zip(*known.values(), strict=True)]
        n_lines = sum(line["of"] == name for line in lines)
        assert len(rows) == n_lines == json.loads(done.out)["n_rows"][name] > 0
    documented = (here / "tables" / "columns.csv").read_text()
    assert method != "paper" or "episodes,scenario,,name of its scenario" in documented
    wanted = {
        "paper": "episodes,epsilon,probability,probability of exploring",
        "search": "generations,score_mean,,",
        "targets": "lessons,epsilon,probability,probability of exploring",
        "evolution": "evolved,score_mean,,",
        "gates": "evolved,score_mean,,",
        "imitation": "improved,score_mean,,",
        "rollouts": "improved,score_mean,,",
    }
    assert wanted[method] in documented


@pytest.mark.parametrize("words", [("--csv", "out"), ("--jsonl", "out")])
def test_mistakes_of_the_command_line(here, fireworld, make_log, words):
    path = make_log()
    wrong = fireworld("export", path, *words, "--tables", "episods")
    assert (wrong.code, wrong.err.count("\n")) == (2, 1)
    assert "expected one of episodes, steps, tables, got 'episods'; try episodes" in wrong.err
    assert fireworld("export", path, *words, "--parquet", "p").code == 2
    assert fireworld("export", path, path, *words).code == 2
    assert [*here.glob("out*")] == []
    with pytest.raises(OutputError, match="export: form: expected parquet, csv, jsonl, got 'xml'"):
        export(path, "out", form="xml")


@pytest.mark.parametrize("library", ["pandas", "polars"])
@pytest.mark.parametrize("method", ["paper", "search", "targets", "evolution", "gates", "imitation", "rollouts"])
def test_data_frames(make_log, library, method):
    pytest.importorskip(library)
    log = open_training(make_log(method))
    for name in tables_of(log):
        frame = getattr(log, f"to_{library}")(name)
        known = {key: values.tolist() for key, values in table_arrays(log, name).items()}
        assert [*frame.columns] == [*known]
        for key, values in known.items():
            assert repr(frame[key].to_list()) == repr(values)
