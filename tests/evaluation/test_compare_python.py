"""`compare` from Python: what it takes, what it returns and shows, executors, results, mistakes."""

from __future__ import annotations

import shutil
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from threading import Event
from xml.etree.ElementTree import fromstring

import pytest

from fireworld.errors import FireworldError, PolicyError
from fireworld.evaluation.compare import compare
from fireworld.evaluation.results import read_results
from fireworld.interrupt import Interrupted
from fireworld.outcome import COLUMNS, METRICS
from fireworld.policy.protocol import Action, Decision
from fireworld.scenario import load_scenario

QUICK = {"scenarios": "quick", "set": {"steps": 20}}
RESULTS_1 = Path(__file__).parent / "data" / "results-1.parquet"


class Near:
    """Remembers how often it was asked, and takes another way if it was asked in an earlier run."""

    def __init__(self):
        self.n_asked = 0

    def begin(self, city, n_brigades, seed):
        self.n_brigades = n_brigades

    def decide(self, observation):
        self.n_asked += 1
        late = self.n_asked > self.n_brigades * observation.step
        return Decision(Action.EASIEST if late else Action.NEAREST_TO_ME)


def without_source():
    """Make a class as a notebook without a file might."""
    space = {"Decision": Decision}
    exec("class Bare:\n    def decide(self, observation):\n        return Decision(3)\n", space)  # noqa: S102
    return space["Bare"]


def near(observation):
    return Decision(Action.NEAREST_TO_ME)


@pytest.mark.parametrize("policy", [Near, Near(), near, lambda _: "nearest-to-me", f"{__name__}:Near"])
def test_classes_objects_and_functions_are_made_anew_for_every_run(policy):
    found = compare(["nearest-to-me", policy], seeds=6, **QUICK)
    assert [pairing.n_differing for pairing in found.pairings] == [0] * 8
    assert not found.same_policy
    assert "nearest-to-me against" not in found.sentence
    assert found.policies[1].digest


@pytest.mark.slow
def test_results_do_not_depend_on_the_executor(tmp_path):
    policies = ["random", Near, "each-another", "planner:horizon=5,interval=10"]
    words = {**QUICK, "seeds": 4, "first_seed": 7}
    one = compare(policies, executor=1, **words).to_dict()
    with ThreadPoolExecutor(3) as here, ProcessPoolExecutor(2, get_context("spawn")) as there:
        for executor in (None, 4, "threads", "processes", here, there):
            assert compare(policies, executor=executor, **words).to_dict() == one, executor


def test_several_policies_are_compared_with_the_first():
    found = compare(["nearest-to-me", "easiest", "nearest-to-me", "random"], seeds=[9, 4, 1, 7, 5, 12], **QUICK)
    names = ["easiest", "nearest-to-me", "random"]
    assert [policy.name for policy in found.policies[1:]] == names
    assert found.verdict("score", policy="nearest-to-me") == "the same policy"
    assert found.verdict(policy="easiest") == found.verdict("score", policy="easiest")
    assert [row["policy"] for row in found.table] == [name for name in names for _ in range(8)]
    assert (
        found.to_dict()["comparisons"][2]
        == compare(["nearest-to-me", "random"], seeds=[9, 4, 1, 7, 5, 12], **QUICK).to_dict()
    )
    assert found.to_dict()["comparisons"][0]["seeds"] == [9, 4, 1, 7, 5, 12]
    text = repr(found)
    assert [f"A: nearest-to-me, B: {name}, 6 seeds from 9" in text for name in names] == [True] * 3
    assert found._repr_html_().count("<table>") == 3
    cases = fromstring(found.junit()).findall(".//testcase")
    assert len({(case.get("classname"), case.get("name")) for case in cases}) == len(cases) == 3 * 8
    for wrong in (None, "best"):
        with pytest.raises(FireworldError, match="policy: expected one of easiest, nearest-to-me, random"):
            found.verdict(policy=wrong)
    with pytest.raises(FireworldError, match="metric: expected one of score, burnt-out, time, civilians"):
        found.verdict("luck", policy="easiest")


