"""`leaderboard`: ranks and intervals, results that accumulate, other simulators, pages, Ctrl-C, mistakes."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from threading import Event

import numpy as np
import pytest

import fireworld as fw
from fireworld.errors import FireworldError
from fireworld.evaluation import comparison_runs
from fireworld.evaluation.board import BoardSuite, Leaderboard
from fireworld.evaluation.inputs import rows_of
from fireworld.evaluation.results import Result, Results, RunKey, read_results
from fireworld.evaluation.standings import Standing, known_policies, standings_of
from fireworld.evaluation.statistics import estimate, estimate_over
from fireworld.interrupt import Interrupted
from fireworld.policy.names import find_policy
from tests.evaluation.interrupting import interrupt_fourth_run

pytestmark = pytest.mark.usefixtures("policies_file")
QUICK = ("--suites", "quick", "--seeds", 3)
ROWS = rows_of(["three-sites", "quick", "tests"], {})
N_FIRES = len(ROWS.scenarios)


def made_up(shares, *, version="now"):
    """Runs of policies that reach a share, by name: of (row, seed), or one of all; None: no such run."""
    known = Results(None)
    for name, of in shares.items():
        for row, within in ROWS.within.items():
            for seed in (1, 2, 3):
                share = of.get((row, seed), of.get(row, 0.5)) if isinstance(of, dict) else of
                for label in within if share is not None else ():
                    key = RunKey(ROWS.scenarios[label].digest, f"{name}-digest", seed, version)
                    known.add(key, Result(label, name, (share * 9, 9.0, 0, 9, True, 8, 0.0, 0.0)))
    return known


def stand(shares, *, seeds=(1, 2, 3)):
    known = made_up(shares)
    return standings_of(known_policies(known, ROWS)["now"], ROWS, seeds, known, "now")


def test_the_best_mean_over_suites_is_first_and_every_suite_counts_the_same():
    found = stand({"low": 0.25, "sites": {"three-sites": 1.0, "quick": 0.0, "tests": 0.0}, "top": 0.75})
    assert [(one.rank, one.name) for one in found] == [(1, "top"), (2, "sites"), (3, "low")]
    assert [one.overall.mean for one in found] == pytest.approx([0.75, 1 / 3, 0.25])
    assert [one.digest for one in found] == ["top-digest", "sites-digest", "low-digest"]


def test_equals_share_a_rank():
    found = stand({"a": 0.5, "b": 0.5, "c": 0.25})
    assert [(one.rank, one.name) for one in found] == [(1, "a"), (1, "b"), (3, "c")]


def test_a_seed_counts_where_all_of_its_runs_are_known_and_without_all_suites_there_is_no_rank():
    gaps = {("quick", 2): None, ("tests", 1): None, ("tests", 2): None, ("tests", 3): None}
    first, second = stand({"whole": 0.1, "gaps": gaps})
    assert (first.name, first.rank, first.n_seeds) == ("whole", 1, 3)
    assert (second.name, second.rank, second.overall) == ("gaps", None, None)
    assert {row: cell.n_seeds for row, cell in second.cells.items()} == {"three-sites": 3, "quick": 2}
    assert stand({"whole": 0.1}, seeds=(8, 9))[0].cells == {}
    assert stand({"whole": 0.1}, seeds=(2, 9))[0].n_seeds == 1


def test_drawn_fires_are_drawn_anew_and_the_three_tests_are_not():
    (found,) = stand({"one": {("three-sites", 1): 0.0, ("three-sites", 2): 1.0}})
    assert found.cells["three-sites"].n_repetitions == 12
    assert found.cells["tests"].n_repetitions == found.cells["quick"].n_repetitions == 1


def test_what_is_estimated_over_tables():
    tables = [np.array([[0.0, 1.0], [1.0, 1.0]]), np.array([[0.5, 0.25]])]
    both = estimate_over(tables)
    assert both.mean == (0.75 + 0.375) / 2
    assert both.low < both.mean < both.high
    assert (both.n_repetitions, both.n_seeds) == (2, 2)
    assert estimate_over(tables[:1]) == estimate(tables[0])
    alike = estimate_over([tables[0], tables[0]])
    assert alike == estimate(tables[0]), "tables of one shape are resampled alike"


@pytest.mark.slow
def test_runs_are_those_of_compare(tmp_path):
    words = {"seeds": 2, "results": tmp_path / "runs.parquet"}
    board = fw.leaderboard(["nearest-to-me", "easiest"], suites=["three-sites", "quick"], **words)
    done = []
    comparison = fw.compare(
        ["nearest-to-me", "easiest"],
        scenarios=["three-sites", "quick"],
        on_run=lambda n_done, n_all: done.append((n_done, n_all)),
        **words,
    )
    assert done == [(52, 52)], "all are known"
    rows = {row["scenario"]: row for row in comparison.table if row["metric"] == "score"}
    for name, side in (("nearest-to-me", "a"), ("easiest", "b")):
        standing = board.of(name)
        assert standing.overall.mean == pytest.approx(rows[None][side]["mean"])
        for suite, cell in standing.cells.items():
            assert cell.mean == pytest.approx(rows[suite][side]["mean"])
    with pytest.raises(KeyError):
        board.of("chief")


def test_rows_accumulate_and_are_ranked_together(fireworld, here):
    words = (*QUICK, "--results", "board.parquet")
    alone = fireworld("leaderboard", "each-another", *words, "--json")
    assert (alone.code, alone.err) == (0, "")
    more = fireworld("leaderboard", "easiest", "policies:Near", *words, "--json")
    assert (more.code, more.err) == (0, "")
    found = json.loads(more.out)
    assert list(found) == ["format", "version", "first_seed", "n_seeds", "suites", "policies", "apart", "notes"]
    assert (found["format"], found["first_seed"], found["n_seeds"]) == ("fireworld-leaderboard/1", 1, 3)
    assert {one["name"] for one in found["policies"]} == {"each-another", "easiest", "policies:Near"}
    assert [one["rank"] for one in found["policies"]] == [1, 2, 3]
    (before,) = json.loads(alone.out)["policies"]
    again = next(one for one in found["policies"] if one["name"] == "each-another")
    assert {**again, "rank": 1} == before
    assert list(before) == ["rank", "name", "digest", "overall", "suites"]
    assert before["digest"] == find_policy("each-another").digest
    assert list(before["suites"]["quick"]) == ["mean", "low", "high", "n_seeds"]
    shown = fireworld("leaderboard", *words, "--json")
    assert json.loads(shown.out) == found, "nobody is named, so those that are known are shown"
    fewer = json.loads(fireworld("leaderboard", "chief", *QUICK[:2], "--seeds", 1, *words[-2:], "--json").out)
    assert {one["suites"]["quick"]["n_seeds"] for one in fewer["policies"]} == {1}, "the same seeds for all"


def test_what_another_simulator_measured_stands_apart(fireworld, here, monkeypatch):
    words = (*QUICK, "--results", "board.parquet")
    monkeypatch.setattr(comparison_runs, "simulator_version", lambda: "0.0.1+old")
    monkeypatch.setattr("fireworld.evaluation.leaderboard.simulator_version", lambda: "0.0.1+old")
    assert fireworld("leaderboard", "each-another", "easiest", *words).code == 0
    monkeypatch.undo()
    os.chdir(here)
    done = fireworld("leaderboard", "easiest", *words)
    assert done.code == 0, done.err
    ranked, _, apart = done.out.partition("apart: measured by another simulator, fireworld 0.0.1+old\n")
    assert "each-another" not in ranked
    assert "easiest" in ranked
    assert "each-another" in apart
    found = json.loads(fireworld("leaderboard", *words, "--json").out)
    assert [one["name"] for one in found["policies"]] == ["easiest"]
    assert {one["name"] for one in found["apart"]["0.0.1+old"]} == {"each-another", "easiest"}
    assert "Apart: fireworld 0.0.1+old" in fw.leaderboard(suites="quick", seeds=3, results="board.parquet").page()


def test_the_table_fits_in_eighty_columns_and_ranks(fireworld):
    done = fireworld("leaderboard", "chief", "planner:horizon=5,interval=10", "--suites", "quick", "--seeds", 1)
    assert (done.code, done.err) == (0, "")
    assert all(len(line) <= 80 for line in done.out.splitlines())
    assert "planner:horizon=5..." in done.out
    assert done.out.startswith("policies: 2, suites: 1, scenarios: 1; seed 1\nfireworld 0.")
    assert "intervals of fewer than 20 seeds are too narrow" in done.out
    board = fw.leaderboard(["chief", "best"], suites=["quick", "three-sites"], seeds=1)
    assert all(len(line) <= 80 for line in repr(board).splitlines())
    assert board._repr_html_().count("<table>") == 1


def test_the_widest_table_has_eighty_columns():
    cell = estimate(np.array([[1.0, 1.0], [0.99, 0.99]]))
    names = [f"{k:02} {'n' * 30}" for k in range(120)]
    suites = tuple(BoardSuite("a-suite-of-a-long-name", "", "", 20) for _ in range(5))
    standings = tuple(Standing(name, "", {suites[0].name: cell}, cell, 1 + k) for k, name in enumerate(names))
    lines = repr(Leaderboard(suites, range(1, 10_001), "0.1.0+" + "0" * 12, standings)).splitlines()
    assert max(map(len, lines)) == 80
    assert any("[.99, 1.0]" in line for line in lines)


def test_a_page_and_a_table_for_pages(fireworld, here):
    words = ("leaderboard", "chief", "each-another", *QUICK, "--html", "board.html")
    assert fireworld(*words, "--markdown").out.startswith("| rank | policy | seeds | overall | quick (1) |\n| --- |")
    page = (here / "board.html").read_text()
    assert page.startswith("<!doctype html>")
    assert "src=" not in page.replace('src="data:', "")
    for word in ("Leaderboard", "each-another", "chief", "quick", find_policy("chief").digest[:12], "seeds 1 to 3"):
        assert word in page
    again = fireworld(*words)
    assert (again.code, again.out) == (2, "")
    assert "board.html: expected a name that is free" in again.err
    assert fireworld(*words, "--force").code == 0


def test_names_are_shown_as_they_are():
    board = fw.leaderboard([lambda _: "easiest"], suites="quick", seeds=1)
    assert "&lt;lambda&gt;" in board.page()
    assert "<lambda>" not in board.page()


def test_ctrl_c_keeps_what_is_done_and_resume_goes_on(fireworld, here, monkeypatch):
    go_on = interrupt_fourth_run(monkeypatch)
    words = ("leaderboard", "chief", "easiest", "--suites", "quick", "--jobs", 1, "--results", "board.parquet")
    done = fireworld(*words)
    assert (done.code, done.out) == (130, "")
    n_kept = len(read_results(here / "board.parquet"))
    assert 0 < n_kept < 40
    assert done.err == f"interrupted; {n_kept} of 40 runs were done: they are kept in board.parquet\n"
    go_on()
    again = fireworld(*words, "--resume", "--json")
    assert (again.code, again.err) == (0, f"{n_kept} of 40 runs are known from board.parquet\n")
    assert again.out == fireworld(*words[:-2], "--json").out


def test_it_can_be_stopped():
    stop = Event()
    stop.set()
    with pytest.raises(Interrupted, match="of 40 runs were done: with --results they would"):
        fw.leaderboard(["chief", "easiest"], suites="quick", stop=stop)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((), "name --results that hold runs"),
        (("boss",), "--policy: expected one of"),
        (("chief", "--suites", "largr"), "got 'largr'; try larger"),
        (("chief", "--suites", ""), "expected"),
        (("chief", "--suites", "tests,tests"), "scenarios: expected each scenario once"),
        (("chief", "--seeds", "0"), "Invalid value for '--seeds'"),
        (("chief", "--resume"), "--resume goes with --results"),
        (("chief", "--resume", "--results", "no.parquet"), "no.parquet: expected the results of an interrupted call"),
        (("--results", "no.parquet"), "policies: expected one policy or more"),
        (("chief", "--results", "policies.py"), "policies.py: expected a results file"),
        (("chief", "--force"), "--force goes with --html"),
        (("chief", "--json", "--markdown"), "--json and --markdown exclude each other"),
        (("chief", "--html", "no/such/page.html"), "no/such"),
    ],
)
def test_mistakes_take_one_line(fireworld, here, words, message):
    done = fireworld("leaderboard", *words)
    assert (done.code, done.out) == (2, "")
    assert message in done.err
    assert not (here / "no.parquet").exists()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({"policies": 3}, 'policies: expected a list, as in ["chief", "best"], got 3'),
        ({"policies": ["chief"], "resume": True}, "resume: expected results to continue"),
        ({"policies": ["chief"], "suites": 3}, "scenarios: expected one or more names"),
    ],
)
def test_mistakes_from_python(here, words, message):
    with pytest.raises(FireworldError) as caught:
        fw.leaderboard(**words)
    assert message in str(caught.value)


def test_a_failing_policy_says_where_and_loses_no_run(fireworld, here):
    words = ("leaderboard", "chief", "policies:Failing", *QUICK, "--results", "board.parquet", "--jobs", 1)
    done = fireworld(*words)
    assert (done.code, done.out) == (2, "")
    assert "fireworld: quick, seed " in done.err
    assert len(read_results(here / "board.parquet")) == 3, "those of the other policy"


def test_help_imports_nothing_heavy():
    code = (
        "import sys; from fireworld.cli.leaderboard import command\n"
        "try: command.main(['--help'])\n"
        "except SystemExit: pass\n"
        "print({'numba', 'numpy', 'pyarrow', 'matplotlib', 'rich'} & sys.modules.keys())"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=os.environ)
    assert done.stdout.endswith("set()\n"), done.stdout
