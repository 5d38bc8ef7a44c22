"""The file of results: what is kept is found again, nothing is lost, and what is none of ours is left alone."""

from __future__ import annotations

import contextlib

import grimp
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from fireworld import version
from fireworld.errors import OutputError
from fireworld.evaluation.results import KEYS, Result, Results, RunKey, open_results, read_results
from fireworld.outcome import COLUMNS
from fireworld.policy.kernel import always
from fireworld.policy.names import NamedPolicy, find_policy

ROW = (9.5, 12.0, 3, 77, True, 11, -123.25, 4000.0)


def key(seed, scenario="aa"):
    return RunKey(scenario, "bb", seed, "1.0+cc")


def filled(path, seeds):
    path.unlink(missing_ok=True)
    made = Results(path)
    for seed in seeds:
        made.add(key(seed), Result("quick", "chief", ROW))
    made.save()
    return path.read_bytes()


@pytest.fixture
def path(tmp_path):
    made = tmp_path / "runs.parquet"
    filled(made, range(200))
    return made


def test_what_is_written_is_read(path):
    found = open_results(path)
    assert len(found.by_run) == 200
    assert found.by_run[key(7)] == Result("quick", "chief", ROW)
    assert found.n_unsaved == 0
    assert [type(value) for value in found.by_run[key(7)].row] == [float, float, int, int, bool, int, float, float]


def test_a_row_is_the_quantities_in_their_order(path):
    assert pq.read_schema(path).names == [*KEYS, *COLUMNS]
    assert pq.read_table(path).to_pylist()[7] == {
        "scenario": "quick", "policy": "chief", "scenario_digest": "aa", "policy_digest": "bb", "seed": 7,
        "version": "1.0+cc", "score": 9.5, "score_max": 12.0, "burnt_out": 3, "steps": 77, "completed": True,
        "civilians_alive": 11, "total_reward": -123.25, "water_litres": 4000.0,
    }  # fmt: skip


def test_equal_results_give_equal_bytes_whatever_their_order(tmp_path):
    path = tmp_path / "new.parquet"
    assert filled(path, range(50)) == filled(path, reversed(range(50)))


def test_rows_that_came_in_meanwhile_are_kept(path):
    mine = open_results(path)
    theirs = open_results(path)
    theirs.add(key(1000), Result("quick", "chief", ROW))
    theirs.save()
    mine.add(key(2000), Result("quick", "chief", ROW))
    mine.save()
    assert {1000, 2000, 0, 199} <= {known.seed for known in read_results(path)}


def test_every_damaged_byte_is_noticed_or_harmless(path):
    good, whole, n_unnoticed = path.read_bytes(), read_results(path), 0
    for place in range(0, len(good), len(good) // 60):
        path.write_bytes(good[:place] + bytes([good[place] ^ 0x40]) + good[place + 1 :])
        with contextlib.suppress(OutputError):
            assert read_results(path) == whole
            n_unnoticed += 1
    assert n_unnoticed < 30, "page headers and what nothing reads"


@pytest.mark.parametrize("content", [b"", b"PAR1", b"not a table", b"PAR1" + bytes(100) + b"PAR1"])
def test_a_foreign_file_is_refused_and_left(path, content):
    path.write_bytes(content)
    with pytest.raises(OutputError, match="expected a results file") as caught:
        open_results(path)
    assert "\n" not in str(caught.value)
    assert path.read_bytes() == content


def test_a_cut_off_file_is_refused(path):
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(OutputError, match="expected a results file"):
        open_results(path)


def test_another_table_is_refused(path):
    pq.write_table(pa.table({"score": [1.0]}), path)
    with pytest.raises(OutputError, match="other columns"):
        open_results(path)
    table = pa.Table.from_pylist(pq.read_table(path).to_pylist())
    pq.write_table(table.replace_schema_metadata({"format": "fireworld-results/2"}), path)
    with pytest.raises(OutputError, match="later fireworld"):
        open_results(path)


def test_two_outcomes_of_one_run_are_refused(path):
    table = pq.read_table(path)
    rows = [*table.to_pylist(), {**table.to_pylist()[3], "score": 1.0}]
    pq.write_table(pa.Table.from_pylist(rows, schema=table.schema), path)
    with pytest.raises(OutputError, match="two outcomes of quick, chief, seed 3"):
        open_results(path)


def test_no_folder_no_results(tmp_path):
    with pytest.raises(OutputError, match="no folder"):
        open_results(tmp_path / "nowhere" / "runs.parquet")
    with pytest.raises(OutputError, match="Is a directory"):
        open_results(tmp_path)


def test_without_a_file_nothing_is_imported_or_written():
    assert open_results(None).by_run == {}


class Own:
    def decide(self, observation): ...


class Telling(Own):
    digest = "what it reads"


def test_what_tells_policies_apart():
    """A digest of a file says little of the classes in it; a digest of what a policy does says all."""
    assert find_policy("chief").identity == find_policy("chief").digest
    assert NamedPolicy("any:name", "of the file", always(2)).identity == always(2).digest
    assert NamedPolicy("m:Own", "of the file", Own()).identity == "of the file:Own"
    assert NamedPolicy("m:Telling", "of the file", Telling()).identity == "what it reads"


def test_the_version_follows_all_that_computes_a_run():
    """What the runs import is digested, but for what makes no run: errors, executors, pages, names of measures."""
    graph = grimp.build_graph("fireworld")
    needed = graph.find_upstream_modules("fireworld.evaluation.runs")
    needed |= graph.find_upstream_modules("fireworld.planning.planner")
    parts = {name.split(".")[1] for name in needed - {"fireworld"}}
    no_run = {"errors", "evaluation", "executors", "files", "html_page", "interrupt", "npz", "outcome", "records"}
    no_run |= {"shown", "version"}
    assert parts - no_run <= {name.removesuffix(".py") for name in version._SIMULATOR}
    assert version.simulator_version().startswith("0.")