def test_a_comparison_shows_itself(tmp_path):
    found = compare(["nearest-to-me", "nearest-to-civilian"], seeds=6, metric="burnt-out", margin=1, **QUICK)
    assert found.verdict() == found.table[1]["verdict"]
    assert found.judgement == found.to_dict()["gate"]["judgement"]
    assert found.gate.startswith("gate: burnt out, margin 1 buildings: ")
    title, head, line, scenario, *rows = repr(found).splitlines()
    assert title == "A: nearest-to-me, B: nearest-to-civilian, seeds 1 to 6"
    assert head.split() == ["A", "B", "B", "-", "A", "P", "CRN", "B", "is"]
    assert (set(line), scenario) == ({"-"}, "quick")
    assert [row.startswith(f" {metric.label} ") for row, metric in zip(rows, METRICS, strict=False)] == [True] * 4
    assert rows[-1] == found.notes[-1]
    assert found.sentence.startswith("nearest-to-civilian against nearest-to-me: score ")
    page = found._repr_html_()
    assert page.count("<tr>") == 1 + 4
    assert 'class="mark ' in page
    assert len(found.figure().axes) == 4
    found.save_figure(tmp_path / "out.svg")
    assert b"<svg" in (tmp_path / "out.svg").read_bytes()
    with pytest.raises(FireworldError, match="exist"):
        found.save_figure(tmp_path / "out.svg")


def test_its_table_in_pandas():
    pandas = pytest.importorskip("pandas")
    found = compare(["nearest-to-me", "easiest"], seeds=2, **QUICK)
    frame = found.to_pandas()
    assert isinstance(frame, pandas.DataFrame)
    assert frame["difference.low"].tolist() == [row["difference"]["low"] for row in found.table]


