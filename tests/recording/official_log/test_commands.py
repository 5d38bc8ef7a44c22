"""What the commands do with an imported log: they show what it has, and say "not recorded" of the rest."""

import json

import pytest

import fireworld as fw
from tests.recording.official_log import writer
from tests.recording.official_log.writer import Log


@pytest.fixture
def other(written):
    """The same town on another day: a building that burns longer."""
    steps = writer.steps()
    steps[3] = [(writer.BUILDING, 3, {writer.FIERYNESS: 2, writer.TEMPERATURE: 70})]
    fw.import_log(written("town.log", Log(steps=steps)), "other.mcap")
    return "other.mcap"


def test_import_tells_what_it_made(fireworld, written):
    done = fireworld("import-log", written("real.log.xz"), "-o", "town.mcap")
    assert (done.code, done.err) == (0, "")
    assert done.out.splitlines() == [
        "real.log.xz: protobuf, xz, numbers of 2022 and later",
        f"town.mcap: 7 steps, up to step 6, digest {fw.open_log('town.mcap').digest}",
        "3 buildings, 2 civilians; 1 other rescuers are left out",
        "score 1.145 of 3, by today's rule 0.082",
        "1.235 by the kernel's own LegacyScoreFunction and its factors",
    ]


def test_import_as_json(fireworld, written):
    done = fireworld("import-log", written("town.log"), "-o", "town.mcap", "--json")
    found = json.loads(done.out)
    assert found["n_steps"] == 7
    assert found["damage"] is None
    assert found["official"]["function"] == "LegacyScoreFunction"
    assert found["outcome"]["score"] == pytest.approx(1.145, abs=1e-3)
    assert "total_reward" not in found["outcome"]
    assert "water_used_litres" not in found["outcome"]


def test_a_cut_off_log_is_exit_code_1_and_a_foreign_one_2(fireworld, here, written):
    written("town.log", Log(end=False))
    done = fireworld("import-log", "town.log", "-o", "town.mcap")
    assert done.code == 1
    assert done.err == "town.log: cut off: it has no end record; imported up to step 6\n"
    (here / "foreign").write_bytes(b"foreign")
    done = fireworld("import-log", "foreign", "-o", "x.mcap")
    line = "fireworld: foreign: expected the log of an official kernel, got a file that begins with b'foreign'\n"
    assert (done.code, done.out, done.err) == (2, "", line)


def test_info_says_what_is_not_recorded(fireworld, imported):
    done = fireworld("info", imported)
    assert done.code == 0
    assert "origin       official log: protobuf, numbers of 2021\n" in done.out
    assert "scenario     row (" in done.out
    assert "return not recorded, water used not recorded" in done.out
    assert "not recorded brigades.activity, " in done.out
    assert "nan" not in done.out.lower().replace("finance", "")
    for topic in ("/decisions", "/rewards", "/draws", "/observations", "/snapshot"):
        assert topic not in done.out
    found = json.loads(fireworld("info", imported, "--json").out)
    assert found["totals"]["sum_of_rewards"] is None
    assert found["totals"]["water_used_litres"] is None


def test_schema_of_an_imported_log_is_what_it_has(fireworld, imported):
    topics = {
        topic["topic"]: topic for topic in json.loads(fireworld("info", imported, "--schema", "--json").out)["topics"]
    }
    assert [*topics] == ["/city", "/brigades", "/buildings", "/civilians", "/score", "/events", "/commit"]
    assert [item["name"] for item in topics["/buildings"]["fields"]] == ["temperature", "fieryness"]
    assert "buriedness" in [item["name"] for item in topics["/civilians"]["fields"]]


def test_a_run_s_own_log_declares_no_field_of_imported_ones(fireworld):
    topics = {topic["topic"]: topic for topic in json.loads(fireworld("info", "--schema", "--json").out)["topics"]}
    assert [item["name"] for item in topics["/civilians"]["fields"]] == ["hp", "damage"]


