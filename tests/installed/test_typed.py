"""The front door is typed: mypy --strict knows every type that a project of its own meets."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import fireworld
from tests.docs.pages import ROOT
from tests.installed.names import FRONT_DOOR

PROJECT = Path(__file__).with_name("typed")


@pytest.mark.heavy
def test_a_strict_project_passes(tmp_path):
    cache = ROOT / ".mypy_cache" / "consumer"
    options = ["--strict", "--config-file", "", "--warn-unused-ignores", "--cache-dir", cache]
    done = subprocess.run(
        [sys.executable, "-m", "mypy", *options, PROJECT / "consumer.py", PROJECT / "mistakes.py"],
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_front_door_has_these_names():
    assert set(fireworld.__all__) >= FRONT_DOOR
    assert set(dir(fireworld)) >= FRONT_DOOR
    assert all(getattr(fireworld, name) is not None for name in fireworld.__all__)
