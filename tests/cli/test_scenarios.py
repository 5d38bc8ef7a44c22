"""`fireworld scenarios check` and `new`: what they print and write, exit codes, and every complaint."""

from __future__ import annotations

import json
import signal
import subprocess
import sys

import pytest

import fireworld as fw
from fireworld.scenario import load_scenario

CHECK = ("scenarios", "check")
NEW = ("scenarios", "new", "--city", "quick", "--seeds", 2)


@pytest.fixture(autouse=True)
def narrow(fireworld, here, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")


def test_a_check(fireworld):
    done = fireworld(*CHECK, "quick", "--seeds", 3)
    assert (done.code, done.err) == (0, "")
    lines = done.out.splitlines()
    assert max(map(len, lines)) <= 80
    assert lines[0] == "quick"
    assert "held: the rules score 0.73 on the mean" in lines
    assert len([line for line in lines if line.endswith(" of 3")]) == 7
    assert "Means over seeds 1000 to 1002." in done.out


def test_it_says_what_the_library_finds(fireworld):
    done = fireworld(*CHECK, "quick", "test-1", "--set", "steps=30", "--seeds", 2, "--first-seed", 5, "--json")
    found = fw.check_scenarios(["quick", "test-1"], seeds=2, first_seed=5, set={"steps": 30})
    assert json.loads(done.out) == json.loads(json.dumps(found.to_dict()))
    options = ("--seeds", 2, "--first-seed", 5, "--set", "steps=30", "--markdown", "--jobs", 1)
    assert fireworld(*CHECK, "quick", "test-1", *options).out == found.markdown + "\n"


def test_numbers_of_burning_buildings(fireworld):
    done = fireworld(*CHECK, "quick", "--counts", "2-4,7", "--seeds", 2, "--json")
    assert [check["n_burning"] for check in json.loads(done.out)["checks"]] == [2, 3, 4, 7]
    text = fireworld(*CHECK, "quick", "--counts", "2-4,7", "--seeds", 2).out
    assert len([line for line in text.splitlines() if line.startswith("quick ")]) == 4
    assert max(map(len, text.splitlines())) <= 80


@pytest.mark.slow
def test_without_a_name_all_that_come_with_fireworld_are_checked(fireworld):
    done = fireworld(*CHECK, "--seeds", 1, "--set", "steps=2", "--json")
    assert [check["scenario"] for check in json.loads(done.out)["checks"]] == [one.name for one in fw.scenarios()]


@pytest.mark.parametrize(("verdict", "code"), [("held", 0), ("contested", 1), ("lost", 1)])
def test_a_verdict_that_is_required(fireworld, verdict, code):
    done = fireworld(*CHECK, "quick", "--seeds", 2, "--require", verdict)
    assert done.code == code
    assert "held: the rules score" in done.out


def test_new_fires(fireworld, here):
    done = fireworld(*NEW, "-o", "fires.yaml", "--n", 2)
    assert (done.code, done.err) == (0, "")
    lines = done.out.splitlines()
    assert max(map(len, lines)) <= 80
    assert [line.split()[0] for line in lines[2:4]] == ["fires-1", "fires-2"]
    assert lines[-1] == "wrote fires-1.yaml to fires-2.yaml, and fires.yaml, the curriculum of them"
    assert sorted(path.name for path in here.iterdir()) == ["fires-1.yaml", "fires-2.yaml", "fires.yaml"]
    assert fireworld(*CHECK, "fires-1.yaml", "fires-2.yaml", "--seeds", 2, "--require", "contested").code == 0
    assert fireworld("run", "fires-1.yaml", "--policy", "chief").code == 0
    again = fireworld(*NEW, "-o", "fires.yaml", "--n", 2)
    assert (again.code, again.err) == (
        2,
        "fireworld: fires.yaml: expected a name that is free, got an existing file; use --force to replace it\n",
    )
    before = (here / "fires-1.yaml").read_bytes()
    assert fireworld(*NEW, "-o", "fires.yaml", "--n", 2, "--force").code == 0
    assert (here / "fires-1.yaml").read_bytes() == before


def test_the_file_says_how_to_make_it_again(fireworld, here):
    options = ("--seed", 7, "--n-fires", 2, "--brigades", 3, "--civilians", 3, "--counts", "2-9", "--set", "steps=70")
    assert fireworld(*NEW, "-o", "a.yaml", *options, "--lost-below", 0.05).code == 0
    head = (here / "a.yaml").read_text().replace("\n# ", " ")
    made = head.partition("`fireworld scenarios new ")[2].partition("`")[0]
    assert fireworld("scenarios", "new", *made.split(), "-o", "b.yaml").code == 0, made
    assert (here / "b.yaml").read_bytes() == (here / "a.yaml").read_bytes()
    scenario = load_scenario("a.yaml")
    assert (scenario.brigades.n, scenario.civilians.n, scenario.steps, len(scenario.fires)) == (3, 3, 70, 2)


def test_json_of_new_fires(fireworld):
    done = fireworld(*NEW, "-o", "a.yaml", "--json")
    found = json.loads(done.out)
    assert (done.code, found["complete"], found["files"]) == (0, True, ["a.yaml"])
    assert found["fires"][0]["digest"] == load_scenario("a.yaml").digest


def test_no_fire_is_exit_code_1_and_a_line(fireworld, here):
    words = ("scenarios", "new", "--city", "test-2", "-o", "a.yaml", "--seeds", 1, "--places", 2, "--counts", "1-2")
    done = fireworld(*words, "--brigades", 8)
    assert (done.code, done.out) == (1, "")
    (line,) = done.err.splitlines()
    assert line.startswith("0 of 1 contested fire found at 2 places: 2 held with 2 burning buildings; try fewer")
    assert line.endswith("; nothing is written")
    assert [*here.iterdir()] == []
    done = fireworld(*words, "--brigades", 8, "--json")
    assert done.code == 1
    assert json.loads(done.out)["files"] == []


@pytest.mark.parametrize(
    ("words", "line"),
    [
        ((*CHECK, "quik"), "fireworld: scenario: expected the name of a scenario or a .yaml file, got 'quik'"),
        ((*CHECK, "quick", "--counts", "8-"), "Error: Invalid value for '--counts': expected numbers as 8-12"),
        ((*CHECK, "quick", "--counts", "9-8"), "Error: Invalid value for '--counts': expected numbers"),
        ((*CHECK, "quick", "--json", "--markdown"), "Error: --json and --markdown exclude each other."),
        ((*CHECK, "quick", "--lost-below", "0.7"), "fireworld: lost_below: expected less than held_above (0.6)"),
        ((*NEW, "-o", "a.txt"), "fireworld: a.txt: expected a file ending in .yaml, .yml, got '.txt'"),
        ((*NEW,), "Error: Missing option '-o' / '--output'."),
        ((*NEW, "-o", "a.yaml", "--set", "brigades.n"), "fireworld: --set: expected KEY=VALUE, got 'brigades.n'"),
        ((*NEW, "-o", "a.yaml", "--set", "fires.0.step=3"), "fireworld: set: fires.0.step: expected keys other than"),
    ],
)  # fmt: skip
def test_mistakes(fireworld, here, words, line):
    done = fireworld(*words)
    assert done.code == 2
    assert line in done.err
    assert [*here.iterdir()] == []


INTERRUPTED = """
import signal, sys
import fireworld.evaluation.{module} as module
from fireworld.cli import main
signal.signal(signal.SIGINT, signal.default_int_handler)
sys.argv = {words!r}
real = module.{name}
def slow(*words, **more):
    signal.raise_signal(signal.SIGINT)
    return real(*words, **more)
module.{name} = slow
main()
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("module", "name", "words", "line"),
    [
        ("judge", "evaluate_each", (*CHECK, "test-1", "quick"), "interrupted"),
        ("new_scenarios", "grow", (*NEW, "-o", "a.yaml"), "interrupted; nothing is written"),
    ],
)
def test_ctrl_c(here, module, name, words, line):
    code = INTERRUPTED.format(module=module, name=name, words=["fireworld", *map(str, words)])
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr.splitlines()[-1]) == (130, "", line)
    assert [*here.iterdir()] == []
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
