"""What all tests need before anything of fireworld is imported, and the fixtures that all of them share."""

from __future__ import annotations

import os
import shutil
import sys
from functools import partial
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

POLICIES = Path(__file__).with_name("policies.py")
LEAN_ON_LIBRARIES = ("cli", "envs", "executors", "recorder", "viewer")
"""Folders whose slow tests, too, run with the oldest libraries."""

# Tests call the inner kernels one by one; see fireworld.kernels.jit.
os.environ["FIREWORLD_OPEN_KERNELS"] = "1"

# What CI systems and people set to change how pytest and rich print: the tests read what is printed without them.
for name in (
    "CI",
    "BUILD_NUMBER",
    "PYTEST_ADDOPTS",
    "PY_COLORS",
    "FORCE_COLOR",
    "NO_COLOR",
    "TTY_COMPATIBLE",
    "TTY_INTERACTIVE",
    "COLUMNS",
    "LINES",
):
    os.environ.pop(name, None)

# On a machine that is busy, an example takes as long as it takes: no test depends on time.
settings.register_profile("patient", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("patient")

pytest_plugins = ["pytester"]


@pytest.hookimpl(tryfirst=True)  # before tests are chosen by their marks
def pytest_collection_modifyitems(items):
    """Mark the tests that lean on libraries by the folder they are in, and what is heavy as slow, too."""
    folders = [Path(__file__).with_name(name) for name in LEAN_ON_LIBRARIES]
    for item in items:
        if item.get_closest_marker("heavy"):
            item.add_marker("slow")
        if any(folder in item.path.parents for folder in folders):
            item.add_marker("libraries")


@pytest.fixture
def empty_folder(tmp_path, monkeypatch):
    """The current folder, an empty one; what is imported from it is forgotten again."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", sys.path.copy())
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    yield tmp_path
    for name, module in [*sys.modules.items()]:
        if str(tmp_path) in repr(getattr(module, "__spec__", None)):
            del sys.modules[name]


@pytest.fixture
def here(empty_folder):
    """The current folder; folders of tests put into it what their tests need."""
    return empty_folder


@pytest.fixture
def policies_file(here):
    """Put policies.py into the current folder."""
    shutil.copy(POLICIES, here)


@pytest.fixture
def fireworld(monkeypatch):
    """Call the command line in this process."""
    from tests import command_line

    monkeypatch.setenv("COLUMNS", "120")
    return partial(command_line.call, monkeypatch)
