"""Trainings of a moment, recorded."""

from __future__ import annotations

from pathlib import Path

import pytest

from fireworld.training.curriculum import load_curriculum
from fireworld.training.log.reader import open_training
from fireworld.training.train import train
from tests.training.conftest import TINY

SHORT = {"n_episodes_max": 6, "n_episodes_unchanged": 3}
SHORT_TARGETS = {"n_lessons": 3, "n_fights": 5, "n_steps_max": 10, "hidden": 4}
SHORT_EVOLUTION = {"n_generations": 3, "n_pairs": 2, "n_fires": 2, "n_steps_max": 10, "hidden": 2, "check_every": 2}
SHORT_GATES = {"n_generations": 3, "n_pairs": 2, "n_fires": 2, "n_steps_max": 10, "check_every": 2}
SHORT_SEARCH = {"n_generations": 3, "n_candidates": 4, "n_best": 2, "n_fires": 2, "n_steps_max": 10}
SHORT_ROLLOUTS = {"n_generations": 3, "n_fights": 2, "n_steps_max": 10, "hidden": 2, "horizon": 5, "n_epochs": 2}
SHORT_IMITATION = {"n_generations": 2, "n_fights": 2, "n_steps_max": 10, "hidden": 0, "start": "none", "n_epochs": 2}
SHORT_OF = {
    "paper": SHORT,
    "search": SHORT_SEARCH,
    "targets": SHORT_TARGETS,
    "evolution": SHORT_EVOLUTION,
    "gates": SHORT_GATES,
    "imitation": SHORT_IMITATION,
    "rollouts": SHORT_ROLLOUTS,
}


@pytest.fixture(scope="session")
def curriculum_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("curriculum") / "tiny.yaml"
    path.write_text(TINY)
    return path


@pytest.fixture(scope="session")
def curriculum(curriculum_file):
    return load_curriculum(curriculum_file)


@pytest.fixture(scope="session")
def make_log(curriculum, tmp_path_factory):
    """Train with some settings and a seed; return the log. Equal ones are trained once."""
    folder, made = tmp_path_factory.mktemp("trainings"), {}

    def make(method="paper", seed=1, **settings):
        short = SHORT_OF[method]
        key = repr((method, seed, sorted(settings.items())))
        if key not in made:
            path = folder / f"{len(made)}.mcap"
            output = path.with_suffix(".npz")
            train(curriculum, method=method, seed=seed, set={**short, **settings}, output=output, record=path)
            made[key] = path
        return made[key]

    return make


@pytest.fixture(scope="session")
def log_path(make_log) -> Path:
    return make_log()


@pytest.fixture
def log(log_path):
    return open_training(log_path)
