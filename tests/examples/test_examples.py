"""The examples run from an empty folder, and what each writes is judged by `fireworld`; each says what it lacks."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from importlib.util import find_spec

import pytest

import fireworld as fw
from tests.docs.pages import ROOT
from tests.envs.extra import needs_extra

FOLDER = ROOT / "examples"
NAMES = sorted(path.stem for path in FOLDER.glob("*.py"))
LEARN = pytest.mark.skipif(
    any(find_spec(name) is None for name in ("torch", "stable_baselines3", "gymnasium")),
    reason="pip install 'fireworld[learn]'",
)
NEEDS = {"parallel": "pettingzoo", "ppo": "torch", "sarsa": "pettingzoo", "stable_baselines": "stable_baselines3"}
"""The library whose lack each example reports."""
LINES_MAX = 200


WITHOUT = """
import runpy, sys
class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] == {library!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name={library!r})
sys.meta_path.insert(0, Missing())
sys.argv = [{path!r}]
runpy.run_path({path!r}, run_name="__main__")
"""


def run(*arguments, cwd):
    """Run Python as a reader would, and return what it printed."""
    done = subprocess.run([sys.executable, *arguments], capture_output=True, text=True, check=False, cwd=cwd)
    assert done.returncode == 0, done.stderr
    return done.stdout


def run_example(name, *arguments, cwd):
    """Run an example, and return what it printed."""
    return run(str(FOLDER / name), *arguments, cwd=cwd)


@pytest.mark.heavy
@needs_extra()
def test_parallel(here, fireworld):
    printed = run_example("parallel.py", "--scenario", "quick", "--episodes", "2", cwd=here)
    by_chance, by_rule = (float(share) for share in re.findall(r"score ([\d.]+) of 1", printed))
    assert by_chance < by_rule
    for log in ("random.mcap", "rule.mcap"):
        assert fw.verify(log).same
    shown = printed.splitlines()[-1].split("&&")[0].split()[1:]
    assert fireworld(*shown).code == 0
    assert fw.open_log("episode.mcap").outcome.score / 5 == pytest.approx(by_rule, abs=0.001)


@pytest.mark.heavy
@LEARN
@pytest.mark.parametrize(
    ("name", "budget", "output"),
    [
        ("ppo.py", ("--updates", "2"), "ppo.npz"),
        ("stable_baselines.py", ("--decisions", "1"), "stable-baselines.npz"),
    ],
)
def test_a_network_becomes_a_team(name, budget, output, here, fireworld):
    assert run_example(name, *budget, "--seed", "3", cwd=here).endswith(f"wrote {output}\n")
    team = fw.load_team(output)
    assert team.widths == (13, 32, 32, 1)
    assert team.provenance["seed"] == 3
    assert fireworld("compare", "chief", output, "--scenarios", "quick", "--seeds", "2").code == 0


@pytest.mark.heavy
@needs_extra()
def test_sarsa_is_the_method_to_the_last_bit(here):
    printed = run_example("sarsa.py", "--episodes", "12", "--seed", "2", cwd=here)
    own = fw.train("quick", method="paper", seed=2, set={"n_episodes_max": 12})
    assert printed.startswith(f"equal: {own.digest}")
    assert fw.load_team("sarsa.npz").digest == own.digest


@pytest.mark.heavy
@needs_extra()
def test_sarsa_of_episodes_that_are_truncated(here):
    """At the last step something burns in all of these."""
    assert run_example("sarsa.py", "--scenario", "test-2", "--episodes", "2", cwd=here).startswith("equal: ")


@pytest.mark.heavy
def test_counterfactual(here):
    printed = run_example("counterfactual.py", "--futures", "3", "--step", "2", "--scenario", "quick", cwd=here)
    rows = [line.split(maxsplit=1) for line in printed.splitlines()[2:4]]
    assert [number for number, _ in rows] == ["0", "1"]
    assert all(row.count("what it did") == 1 for _, row in rows)
    assert fw.verify("counterfactual.mcap").same


@pytest.mark.heavy
@pytest.mark.parametrize("name", sorted(NEEDS))
def test_each_says_what_it_lacks(name, here):
    printed = run("-c", WITHOUT.format(library=NEEDS[name], path=str(FOLDER / f"{name}.py")), cwd=here)
    assert re.fullmatch(r"skipped: .*; try pip install 'fireworld\[(gym|learn)\]'\n", printed)
    assert not list(here.iterdir())


@pytest.mark.parametrize("name", NAMES)
def test_each_is_short_and_says_how_it_is_run(name):
    text = (FOLDER / f"{name}.py").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= LINES_MAX
    assert f"\n    python examples/{name}.py" in ast.get_docstring(ast.parse(text))
    added = [line for line in text.splitlines() if "add_argument(" in line]
    assert added
    assert all("help=" in line for line in added)
