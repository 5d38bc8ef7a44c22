"""The wheel: what it installs, under which names, and that it works without the checkout."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path, PurePosixPath

import pytest

from fireworld.policy.teams import team_names
from fireworld.scenario import scenario_names
from tests.docs.pages import ROOT
from tests.installed.names import FRONT_DOOR

pytestmark = pytest.mark.heavy

SHIPPED = {
    "scenarios": {f"{name}.yaml" for name in scenario_names()},
    "scenarios/curricula": {path.name for path in (ROOT / "scenarios" / "curricula").glob("*.yaml")},
    "teams": {f"{name}.npz" for name in team_names()},
}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    """Build the wheel of this checkout."""
    folder = tmp_path_factory.mktemp("wheel")
    pip = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "-w", folder, ROOT]
    done = subprocess.run(pip, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    (path,) = folder.glob("*.whl")
    return path


@pytest.fixture(scope="module")
def names(wheel) -> list[PurePosixPath]:
    """Name the files in the wheel."""
    return [PurePosixPath(name) for name in zipfile.ZipFile(wheel).namelist()]


def test_it_takes_no_name_that_belongs_to_everybody(names):
    top = {name.parts[0] for name in names}
    assert {"fireworld", "fireworld_recorder", "fireworld_viewer"} <= top
    (metadata,) = (name for name in top if name != "fireworld" and not name.startswith("fireworld_"))
    assert metadata.endswith(".dist-info")


def test_no_module_and_no_folder_shadows_a_name_of_the_front_door(names):
    inside = {name.parts[1].partition(".")[0] for name in names if name.parts[0] == "fireworld"}
    assert "records" in inside
    assert not inside & FRONT_DOOR


@pytest.mark.parametrize("folder", SHIPPED)
def test_what_comes_with_fireworld_is_in_it(names, folder):
    place = PurePosixPath("fireworld/shipped", folder)
    assert len(SHIPPED[folder]) > 2
    assert {name.name for name in names if name.parent == place} == SHIPPED[folder]


def test_types_are_declared(names):
    for package in ("fireworld", "fireworld_recorder", "fireworld_viewer"):
        assert PurePosixPath(package, "py.typed") in names


def test_it_works_without_the_checkout(wheel, tmp_path):
    place = tmp_path / "site"
    zipfile.ZipFile(wheel).extractall(place)

    def call(*words: str) -> str:
        found = {**os.environ, "PYTHONPATH": str(place)}
        done = subprocess.run(words, capture_output=True, text=True, check=False, cwd=tmp_path, env=found)
        assert done.returncode == 0, done.stderr
        return done.stdout

    imported = "import fireworld, fireworld_recorder, fireworld_viewer as v; print(fireworld.__file__, v.__file__)"
    assert all(str(place) in path for path in call(sys.executable, "-c", imported).split())
    listed = call(sys.executable, "-m", "fireworld", "scenarios")
    assert all(name in listed for name in scenario_names())
    call(sys.executable, "-m", "fireworld", "run", "quick", "--policy", "best", "--steps", "5", "--record", "a.mcap")
    assert "the same" in call(sys.executable, "-m", "fireworld", "verify", "a.mcap")
    assert "wrote p.html" in call(sys.executable, "-m", "fireworld", "play", "a.mcap", "-o", "p.html")
