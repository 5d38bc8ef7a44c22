"""The project's own goldens: the same as ever, small, readable, and one for every kind of scenario."""

from __future__ import annotations

import re
import shutil
import subprocess

import pytest
from fireworld_recorder.reader import open_log

from fireworld.recording.golden.check import check_golden, find_goldens
from fireworld.recording.golden.spec import spec_of
from fireworld.recording.golden.store import golden_text, scenario_kind, text_path
from fireworld.recording.replay import recorded_scenario
from fireworld.records import EVENT_KINDS
from fireworld.scenario import load_scenario, scenario_names
from fireworld.simulation.built import CityCache
from tests.docs.pages import ROOT

FOLDER = ROOT / "recordings" / "golden"
GOLDENS = find_goldens(FOLDER)
SIZE_MAX_BYTES = 1_500_000
GIT = shutil.which("git")


@pytest.fixture(scope="module")
def cities():
    """Cities that several goldens share."""
    return CityCache()


@pytest.mark.parametrize("path", GOLDENS, ids=lambda path: path.stem)
def test_the_run_is_what_it_was(path, cities):
    """If the change is meant: `fireworld golden update --reason "..."`."""
    checked = check_golden(path, cities=cities)
    assert checked.result == "same", checked.sentence


def test_every_kind_of_scenario_has_one():
    kinds = {scenario_kind(recorded_scenario(open_log(path).header)) for path in GOLDENS}
    missing = {scenario_kind(scenario): scenario.name for scenario in map(load_scenario, scenario_names())}
    missing = {kind: name for kind, name in missing.items() if kind not in kinds}
    assert not missing, "try `fireworld golden add NAME --policy POLICY --steps 15` for one of each"


@pytest.mark.parametrize("path", GOLDENS, ids=lambda path: path.stem)
def test_it_runs_a_shipped_scenario(path):
    """By name, so that a change of a scenario, or of the parameters it starts from, is noticed too."""
    assert spec_of(open_log(path).header).scenario in scenario_names()


@pytest.mark.parametrize("path", GOLDENS, ids=lambda path: path.stem)
def test_its_text_is_current(path):
    assert text_path(path).read_text(encoding="utf-8") == golden_text(open_log(path)), "try `fireworld golden update`"


def test_they_are_small():
    assert sum(path.stat().st_size for path in FOLDER.iterdir()) < SIZE_MAX_BYTES


def test_they_hold_fires_that_go_well_and_badly():
    texts = "".join(text_path(path).read_text(encoding="utf-8") for path in GOLDENS)
    happened = set(re.findall(r"[a-z]+(?:-[a-z]+)*(?= \d)", texts))
    assert set(EVENT_KINDS) - happened <= {"brigade-hurt", "brigade-died"}


@pytest.mark.skipif(GIT is None or not (ROOT / ".git").exists(), reason="not a checkout")
def test_git_does_not_ignore_them():
    done = subprocess.run(
        [GIT, "check-ignore", *GOLDENS, *map(text_path, GOLDENS)], cwd=ROOT, capture_output=True, check=False
    )
    assert (done.returncode, done.stdout) == (1, b"")
