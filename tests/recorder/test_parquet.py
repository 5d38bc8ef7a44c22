"""`fireworld export`: what is in the tables is what is in the log, and a folder is there only when it is complete."""

import dataclasses
import json
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from fireworld_recorder.reader import open_log
from fireworld_recorder.tables import TABLES, table_arrays

from fireworld import records
from fireworld.errors import LogError, OutputError
from fireworld.files import SCRATCH
from fireworld.records import ACTIONS, EVENT_KINDS, FIERYNESS, MemoryRecording
from tests.recorder import synthetic
from tests.recorder.conftest import write_log

parquet = pytest.importorskip("fireworld_recorder.parquet")


@pytest.fixture(scope="module")
def exported(log_path, tmp_path_factory):
    """All tables of the log of 31 steps, in groups of far fewer rows than it has."""
    folder = tmp_path_factory.mktemp("export") / "run"
    parquet.export(open_log(log_path), folder, rows_per_group=100)
    return folder


def table_of(folder, name):
    return pq.read_table(folder / f"{name}.parquet")


def values_of(table, name):
    return table.column(name).to_numpy(zero_copy_only=False)


@pytest.mark.parametrize(
    ("table", "topic", "skipped"),
    [
        ("buildings", records.Buildings, ()),
        ("brigades", records.Brigades, ()),
        ("civilians", records.Civilians, ()),
        ("events", records.Events, ()),
        ("decisions", records.Decisions, ("q_values", "epsilon")),
    ],
)
def test_rows_are_those_that_the_reader_gives(exported, log_path, table, topic, skipped):
    log, found = open_log(log_path), table_of(exported, table)
    names = [item.name for item in dataclasses.fields(topic) if item.name not in skipped]
    for name in names:
        arrays = log.ragged(topic.topic, name)
        if not any(map(len, arrays)):
            assert found.column(name).null_count == found.num_rows
            continue
        assert values_of(found, name).tolist() == np.concatenate(arrays).tolist(), name
        lengths = [len(array) for array in arrays]
        assert values_of(found, "step").tolist() == np.repeat(log.steps, lengths).tolist()
        assert values_of(found, found.schema.names[1]).tolist() == [k for n in lengths for k in range(n)]
        dtype = arrays[0].dtype
        assert found.schema.field(name).type == pa.from_numpy_dtype(dtype)


def test_sites_are_those_that_the_reader_gives(exported, log_path):
    log, found = open_log(log_path), table_of(exported, "sites")
    assert found.schema.names[:2] == ["step", "site_id"]
    for name in found.schema.names[1:]:
        assert values_of(found, name).tolist() == np.concatenate(log.ragged("/observations", name)).tolist()


def test_a_step_is_a_row_with_draws_reward_score_and_ending(exported, log_path):
    log, found = open_log(log_path), table_of(exported, "steps")
    assert found.num_rows == 31
    for column, topic, name in (
        ("draw_key", "/draws", "key"),
        ("epsilon", "/decisions", "epsilon"),
        ("reward_total", "/rewards", "total"),
        ("reward_sum_so_far", "/rewards", "sum_so_far"),
        ("score", "/score", "score"),
        ("n_burnt_out", "/score", "n_burnt_out"),
    ):
        assert values_of(found, column).tolist() == log.column(topic, name).tolist()
    assert values_of(found, "truncated").tolist() == [False] * 30 + [True]


def test_decisions_have_features_names_and_a_value_for_each_action(exported, log_path):
    log, rows = open_log(log_path), table_of(exported, "decisions").to_pylist()
    assert len(rows) == 30 * 3
    row, step = rows[7], log.step(3)
    assert (row["step"], row["brigade"]) == (3, 1)
    assert row["state_index"] == step.observations.state_index[1]
    assert (row["action"], row["action_name"]) == (1, "nearest-to-civilian")
    assert row["distance_from_center_name"] == "medium"
    values = [row["q_" + action.replace("-", "_")] for action in ACTIONS]
    assert values == step.decisions.q_values[4:8].tolist()


def test_names_stand_beside_the_numbers(exported):
    rows = table_of(exported, "events").to_pylist()
    assert {row["kind_name"] for row in rows} == {EVENT_KINDS[2]}
    buildings = table_of(exported, "buildings").to_pylist()
    assert all(row["fieryness_name"] == FIERYNESS[row["fieryness"]] for row in buildings)


