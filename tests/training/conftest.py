"""A training of a moment: small town, few steps, few episodes."""

from __future__ import annotations

import pytest

from fireworld.simulation.built import CityCache
from fireworld.training.curriculum import load_curriculum
from fireworld.training.methods.sarsa import Sarsa
from tests.cli.conftest import fireworld  # noqa: F401 - the fixture that calls the command line

TINY = """
stages:
  - name: alone
    cooperation: false
    base: quick
    set: {brigades.n: 1, steps: 12}
    vary: {"fires.0.n_buildings": [1, 3]}
  - name: together
    cooperation: true
    base: quick
    set: {brigades.n: 3, steps: 14}
    vary: {"fires.0.n_buildings": [2, 4]}
"""
SHORT = Sarsa(n_episodes_max=6, n_episodes_unchanged=3)
SHORT_WORDS = ("--set", "n_episodes_max=6", "--set", "n_episodes_unchanged=3")


@pytest.fixture
def here(tmp_path, monkeypatch):
    """The current folder, empty but for tiny.yaml."""
    (tmp_path / "tiny.yaml").write_text(TINY)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def curriculum(here):
    return load_curriculum("tiny.yaml")


@pytest.fixture
def make_trainer(curriculum):
    cities = CityCache()

    def make(seed=1, method=SHORT, **changes):
        return method.with_settings(changes).trainer(curriculum, seed=seed, cities=cities)

    return make
