"""What importing fireworld loads: nothing that is heavy before it is used."""

from __future__ import annotations

import subprocess
import sys

import pytest

HEAVY = {"numba", "numpy", "pyarrow", "matplotlib", "rerun", "pandas", "mcap", "shapely", "rich", "click", "yaml"}


def loaded(code: str) -> set[str]:
    """Return the packages that are loaded after code has run in a new process."""
    names = "sorted({name.partition('.')[0] for name in sys.modules})"
    done = subprocess.run(
        [sys.executable, "-c", f"{code}\nimport sys\nprint(*{names})"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return set(done.stdout.split())


@pytest.mark.parametrize("code", ["import fireworld", "import fireworld\ndir(fireworld)\nfireworld.__version__"])
def test_importing_fireworld_loads_nothing_heavy(code):
    found = loaded(code)
    assert "fireworld" in found
    assert not found & HEAVY


def test_the_command_line_loads_click_only():
    found = loaded("import fireworld.cli")
    assert "click" in found
    assert not found & (HEAVY - {"click"})


def test_the_test_would_notice():
    assert HEAVY & loaded("import fireworld.simulation.world") >= {"numba", "numpy"}