def test_the_city_has_a_row_for_each_building(exported, city):
    found = table_of(exported, "city")
    assert found.num_rows == 12
    assert found.column("building").to_pylist() == list(range(12))
    assert found.column("building_id").to_pylist() == city.building_id.tolist()
    assert found.column("heat_capacity").to_pylist() == city.heat_capacity.tolist()
    assert found.column("material_name").to_pylist()[:3] == ["wood", "steel", "concrete"]


def test_units_and_the_run_are_in_the_metadata(exported, log_path):
    schema = pq.read_schema(exported / "buildings.parquet")
    assert schema.field("water_litres").metadata[b"unit"] == b"litres"
    assert schema.field("temperature").metadata[b"unit"] == b"degrees above ambient"
    assert schema.field("temperature").metadata[b"doc"].startswith(b"degrees above ambient, to the nearest 1/64")
    assert b"unit" not in schema.field("fieryness").metadata
    facts = {key.decode(): text.decode() for key, text in schema.metadata.items()}
    assert (facts["fireworld.scenario"], facts["fireworld.seed"]) == ("synthetic", "7")
    assert facts["fireworld.digest"] == open_log(log_path).digest
    assert facts["fireworld.state"] == "complete"
    assert json.loads(facts["fireworld.units"])["energy"] == "energy units"


def test_every_length_and_amount_has_a_unit():
    columns = [column for table in TABLES.values() for column in table.columns]
    for column in columns:
        if column.name.endswith(("_m", "_m2", "_m3", "_litres")):
            assert column.unit == column.name.rpartition("_")[2]
    assert {column.unit for column in columns if column.name == "hp"} == {"health points"}


def test_rows_are_written_in_groups_so_that_memory_does_not_grow_with_the_log(exported):
    file = pq.ParquetFile(exported / "buildings.parquet").metadata
    sizes = [file.row_group(k).num_rows for k in range(file.num_row_groups)]
    assert sum(sizes) == 31 * 12
    assert max(sizes) < 100 + 12
    assert len(sizes) == 4


def test_the_same_log_gives_the_same_bytes(exported, log_path, tmp_path):
    parquet.export(open_log(log_path), tmp_path / "again", rows_per_group=100)
    for name in TABLES:
        assert (tmp_path / "again" / f"{name}.parquet").read_bytes() == (exported / f"{name}.parquet").read_bytes()


def test_an_empty_field_is_null_and_an_unnamed_number_too(tmp_path, records, city):
    silent = dataclasses.replace(
        records[1].decisions, q_values=np.empty(0), td_error=np.empty(0), action=np.array([-1, 0, 9], np.int32)
    )
    steps = [records[0], dataclasses.replace(records[1], decisions=silent), records[2]]
    parquet.export(open_log(write_log(tmp_path / "a.mcap", steps, city=city)), tmp_path / "a", tables=["decisions"])
    rows = table_of(tmp_path / "a", "decisions").to_pylist()
    assert [row["action_name"] for row in rows[:3]] == [None, "easiest", None]
    assert [row["action"] for row in rows[:3]] == [-1, 0, 9]
    assert [row["q_easiest"] is None for row in rows] == [True] * 3 + [False] * 3
    assert [row["td_error"] is None for row in rows] == [True] * 3 + [False] * 3


def assert_arrays_are_those_of_the_file(run, folder, name):
    arrays, table = table_arrays(run, name), pq.read_table(folder / f"{name}.parquet")
    assert list(arrays) == table.column_names
    for column in TABLES[name].columns:
        held, filed = arrays[column.name], table.column(column.name)
        assert held.tolist() == filed.to_pylist(), column.name
        assert held.dtype == (np.dtype(object) if column.names else np.dtype(column.dtype))
        assert isinstance(held, np.ma.MaskedArray) == (not column.names and filed.null_count > 0)


def test_a_run_in_memory_is_exported_like_its_log(exported, log_path, records, city, tmp_path):
    run = MemoryRecording(synthetic.header(), city, records, digest=open_log(log_path).digest)
    parquet.export(run, tmp_path / "run", rows_per_group=100)
    for name in TABLES:
        assert (tmp_path / "run" / f"{name}.parquet").read_bytes() == (exported / f"{name}.parquet").read_bytes()
    wrong = dataclasses.replace(records[2].brigades, hp=np.array([1, 2], np.int32))
    run = MemoryRecording(synthetic.header(), city, [dataclasses.replace(records[2], brigades=wrong)])
    with pytest.raises(LogError, match=r"^step 2: brigades: hp: expected 3 values, got 2"):
        parquet.export(run, tmp_path / "wrong")