def test_without_pandas_it_says_so(monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(FireworldError, match=r"fireworld\[frames\]"):
        compare(["nearest-to-me", "easiest"], seeds=1, **QUICK).to_pandas()


def test_scenarios_are_names_files_or_objects(tmp_path):
    own = load_scenario("quick").with_values({"steps": 15, "name": "own"})
    (tmp_path / "file.yaml").write_text(own.with_values({"steps": 16}).to_yaml())
    found = compare(["chief", "easiest"], scenarios=["quick", own, tmp_path / "file.yaml"], seeds=1)
    assert [name for name, _ in found.scenarios] == ["quick", "own", str(tmp_path / "file.yaml")]
    assert found.scenarios[1][1] == own.digest


def test_a_policy_without_a_source_is_run_here_and_not_named_in_results(tmp_path):
    bare = without_source()
    found = compare([bare, "nearest-to-me", bare()], seeds=4, **QUICK)
    assert [policy.digest for policy in found.policies][::2] == ["", ""]
    assert {pairing.n_differing for pairing in found.pairings} == {0}
    assert not any(pairing.same_policy for pairing in found.pairings)
    with pytest.raises(PolicyError, match="results: expected a policy whose source is in a file"):
        compare(["chief", bare], results=tmp_path / "runs.parquet", seeds=1, **QUICK)
    for executor in ("processes", ProcessPoolExecutor(1)):
        with pytest.raises(PolicyError, match="executor: expected a policy that other processes can"):
            compare(["chief", bare], executor=executor, seeds=1, **QUICK)
    assert not [*tmp_path.iterdir()]


def test_progress_counts_what_is_known(tmp_path):
    told = []
    words = {**QUICK, "results": tmp_path / "runs.parquet", "on_run": lambda *numbers: told.append(numbers)}
    compare(["chief", "easiest"], seeds=2, **words)
    assert told == [(n, 4) for n in range(5)]
    told.clear()
    compare(["chief", "easiest", "random"], seeds=2, **words)
    assert told == [(n, 6) for n in (4, 5, 6)]


def test_a_stop_keeps_what_is_done(tmp_path):
    stop, path = Event(), tmp_path / "runs.parquet"

    def on_run(n_done, n_all):
        if n_done == 5:
            stop.set()

    with pytest.raises(Interrupted, match="they are kept in") as caught:
        compare(["chief", "easiest"], seeds=20, executor=1, results=path, stop=stop, on_run=on_run, **QUICK)
    n_kept = len(read_results(path))
    assert 5 <= n_kept < 40
    assert str(caught.value) == f"interrupted; {n_kept} of 40 runs were done: they are kept in {path}"


@pytest.mark.parametrize(
    ("policies", "words", "message"),
    [
        (["chief"], {}, "policies: expected two or more"),
        ("chief,random", {}, "policies: expected two or more"),
        (["chief", 7], {}, "policy: expected"),
        (["chief", "boss"], {}, "expected one of"),
        (["chief", "random"], {"seeds": 0}, "seeds: expected a whole number from 1 to 10000, got 0"),
        (["chief", "random"], {"seeds": []}, "seeds: expected one seed or more"),
        (["chief", "random"], {"seeds": [1, 1]}, "each of them once"),
        (["chief", "random"], {"seeds": [-1]}, "seeds: expected a whole number"),
        (["chief", "random"], {"seeds": "all"}, "seeds: expected a whole number"),
        (["chief", "random"], {"first_seed": 2**32 - 1}, "first_seed: expected 100 seeds up to"),
        (["chief", "random"], {"scenarios": []}, "scenarios: expected one or more"),
        (["chief", "random"], {"scenarios": ["quick", "quick"]}, "scenarios: expected each scenario once"),
        (["chief", "random"], {"set": {"bogus": 1}}, "bogus"),
        (["chief", "random"], {"set": "steps=5"}, "set: expected values by key"),
        (["chief", "random"], {"metric": "luck"}, "metric: expected one of score, burnt-out, time, civilians"),
        (["chief", "random"], {"margin": -0.1}, "margin: expected a number from 0 on"),
        (["chief", "random"], {"margin": "small"}, "margin: expected a number from 0 on"),
        (["chief", "random"], {"executor": "fibres"}, "executor: expected"),
        (["chief", "random"], {"results": 3}, "results: expected the path of a file"),
        (["chief", "random"], {"results": "no/such.parquet"}, "no folder no"),
    ],
)
def test_wrong_arguments_take_one_line(policies, words, message):
    with pytest.raises(FireworldError, match=message) as caught:
        compare(policies, **{"scenarios": "quick", **words})
    assert "\n" not in str(caught.value)


def test_results_of_an_earlier_version_are_kept(tmp_path):
    path = tmp_path / "runs.parquet"
    shutil.copy(RESULTS_1, path)
    earlier = read_results(path)
    assert len(earlier) == 12
    compare(["chief", "random"], seeds=6, results=path, **QUICK)
    later = read_results(path)
    assert len(later) == 24
    assert {key: later[key] for key in earlier} == earlier
    rows = {(key.policy_digest, key.seed): result.row for key, result in earlier.items()}
    assert all(rows[key.policy_digest, key.seed] == result.row for key, result in later.items()), "the same outcomes"


NEW_SCORE = """
import sys
from dataclasses import replace
from fireworld import outcome
outcome.Outcome.civilians_lost = property(lambda run: run.score_max - 1 - run.n_civilians_alive)
outcome.METRICS += (
    outcome.Metric(name="lost", label="civilians lost", attribute="civilians_lost", unit="civilians", digits=2,
                   higher_is_better=False),
    outcome.Metric(name="score-now", label="score by the later rule", attribute="score_now", unit="", digits=3,
                   higher_is_better=True),
)
outcome.COLUMNS["score_now"] = "score_now"
from fireworld.evaluation.compare import compare
from fireworld.evaluation.results import read_results
found = compare(["nearest-to-civilian", "nearest-to-me"], scenarios="quick", seeds=6, metric="lost",
                results="runs.parquet", set={"steps": 60})
print(repr(found))
print(found.verdict(), found.verdict("score-now"), found.verdict("civilians"), len(found.to_dict()["comparisons"]))
import pathlib
print(len(read_results(pathlib.Path("runs.parquet"))))
"""


@pytest.mark.slow
def test_a_new_score_touches_the_table_of_outcomes_only(tmp_path):
    """One that follows from the columns, and one that needs a column more; rows of before stay in the file."""
    words = {"scenarios": "quick", "seeds": 6, "set": {"steps": 60}, "results": tmp_path / "runs.parquet"}
    shutil.copy(RESULTS_1, tmp_path / "runs.parquet")
    compare(["nearest-to-civilian", "nearest-to-me"], **words)
    done = subprocess.run([sys.executable, "-c", NEW_SCORE], capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    *text, verdicts, n_rows = done.stdout.splitlines()
    assert verdicts == "worse worse worse 12"
    assert any(line.startswith(" civilians lost ") for line in text)
    assert any(line.startswith(" score by the later rule ") for line in text)
    assert n_rows == "24", "rows of another version stay; of the others, those without the new column are made again"
    with pytest.raises(FireworldError, match="other columns, or of a later fireworld"):
        read_results(tmp_path / "runs.parquet")


def test_every_metric_follows_from_the_columns():
    from tests.evaluation import synthetic

    runs = synthetic.outcomes(range(2), score=3, score_max=4, completed=[True, False])
    for metric in METRICS:
        assert getattr(runs, metric.attribute).shape == (2,)
    assert runs.time_to_complete.tolist()[0] == 200
    assert list(COLUMNS)[:8] == [
        "score", "score_max", "burnt_out", "steps", "completed", "civilians_alive", "total_reward", "water_litres",
    ]  # fmt: skip
    with pytest.raises(AttributeError, match="luck"):
        runs.luck  # noqa: B018
