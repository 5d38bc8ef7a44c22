"""Networks improved generation by generation: the same for any number of threads, resumed, and from their logs."""

from __future__ import annotations

import pytest

from fireworld.errors import LogError, TrainingError
from fireworld.executors import threads
from fireworld.policy.teams.team import load_team
from fireworld.training.log.reader import open_training
from fireworld.training.log.verify import verify_training
from fireworld.training.methods.evolution import Evolution
from fireworld.training.methods.gates import Gates
from fireworld.training.methods.imitation import Imitation
from fireworld.training.methods.rollouts import Rollouts
from fireworld.training.train import train
from fireworld.training.training import StopTraining
from tests.training.generations import (
    CONDITIONS,
    SHORT_EVOLUTION,
    SHORT_GATES,
    SHORT_IMITATION,
    SHORT_ROLLOUTS,
    maker,
    read,
)

METHODS = [Evolution(**SHORT_EVOLUTION), Gates(**SHORT_GATES), Imitation(**SHORT_IMITATION), Rollouts(**SHORT_ROLLOUTS)]
N_NUMBERS = {"evolution": 85, "gates": 40, "imitation": 85, "rollouts": 255}
WIDTHS = {"evolution": "26-3-1", "gates": "19-15-4-1", "imitation": "26-3-1", "rollouts": "26-9-1"}
ANOTHER = {
    "evolution": ({"hidden": 2}, 57),
    "gates": ({"n_rankings": 3}, 60),
    "imitation": ({"hidden": 2}, 57),
    "rollouts": ({"hidden": 2}, 171),
}
"""Hyperparameters of another network, and how many numbers it has."""


@pytest.fixture(scope="module")
def fires(tmp_path_factory):
    return read(CONDITIONS, tmp_path_factory.mktemp("generations"))


@pytest.fixture(scope="module", params=METHODS, ids=lambda method: method.name)
def method(request):
    return request.param


@pytest.fixture(scope="module")
def make(fires, method):
    return maker(fires, method)


def state_at_the_end(trainer):
    """Train to the end; return all that it needs to continue, and the team."""
    list(trainer)
    assert trainer.done
    return trainer.team().to_bytes(), *(array.tobytes() for array in trainer.state().values())


def test_the_same_whatever_the_number_of_threads(make):
    one, two = make(), make()
    reports = [list(trainer.run(threads(n))) for trainer, n in ((one, 1), (two, 2))]
    assert reports[0] == reports[1]
    assert [report.generation for report in reports[0]] == [0, 1]
    assert state_at_the_end(one) == state_at_the_end(two)


def test_resumed_from_a_checkpoint_and_from_a_log_it_ends_with_the_same_bytes(fires, method, tmp_path):
    def stop(training, report):
        if training.n_reports == 1:
            raise StopTraining

    def bytes_of(name, *, record, **options):
        names = {"output": tmp_path / f"{name}.npz", **({"record": tmp_path / f"{name}.mcap"} if record else {})}
        train(fires, method=method, **names, **options)
        return [path.read_bytes() for path in names.values() if path.exists()]

    for record in (True, False):
        whole = bytes_of(f"whole-{record}", record=record, jobs=2)
        name = f"parted-{record}"
        assert len(bytes_of(name, record=record, jobs=1, callbacks=[stop])) == 0
        assert bytes_of(name, record=record, jobs=1, resume=True) == whole
    assert verify_training(open_training(tmp_path / "whole-True.mcap")).same


def test_a_log_is_followed_to_the_same_state(fires, method, make, tmp_path):
    path = tmp_path / "t.mcap"
    train(fires, method=method, record=path)
    log, trained, followed = open_training(path), make(), make()
    reports = list(trained)
    assert [followed.follow(part) for part in log.parts()] == reports == [report for _, report in log.reports()]
    assert followed.points(reports[-1]) == trained.points(reports[-1])
    assert state_at_the_end(followed) == state_at_the_end(trained)
    assert log.team().digest == trained.team().digest
    with pytest.raises(LogError, match=f"^a part holds no generation of networks of {N_NUMBERS[method.name]} numbers$"):
        make(start="none").follow({})
    changes, n_numbers = ANOTHER[method.name]
    with pytest.raises(LogError, match=f"^a part holds no generation of networks of {n_numbers} numbers$"):
        make(**changes).follow(next(iter(log.parts())))


def test_checkpoints_of_others(make, method):
    trainer = make()
    with pytest.raises(TrainingError, match=f"^t.npz: expected a network of {WIDTHS[method.name]}, got"):
        trainer.restore(make(**ANOTHER[method.name][0]).team(), trainer.state(), source="t.npz")
    with pytest.raises(TrainingError, match=r"^t.npz: expected a network, got"):
        trainer.restore(load_team("best-2026"), trainer.state(), source="t.npz")