@pytest.mark.parametrize("name", TABLES)
def test_tables_in_memory_are_those_in_the_files(exported, log_path, records, city, tmp_path, name):
    assert_arrays_are_those_of_the_file(open_log(log_path), exported, name)
    assert_arrays_are_those_of_the_file(MemoryRecording(synthetic.header(), city, records), exported, name)
    silent = dataclasses.replace(
        records[1].decisions, q_values=np.empty(0), td_error=np.empty(0), action=np.array([-1, 0, 9], np.int32)
    )
    steps = [records[0], dataclasses.replace(records[1], decisions=silent), records[2]]
    log = open_log(write_log(tmp_path / "silent.mcap", steps, city=city))
    parquet.export(log, tmp_path / "silent", tables=[name])
    assert_arrays_are_those_of_the_file(log, tmp_path / "silent", name)
    empty = open_log(write_log(tmp_path / "empty.mcap", [], city=city))
    parquet.export(empty, tmp_path / "empty", tables=[name])
    assert_arrays_are_those_of_the_file(empty, tmp_path / "empty", name)


def test_a_table_in_memory_needs_no_pyarrow(log_path):
    code = """
import sys
sys.modules["pyarrow"] = None
from fireworld_recorder.reader import open_log
from fireworld_recorder.tables import table_arrays
print(table_arrays(open_log(sys.argv[1]), "decisions")["action_name"][:4].tolist())
"""
    done = subprocess.run([sys.executable, "-c", code, str(log_path)], capture_output=True, text=True, check=True)
    assert done.stdout == f"{[ACTIONS[k] for k in (0, 1, 2, 0)]}\n"


def test_unknown_tables_are_answered_with_those_there_are(log_path, tmp_path):
    message = "table: expected one of city, buildings, .*, steps, got 'building'; try buildings"
    with pytest.raises(LogError, match=message):
        table_arrays(open_log(log_path), "building")
    with pytest.raises(LogError, match=message):
        parquet.export(open_log(log_path), tmp_path / "x", tables=["steps", "building"])
    assert not list(tmp_path.iterdir())


def test_a_log_without_steps_has_tables_without_rows(tmp_path, city):
    rows = parquet.export(open_log(write_log(tmp_path / "a.mcap", [], city=city)), tmp_path / "a")
    assert rows.pop("city") == 12
    assert set(rows.values()) == {0}
    assert table_of(tmp_path / "a", "buildings").schema.names[:2] == ["step", "building"]


def test_fields_of_different_lengths_are_refused_and_nothing_is_left(tmp_path, records, city):
    wrong = dataclasses.replace(records[2].brigades, hp=np.array([1, 2], np.int32))
    steps = [*records[:2], dataclasses.replace(records[2], brigades=wrong)]
    log = open_log(write_log(tmp_path / "a.mcap", steps, city=city))
    with pytest.raises(LogError, match=r"a\.mcap: step 2: /brigades: hp: 2 entries, where the city has 3"):
        parquet.export(log, tmp_path / "out")
    assert [path.name for path in tmp_path.iterdir()] == ["a.mcap"]


def test_a_partial_log_is_exported_as_far_as_it_is_good(run_cli, log_path, tmp_path):
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(log_path.read_bytes()[:30_000])
    n_steps = len(open_log(cut, partial=True))
    code, out, err = run_cli("export", cut, "--parquet", tmp_path / "cut")
    assert code == 0
    assert f"buildings.parquet: {n_steps * 12:,} rows" in out
    assert "partial: the file ends inside a record; good up to step" in err
    assert f"exported {n_steps} committed steps" in err
    assert pq.read_schema(tmp_path / "cut" / "steps.parquet").metadata[b"fireworld.state"] == b"partial"
    code, out, _ = run_cli("export", cut, "--parquet", tmp_path / "b", "--json", "--tables", "steps, events")
    facts = json.loads(out)
    assert (code, facts["state"], sorted(facts["n_rows"])) == (0, "partial", ["events", "steps"])
    assert sorted(path.name for path in (tmp_path / "b").iterdir()) == ["events.parquet", "steps.parquet"]


