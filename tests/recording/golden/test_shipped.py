"""The project's own goldens: the same as ever, small, readable; a run for every kind of scenario, some trainings."""

from __future__ import annotations

import re
import shutil
import subprocess

import pytest
from fireworld_recorder.reader import open_log

from fireworld.recording.golden.check import check_golden
from fireworld.recording.golden.find import find_goldens
from fireworld.recording.golden.spec import spec_of
from fireworld.recording.golden.store import text_path
from fireworld.recording.golden.text import golden_text, scenario_kind
from fireworld.recording.golden.training import training_spec_of, training_text
from fireworld.recording.inputs import is_training
from fireworld.recording.replay import recorded_scenario
from fireworld.records import EVENT_KINDS
from fireworld.scenario import load_scenario, scenario_names
from fireworld.simulation.built import CityCache
from fireworld.training.log.reader import open_training
from tests.docs.pages import ROOT

FOLDER = ROOT / "recordings" / "golden"
GOLDENS = find_goldens(FOLDER)
TRAININGS = [path for path in GOLDENS if is_training(path)]
RUNS = [path for path in GOLDENS if path not in TRAININGS]
SIZE_MAX_BYTES = 1_500_000
GIT = shutil.which("git")


@pytest.fixture(scope="module")
def cities():
    """Cities that several goldens share."""
    return CityCache()


@pytest.mark.parametrize("path", GOLDENS, ids=lambda path: path.stem)
def test_it_is_what_it_was(path, cities):
    """If the change is meant: `fireworld golden update --reason "..."`."""
    checked = check_golden(path, cities=cities)
    assert checked.result == "same", checked.sentence


def test_every_kind_of_scenario_has_one():
    kinds = {scenario_kind(recorded_scenario(open_log(path).header)) for path in RUNS}
    missing = {scenario_kind(scenario): scenario.name for scenario in map(load_scenario, scenario_names())}
    missing = {kind: name for kind, name in missing.items() if kind not in kinds}
    assert not missing, "try `fireworld golden add NAME --policy POLICY --steps 15` for one of each"


@pytest.mark.parametrize("path", RUNS, ids=lambda path: path.stem)
def test_it_runs_a_shipped_scenario(path):
    """By name, so that a change of a scenario, or of the parameters it starts from, is noticed too."""
    assert spec_of(open_log(path).header).scenario in scenario_names()


@pytest.mark.parametrize("path", TRAININGS, ids=lambda path: path.stem)
def test_it_trains_by_name(path):
    assert training_spec_of(open_training(path).header).curriculum in {*scenario_names(), "two-stages.yaml"}


def test_trainings_go_through_all_that_can_happen():
    """Both methods; one table drawn for all, tables widened; exploring and being greedy; settling and giving up."""
    paper, search = [open_training(path) for path in TRAININGS]
    assert (paper.method.name, search.method.name) == ("paper", "search")
    assert [stage.cooperation for stage in paper.curriculum.stages] == [False, True]
    assert {line.drawn for line in paper.lines} >= {-1, 0}
    assert any(line.drawn > 0 for line in paper.lines)
    assert {line.converged for line in paper.lines if line.ended} == {True, False}
    choices = paper.episode(3, -1).choice
    assert {1, 2} <= {*choices.ravel().tolist()}


@pytest.mark.parametrize("path", GOLDENS, ids=lambda path: path.stem)
def test_its_text_is_current(path):
    text = training_text(open_training(path)) if path in TRAININGS else golden_text(open_log(path))
    assert text_path(path).read_text(encoding="utf-8") == text, "try `fireworld golden update`"


def test_they_are_small():
    assert sum(path.stat().st_size for path in FOLDER.iterdir()) < SIZE_MAX_BYTES


def test_they_hold_fires_that_go_well_and_badly():
    texts = "".join(text_path(path).read_text(encoding="utf-8") for path in RUNS)
    happened = set(re.findall(r"[a-z]+(?:-[a-z]+)*(?= \d)", texts))
    assert set(EVENT_KINDS) - happened <= {"brigade-hurt", "brigade-died"}


@pytest.mark.skipif(GIT is None or not (ROOT / ".git").exists(), reason="not a checkout")
def test_git_does_not_ignore_them():
    done = subprocess.run(
        [GIT, "check-ignore", *GOLDENS, *map(text_path, GOLDENS)], cwd=ROOT, capture_output=True, check=False
    )
    assert (done.returncode, done.stdout) == (1, b"")
