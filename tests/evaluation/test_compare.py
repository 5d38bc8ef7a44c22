"""`fireworld compare`: runs, verdicts, the gate's exit codes, files, resuming, Ctrl-C, mistakes."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from xml.etree.ElementTree import parse

import pytest

from fireworld.evaluation import comparison_runs
from fireworld.evaluation.results import read_results
from fireworld.policy.names import find_policy
from fireworld.policy.teams.table_team import TableTeam
from tests.evaluation.interrupting import interrupt_fourth_run

pytestmark = pytest.mark.usefixtures("policies_file")
QUICK = ("--scenarios", "quick", "--set", "steps=60")
BAD_FIRST = ("nearest-to-me", "nearest-to-civilian")
"""A policy that loses a civilian under every seed, and one that loses none."""


def compared(call, *words):
    done = call("compare", *words, "--json")
    assert done.code == 0, done.err
    return json.loads(done.out)


def row(found, metric="score", scenario=None):
    (chosen,) = [
        each for each in found["comparisons"] if (each["scenario"], each["metric"]) == (scenario, metric)
    ]  # fmt: skip
    return chosen


@pytest.mark.parametrize("policy", ["random", "policies:Near", "planner:horizon=5,interval=10"])
def test_runs_are_those_of_the_command_run(fireworld, policy):
    found = compared(fireworld, "each-another", policy, *QUICK, "--seeds", 1, "--first-seed", 7)
    assert found["b"]["name"] == policy
    done = fireworld("run", "quick", "--set", "steps=60", "--policy", policy, "--seed", 7, "--json")
    outcome = json.loads(done.out)
    assert row(found)["b"]["mean"] == outcome["score"] / outcome["score_max"]
    assert row(found, "burnt-out")["b"]["mean"] == outcome["n_burnt_out"]
    assert row(found, "time")["b"]["mean"] == outcome["steps"]
    assert row(found, "time")["b"]["n_truncated"] == (outcome["ended"] == "truncated")
    assert row(found, "civilians")["b"]["mean"] == outcome["n_civilians_alive"]


@pytest.mark.slow
def test_a_policy_asked_step_by_step_meets_its_compiled_twin_in_processes_too(fireworld):
    words = ("nearest-to-me", "policies:Near", *QUICK, "--seeds", 16)
    alone = compared(fireworld, *words, "--jobs", 1)
    assert not alone["same_policy"]
    for each in alone["comparisons"]:
        assert (each["n_differing"], each["verdict"], each["reason"]) == (0, "equal", "")
    assert compared(fireworld, *words, "--jobs", 2) == alone


def test_json_has_what_its_page_says(fireworld):
    found = compared(fireworld, *BAD_FIRST, "--scenarios", "quick,train-5", "--set", "steps=20", "--seeds", 6)
    assert list(found) == [
        "format", "version", "a", "b", "same_policy", "scenarios", "first_seed", "n_seeds", "comparisons", "gate",
        "sentence", "notes",
    ]  # fmt: skip
    assert found["format"] == "fireworld-comparison/1"
    assert found["a"] == {"name": BAD_FIRST[0], "digest": find_policy(BAD_FIRST[0]).digest}
    assert [scenario["name"] for scenario in found["scenarios"]] == ["quick", "train-5"]
    assert (found["first_seed"], found["n_seeds"], found["gate"]) == (1, 6, None)
    assert [(each["scenario"], each["metric"]) for each in found["comparisons"]] == [
        (scenario, metric)
        for scenario in ("quick", "train-5", None)
        for metric in ("score", "burnt-out", "time", "civilians")
    ]
    assert list(row(found)) == [
        "scenario", "metric", "unit", "higher_is_better", "a", "b", "difference", "improvement",
            "pairing_worth", "n_differing",
        "verdict", "more_seeds", "reason",
    ]  # fmt: skip
    assert list(row(found)["a"]) == ["mean", "interquartile_mean", "n_truncated"]
    assert list(row(found)["difference"]) == list(row(found)["improvement"]) == ["mean", "low", "high"]
    assert found == compared(fireworld, *BAD_FIRST, "--scenarios", "quick,train-5", "--set", "steps=20", "--seeds", 6)


def test_people_get_a_table_a_sentence_and_what_to_mind(fireworld, monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    done = fireworld("compare", *BAD_FIRST, *QUICK, "--seeds", 6)
    assert (done.code, done.err) == (0, "")
    assert "…" not in done.out
    assert "over all" not in done.out, "of one scenario"
    *_, truncated, few, sentence = done.out.splitlines()
    assert truncated.startswith("the fire was not out at the last step in 6 of 6 runs of A and ")
    assert few == "intervals of fewer than 20 seeds are too narrow; verdicts need more"
    assert sentence.startswith("nearest-to-civilian against nearest-to-me: score better: +")
    assert "(quick; seeds 1 to 6; fireworld 0." in sentence
    assert "over all" in fireworld("compare", *BAD_FIRST, "--scenarios", "quick,train-5", "--set", "steps=5").out


@pytest.mark.parametrize(
    ("policies", "options", "code", "said"),
    [
        (BAD_FIRST, (), 0, "gate: score: not worse"),
        (BAD_FIRST[::-1], (), 1, "gate: score: worse"),
        (BAD_FIRST[::-1], ("--margin", 0.9), 0, "gate: score, margin 0.9 of the maximum: not worse"),
        (BAD_FIRST[::-1], ("--gate-metric", "burnt-out"), 1, "gate: burnt out: worse"),
        (BAD_FIRST[::-1], ("--seeds", 2), 3, "gate: score: cannot tell, at least 4 more seeds are needed"),
        (("chief", "chief"), ("--seeds", 1), 0, "chief against chief: the same policy"),
        (("policies:Near", "policies:Near"), ("--seeds", 1), 0, "the same policy"),
    ],
)
def test_the_gate_is_an_exit_code(fireworld, policies, options, code, said):
    words = ("compare", *policies, *QUICK, "--seeds", 6, *options)
    gated = fireworld(*words, "--gate")
    assert (gated.code, said in gated.out) == (code, True), gated.out + gated.err
    assert fireworld("compare", *policies, *QUICK, "--seeds", 1).code == 0
    plain = json.loads(fireworld(*words, "--gate", "--json").out)["gate"]["judgement"]
    assert plain == {0: "not worse", 1: "worse", 3: "cannot tell"}[code]


@pytest.mark.parametrize(
    ("policies", "seeds", "wrong"),
    [(BAD_FIRST, 6, None), (BAD_FIRST[::-1], 6, "failure"), (BAD_FIRST, 2, "error")],
)
def test_junit_fails_as_the_gate_does(fireworld, here, policies, seeds, wrong):
    assert fireworld("compare", *policies, *QUICK, "--seeds", seeds, "--junit", "out.xml").code == 0
    suite = parse(here / "out.xml").getroot().find("testsuite")
    cases = {(case.get("classname"), case.get("name")): case for case in suite.findall("testcase")}
    assert len(cases) == int(suite.get("tests")) == 8
    failed = [
        name for name, case in cases.items() if case.find("failure") is not None or case.find("error") is not None
    ]
    assert failed == ([("fireworld.compare.over all", "score")] if wrong else [])
    assert (suite.get("failures"), suite.get("errors")) == (str(int(wrong == "failure")), str(int(wrong == "error")))
    assert "gate: score: " in cases["fireworld.compare.over all", "score"].find("system-out").text


@pytest.mark.slow
def test_a_plot_is_drawn_and_not_drawn_over(fireworld, here):
    words = ("compare", *BAD_FIRST, *QUICK, "--seeds", 2, "--plot", "out.png")
    assert fireworld(*words).code == 0
    first = (here / "out.png").read_bytes()
    assert first.startswith(b"\x89PNG")
    again = fireworld(*words)
    assert (again.code, again.out, again.err) == (
        2,
        "",
        "fireworld: out.png: expected a name that is free, got an existing file; use --force to replace it\n",
    )
    assert fireworld(*words, "--force").code == 0
    assert (here / "out.png").read_bytes() == first


def test_known_runs_are_not_run_again(fireworld, here, monkeypatch):
    words = ("compare", *BAD_FIRST, *QUICK, "--results", "runs.parquet")
    assert fireworld(*words, "--seeds", 3).err == ""
    more = fireworld(*words, "--seeds", 5, "--json")
    assert more.err == "6 of 10 runs are known from runs.parquet\n"
    assert json.loads(more.out) == compared(fireworld, *BAD_FIRST, *QUICK, "--seeds", 5)
    assert len(read_results(here / "runs.parquet")) == 10
    kept = (here / "runs.parquet").read_bytes()

    def no_run(*_, **__):
        raise AssertionError

    monkeypatch.setattr(comparison_runs, "run_compiled", no_run)
    known = fireworld(*words, "--seeds", 5, "--json")
    assert (known.code, known.err) == (0, "10 of 10 runs are known from runs.parquet\n")
    assert json.loads(known.out) == json.loads(more.out)
    assert (here / "runs.parquet").read_bytes() == kept


def test_another_policy_scenario_seed_or_simulator_is_another_run(fireworld, here, monkeypatch):
    def n_rows(*words):
        assert fireworld("compare", *words, "--seeds", 1, "--results", "runs.parquet").code == 0
        return len(read_results(here / "runs.parquet"))

    assert n_rows("policies:Near", "policies:Values", *QUICK) == 2, "two classes of one file"
    assert n_rows("policies:Near", "easiest", *QUICK) == 3
    assert n_rows("policies:Near", "easiest", *QUICK, "--first-seed", 2) == 5
    assert n_rows("easiest", "easiest", "--scenarios", "quick", "--set", "steps=41") == 6
    policies = here / "policies.py"
    policies.write_text(policies.read_text() + "\n")
    assert n_rows("policies:Near", "easiest", *QUICK) == 7, "its file has changed"
    monkeypatch.setattr(comparison_runs, "simulator_version", lambda: "another")
    assert n_rows("policies:Near", "easiest", *QUICK) == 9


def test_team_files_of_one_name_are_told_apart(fireworld, here):
    import numpy as np

    for number, folder in enumerate(("old", "new")):
        (here / folder).mkdir()
        tables = np.zeros((1, 270, 4))
        tables[:, :, 3 - 2 * number] = 1.0
        TableTeam(tables=tables, visits=np.zeros((1, 270, 4), dtype=np.int64)).save(here / folder / "team.npz")
    found = compared(fireworld, "old/team.npz", "new/team.npz", *QUICK, "--seeds", 6)
    assert (found["a"]["name"], found["b"]["name"]) == ("old/team.npz", "new/team.npz")
    assert row(found)["verdict"] == "better"
    twin = compared(fireworld, *BAD_FIRST, *QUICK, "--seeds", 6)
    assert row(found)["difference"] == row(twin)["difference"]


def test_ctrl_c_keeps_what_is_done(fireworld, here, monkeypatch):
    go_on = interrupt_fourth_run(monkeypatch)
    words = ("compare", *BAD_FIRST, *QUICK, "--seeds", 50, "--jobs", 1, "--results", "runs.parquet")
    done = fireworld(*words)
    assert (done.code, done.out) == (130, "")
    n_kept = len(read_results(here / "runs.parquet"))
    assert 0 < n_kept < 100
    assert done.err == f"interrupted; {n_kept} of 100 runs were done: they are kept in runs.parquet\n"
    go_on()
    again = fireworld(*words)
    assert (again.code, again.err) == (0, f"{n_kept} of 100 runs are known from runs.parquet\n")


def test_a_failing_policy_says_where_and_loses_no_run(fireworld, here):
    words = ("compare", "chief", "policies:Failing", *QUICK, "--results", "runs.parquet")
    for n_seeds, n_kept in ((2, 2), (16, 16)):
        done = fireworld(*words, "--seeds", n_seeds, "--jobs", 1)
        assert (done.code, done.out) == (2, "")
        assert done.err.splitlines()[-1].startswith("fireworld: quick, seed ")
        assert "step 5, brigade 1: RuntimeError: lost the thread (policies.py, line" in done.err
        assert len(read_results(here / "runs.parquet")) == n_kept, "those of the other policy"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("chief", "boss"), "--policy: expected one of"),
        (("chief", "random", "--scenarios", "quick,nowhere"), "nowhere"),
        (("chief", "random", "--scenarios", ""), "expected"),
        (("chief", "random", "--scenarios", "quick,quick"), "scenarios: expected each scenario once"),
        (("chief", "random", "--scenarios", "quick", "--set", "bogus=1"), "bogus"),
        (("chief", "random", "--seeds", "0"), "Invalid value for '--seeds'"),
        (("chief", "random", "--first-seed", "4294967295", "--seeds", "2"), "expected 2 seeds up to 4294967295"),
        (
            ("chief", "random", "--margin", "0.1"),
            "--margin and --gate-metric go with --gate, --junit, --summary or --annotate",
        ),
        (("chief", "random", "--gate", "--margin", "-1"), "Invalid value for '--margin'"),
        (("chief", "random", "--gate", "--margin", "nan"), "margin: expected a number from 0 on"),
        (("chief", "random", "--force"), "--force goes with --junit, --plot or --summary"),
        (("chief", "random", "--junit", "no/such/place.xml"), "expected an existing folder no/such"),
        (("chief", "random", "--plot", "."), "."),
        (("chief", "random", "--results", "no/such/place.parquet"), "no folder no/such"),
        (("chief", "random", "--results", "policies.py"), "policies.py: expected a results file"),
    ],
)
def test_mistakes_take_one_line(fireworld, here, words, message):
    before = (here / "policies.py").read_text()
    done = fireworld("compare", *words)
    assert (done.code, done.out) == (2, "")
    assert message in done.err
    assert (here / "policies.py").read_text() == before


@pytest.mark.parametrize(
    ("module", "words", "extra"),
    [
        ("pyarrow.parquet", ("--results", "runs.parquet"), "fireworld[archive]"),
        ("matplotlib", ("--plot", "out.png"), "fireworld[figures]"),
    ],
)
def test_without_a_library_nothing_is_begun(fireworld, here, monkeypatch, module, words, extra):
    monkeypatch.setitem(sys.modules, module, None)
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    done = fireworld("compare", "chief", "random", *words)
    assert (done.code, done.out, done.err.count("\n")) == (2, "", 1)
    assert extra in done.err


def test_help_imports_nothing_heavy():
    code = (
        "import sys; from fireworld.cli.compare import command\n"
        "try: command.main(['--help'])\n"
        "except SystemExit: pass\n"
        "print({'numba', 'numpy', 'pyarrow', 'matplotlib', 'rich'} & sys.modules.keys())"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=os.environ)
    assert done.stdout.endswith("set()\n"), done.stdout


def test_the_table_fits_in_eighty_columns(fireworld):
    done = fireworld("compare", "chief", "best", "--scenarios", "quick", "--seeds", 6)
    assert all(len(line) <= 80 for line in done.out.splitlines()[:7])