def test_export_replaces_only_an_export_and_only_with_force(run_cli, log_path, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    assert run_cli("export", log_path, "--parquet", out, "--tables", "city")[0] == 0
    code, _, err = run_cli("export", log_path, "--parquet", out)
    assert code == 2
    assert "got city.parquet in it; use --force to replace it" in " ".join(err.split())
    assert run_cli("export", log_path, "--parquet", out, "--tables", "steps", "--force")[0] == 0
    assert [path.name for path in out.iterdir()] == ["steps.parquet"]
    (out / "notes.txt").write_text("mine")
    code, _, err = run_cli("export", log_path, "--parquet", out, "--force")
    assert code == 2
    assert "notes.txt in it" in err
    code, _, err = run_cli("export", log_path, "--parquet", log_path, "--force")
    assert code == 2
    assert "a file" in err
    (tmp_path / "link").symlink_to(out)
    code, _, err = run_cli("export", log_path, "--parquet", tmp_path / "link", "--force")
    assert code == 2
    assert "a link" in err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["link", "out"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--tables", "streets"), "expected one of city, buildings, brigades"),
        (("missing",), "No such file"),
        (("no/such/folder",), "expected an existing folder"),
    ],
)
def test_mistakes_are_refused_and_leave_nothing(run_cli, log_path, tmp_path, words, message):
    log = tmp_path / "missing.mcap" if words == ("missing",) else log_path
    folder = tmp_path / words[0] / "x" if "folder" in words[0] else tmp_path / "x"
    code, out, err = run_cli("export", log, "--parquet", folder, *(words if words[0] == "--tables" else ()))
    assert (code, out) == (2, "")
    assert message in " ".join(err.split())
    assert not list(tmp_path.iterdir())


def test_an_interrupt_leaves_the_earlier_export_alone(log_path, tmp_path):
    log = open_log(log_path)
    parquet.export(log, tmp_path / "out", tables=["city"])

    def interrupt(record):
        if record.step == 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        parquet.export(log, tmp_path / "out", force=True, on_step=interrupt)
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["city.parquet"]


def test_the_earlier_export_stays_if_the_new_one_cannot_take_its_place(log_path, tmp_path, monkeypatch):
    log = open_log(log_path)
    parquet.export(log, tmp_path / "out", tables=["city"])
    rename = Path.rename

    def refuse(self, target):
        if self.parent.name.startswith(SCRATCH) and self.name == "out":
            raise OSError(28, "No space left on device")
        return rename(self, target)

    monkeypatch.setattr(Path, "rename", refuse)
    with pytest.raises(OutputError, match="out: cannot be written: No space left on device"):
        parquet.export(log, tmp_path / "out", force=True)
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["city.parquet"]


def test_leftovers_of_a_killed_export_are_in_nobodys_way(log_path, tmp_path):
    log = open_log(log_path)
    for name in (".fireworld-0", "out.partial"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "city.parquet").write_bytes(b"half")
    parquet.export(log, tmp_path / "out", tables=["city"])
    assert sorted(path.name for path in tmp_path.iterdir()) == [".fireworld-0", "out", "out.partial"]


def test_without_pyarrow_it_says_what_to_install(run_cli, log_path, tmp_path, monkeypatch):
    monkeypatch.setattr("fireworld.recording.export.find_spec", lambda _: None)
    code, _, err = run_cli("export", log_path, "--parquet", tmp_path / "out")
    assert code == 2
    assert "pip install 'fireworld[archive]'" in err


def test_opens_in_pandas(exported):
    pandas = pytest.importorskip("pandas")
    frame = pandas.read_parquet(exported / "buildings.parquet")
    assert frame.groupby("step")["energy"].sum().shape == (31,)


def test_a_table_in_memory_is_the_same_in_pandas(exported, log_path):
    pandas = pytest.importorskip("pandas")
    for name, table in TABLES.items():
        frame = pandas.DataFrame(table_arrays(open_log(log_path), name))
        for column in table.columns:
            if column.names:
                frame[column.name] = pandas.Categorical(frame[column.name], categories=column.names)
        pandas.testing.assert_frame_equal(frame, pandas.read_parquet(exported / f"{name}.parquet"))


def test_opens_in_polars(exported):
    polars = pytest.importorskip("polars")
    frame = polars.read_parquet(exported / "decisions.parquet")
    assert set(frame["action_name"]) <= set(ACTIONS)


def test_opens_in_duckdb(exported):
    duckdb = pytest.importorskip("duckdb")
    found = duckdb.read_parquet(str(exported / "buildings.parquet")).aggregate("max(step), count(*)").fetchall()
    assert found == [(30, 31 * 12)]


def test_of_many_exports_at_once_the_last_wins_whole(log_path, tmp_path):
    def export(_):
        return parquet.export(open_log(log_path), tmp_path / "out", tables=["city", "steps"], force=True)

    with ThreadPoolExecutor(12) as pool:
        assert len({tuple(rows.items()) for rows in pool.map(export, range(24))}) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["city.parquet", "steps.parquet"]
