"""A training of a moment: small town, few steps, few episodes."""

from __future__ import annotations

import pytest

from fireworld.simulation.built import CityCache
from fireworld.training.curriculum import load_curriculum
from fireworld.training.methods.sarsa import Sarsa

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
def here(here):
    """The current folder, with tiny.yaml in it."""
    (here / "tiny.yaml").write_text(TINY)
    return here


@pytest.fixture
def curriculum(here):
    return load_curriculum("tiny.yaml")


@pytest.fixture
def make_trainer(curriculum):
    cities = CityCache()

    def make(seed=1, method=SHORT, **changes):
        return method.with_settings(changes).trainer(curriculum, seed=seed, cities=cities)

    return make
