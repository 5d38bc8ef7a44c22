"""Trainings elsewhere: the same files in however many pieces, stopped and continued, and what stays at home."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from threading import Event

import pytest

from fireworld.errors import TrainingError
from fireworld.executors import On, Workers
from fireworld.training import elsewhere
from fireworld.training.train import prepare_trainings
from fireworld.training.training import train_all

SHORT = {
    "paper": {"n_episodes_max": 8},
    "search": {"n_generations": 3, "n_candidates": 6, "n_best": 2, "n_fires": 2, "n_steps_max": 30},
    "targets": {"n_lessons": 3, "n_fights": 4, "n_steps_max": 20, "hidden": 4},
}


def prepared(folder, method, **more):
    return prepare_trainings(
        "quick", method=method, set=SHORT[method], repetitions=2, output=folder / "team.npz", **more
    )


def files(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.parametrize("method", [*SHORT])
def test_pieces_make_the_same_files_after_a_stop_too(method, tmp_path, monkeypatch):
    monkeypatch.setattr(elsewhere, "SLICE_SECONDS", 0.0)
    home, far = tmp_path / "home", tmp_path / "far"
    home.mkdir()
    far.mkdir()
    train_all(prepared(home, method, log=home / "log.csv"), jobs=1)
    seen = []

    def train(trainings, callback):
        workers = Workers(2, Event(), ThreadPoolExecutor, elsewhere=True)
        elsewhere.train_elsewhere(trainings, workers, [lambda *given: callback(workers, *given)])

    def stop_early(workers, *_):
        seen.append(1)
        workers.stop.set()

    train(prepared(far, method, log=far / "log.csv"), stop_early)
    assert 1 <= len(seen) <= 4
    assert "team-1.npz" not in files(far)
    for path in far.glob("*.csv"):
        path.unlink(missing_ok=True)
    train(prepared(far, method, log=far / "log.csv", resume=True), lambda *_: None)
    assert files(far) == files(home)


@pytest.mark.slow
def test_processes_make_the_same_files(tmp_path):
    home, far = tmp_path / "home", tmp_path / "far"
    home.mkdir()
    far.mkdir()
    train_all(prepared(home, "paper"), jobs=1)
    train_all(prepared(far, "paper"), executor=On("processes", 2))
    assert files(far) == files(home)


def test_recorded_trainings_stay_at_home(tmp_path):
    trainings = prepared(tmp_path, "paper", record=tmp_path / "log.mcap")
    with pytest.raises(TrainingError, match="--on: expected threads, where trainings are recorded, got 'processes'"):
        train_all(trainings, executor="processes")