@pytest.mark.parametrize(
    "words",
    [
        ("verify", "town.mcap"),
        ("fork", "town.mcap", "--at", "2"),
        ("explain", "town.mcap", "other.mcap"),
        ("view", "town.mcap", "--air", "--save", "x.rrd"),
        ("replay", "town.mcap", "--scenario", "row", "--episode", "0", "-o", "x.mcap"),
    ],
    ids=lambda words: words[0],
)
def test_what_cannot_be_replayed_says_why_in_one_line(fireworld, imported, other, words):
    done = fireworld(*words)
    assert (done.code, done.out) == (2, "")
    assert done.err.count("\n") == 1
    why = "not of a training" if words[0] == "replay" else "no decisions to replay"
    assert why in done.err


def test_runs_of_one_scenario_are_compared(fireworld, imported, other):
    done = fireworld("diff", imported, imported)
    assert (done.code, done.out.startswith("the same: 7 steps")) == (0, True)
    done = fireworld("diff", imported, other)
    assert done.code == 1
    assert "step 4" in done.out
    assert "not recorded" in done.out
    assert "nan" not in done.out.lower()
    found = json.loads(fireworld("diff", imported, other, "--json").out)
    assert found["first"]["field"] in {"temperature", "fieryness"}
    assert "NaN" not in json.dumps(found)


def test_columns_that_are_not_recorded_are_null(fireworld, imported):
    pq = pytest.importorskip("pyarrow.parquet")
    assert fireworld("export", imported, "--parquet", "tables").code == 0
    steps = pq.read_table("tables/steps.parquet").to_pydict()
    for name in ("draw_key", "reward_total", "sum_so_far", "reward_sum_so_far", "water_used_litres", "epsilon"):
        assert set(steps.get(name, [None])) == {None}
    assert steps["score"][0] == 3
    buildings = pq.read_table("tables/buildings.parquet").to_pydict()
    assert set(buildings["energy"]) == {None}
    assert buildings["fieryness"][-2:] == [8, 5]
    assert pq.read_table("tables/civilians.parquet").to_pydict()["in_building"][0] == 1
    assert pq.read_table("tables/decisions.parquet").num_rows == 0


def test_pandas_tables_have_no_values_there(imported):
    pytest.importorskip("pandas")
    assert fw.open_log(imported).to_pandas("steps")["reward_total"].isna().all()


def test_pictures_of_an_imported_log(fireworld, here, imported):
    pytest.importorskip("matplotlib")
    for name in ("town.png", "town.gif"):
        assert fireworld("render", imported, "-o", name).code == 0
        assert (here / name).stat().st_size > 1000
    assert b"PNG" in fw.open_log(imported).show(-1)._repr_png_()[:8]


def test_a_page_of_an_imported_log(fireworld, here, imported):
    pytest.importorskip("matplotlib")
    assert fireworld("report", imported, "-o", "town.html").code == 0
    page = (here / "town.html").read_text()
    assert "<p>town.mcap: not recorded.</p>" in page
    assert "Where it comes from" in page
    assert "Rewards are" not in page
    assert "fireworld run" not in page
    assert fireworld("report", imported, imported, "-o", "two.html").code == 0


@pytest.mark.slow
def test_an_imported_log_in_rerun(fireworld, here, imported, other):
    pytest.importorskip("rerun")
    assert fireworld("view", imported, "--save", "one.rrd").code == 0
    assert fireworld("view", imported, other, "--save", "two.rrd").code == 0
    assert (here / "one.rrd").stat().st_size > 1000


def test_recover_keeps_what_it_is(here, fireworld, imported):
    data = (here / imported).read_bytes()
    (here / "cut.mcap").write_bytes(data[: len(data) // 2])
    done = fireworld("recover", "cut.mcap", "-o", "good.mcap")
    assert done.code == 0
    assert fw.open_log("good.mcap").header == fw.open_log(imported).header


def test_runs_show_themselves(imported):
    run = fw.open_log(imported)
    assert repr(run).startswith("<Run row, official-agents, seed 17: score 1.145 of 3")
    assert "not recorded" in run._repr_html_()
    assert run.outcome.time_to_complete is None
