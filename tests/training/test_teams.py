"""Trainings that stop and go on: bit for bit the same team, and nothing of another training is taken up or lost."""

from __future__ import annotations

import errno
import zipfile
from pathlib import Path
from threading import Event

import numpy as np
import pytest

from fireworld.errors import OutputError, TrainingError
from fireworld.executors import threads
from fireworld.policy.teams.team import load_team, read_team, write_team
from fireworld.training.methods.sarsa import EpisodeReport
from fireworld.training.training import Training, train_all


def run(training, *, until=None):
    """Train, and ask to stop after a number of episodes."""
    workers, seen = threads(1), []

    def report(_, episode):
        seen.append(episode)
        if len(seen) == until:
            workers.stop.set()

    training.run(workers, [report])
    return seen


@pytest.fixture
def make_training(make_trainer, here):
    def make(name="team.npz", seed=1, *, force=False, **changes):
        log_path = (here / name).with_suffix(".csv")
        return Training(make_trainer(seed, **changes), here / name, log_path=log_path, force=force)

    return make


@pytest.fixture
def whole(make_training):
    """A training without an interruption."""
    training = make_training("whole.npz")
    run(training)
    return training


@pytest.mark.slow
@pytest.mark.parametrize("stops", [(1,), (4, 1, 9), (7, 8)])
def test_resumed_bit_for_bit(make_training, whole, here, stops):
    n_done = 0
    for n_episodes in stops:
        training = make_training()
        assert training.resume() == (n_done > 0)
        run(training, until=n_episodes)
        n_done += n_episodes
        assert sorted(path.name for path in here.glob("team*")) == ["team.npz.checkpoint"]
        assert len(training.log.splitlines()) == n_done
    training = make_training()
    assert training.resume()
    run(training)
    assert training.team.digest == whole.team.digest
    for suffix in (".npz", ".csv"):
        assert (here / f"team{suffix}").read_bytes() == (here / f"whole{suffix}").read_bytes()
    assert not training.checkpoint.exists()


def test_the_log_has_a_line_for_every_episode(whole, make_trainer):
    lines = whole.log_path.read_text().splitlines()
    assert lines[0] == ",".join(EpisodeReport.columns())
    assert len(lines) == 1 + len(list(make_trainer()))
    row = dict(zip(lines[0].split(","), lines[1].split(","), strict=True))
    assert (row["scenario"], row["episode"], row["epsilon"], row["converged"]) == ("alone-1", "0", "1.0", "False")


@pytest.mark.slow
def test_several_at_a_time_are_those_one_by_one(make_training, whole, here):
    trainings = [make_training(f"t-{k}.npz", seed=k) for k in (1, 2, 3)]
    train_all(trainings, jobs=2)
    assert sorted(path.name for path in here.glob("t-*.npz")) == ["t-1.npz", "t-2.npz", "t-3.npz"]
    assert (here / "t-1.npz").read_bytes() == (here / "whole.npz").read_bytes()
    assert len({training.team.digest for training in trainings}) == 3


def test_one_that_fails_stops_the_others_gently(make_training, here):
    trainings = [
        make_training(f"t-{k}.npz", seed=k, n_episodes_unchanged="1000", n_episodes_max="2000") for k in (1, 2)
    ]

    both_train = Event()

    def report(training, episode):
        if training is trainings[1]:
            both_train.set()
        elif both_train.is_set():
            raise OutputError("disk full")

    with pytest.raises(OutputError, match="disk full"):
        train_all(trainings, jobs=2, callbacks=[report])
    assert trainings[1].checkpoint.exists()
    assert trainings[1].team is None


def stopped(training):
    run(training, until=8)
    return training.checkpoint


@pytest.mark.parametrize(
    ("seed", "changes", "message"),
    [
        (2, {}, r"team.npz.checkpoint: seed: expected 2, got 1; name what it was begun with"),
        (1, {"gamma": "0.9"}, r"method.gamma: expected 0.9, got 0.5"),
        (1, {"n_episodes_max": "7"}, r"method.n_episodes_max: expected 7, got 6"),
    ],
)
def test_a_checkpoint_of_another_training(make_training, seed, changes, message):
    checkpoint = stopped(make_training())
    content = checkpoint.read_bytes()
    with pytest.raises(TrainingError, match=message):
        make_training(seed=seed, **changes).resume()
    assert checkpoint.read_bytes() == content


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("curriculum", {"name": "tiny", "digest": "0" * 64}, "curriculum.digest: expected "),
        ("fireworld", "0.0.9", "fireworld: expected .*, got '0.0.9'"),
        ("method", 3, "method.commit"),
    ],
)
def test_a_checkpoint_of_another_curriculum_or_version(make_training, key, value, message):
    checkpoint = stopped(make_training())
    team, extra = read_team(checkpoint)
    team.provenance[key] = value
    write_team(team, checkpoint, force=True, extra=extra)
    with pytest.raises(TrainingError, match=message):
        make_training().resume()


@pytest.mark.parametrize(
    ("extra", "message"),
    [
        ({}, "expected a checkpoint"),
        ({"place": np.array([1.0, 2.0, 0.0])}, "expected a checkpoint"),
        ({"place": np.array([9, 0, 0])}, r"place: expected .* within the curriculum, got '?\[9, 0, 0\]"),
        ({"place": np.array([-1, 0, 0])}, "within the curriculum"),
        ({"place": np.array([1, 6, 0])}, "within the curriculum"),
        ({"place": np.array([4, 1, 0])}, "within the curriculum"),
        ({"place": np.array([1, 2, 3])}, "within the curriculum"),
        ({"place": np.array([3, 0, 0])}, r"tables: expected shape \(3, 4320, 4\), got '?\(1, 270, 4\)"),
        ({"place": np.array([1, 2, 0]), "log": np.array([255], dtype=np.uint8)}, "log: expected text"),
    ],
)
def test_a_checkpoint_that_makes_no_sense(make_training, extra, message):
    checkpoint = stopped(make_training())
    team, _ = read_team(checkpoint)
    log = {"log": np.zeros(0, dtype=np.uint8)} if extra else {}
    write_team(team, checkpoint, force=True, extra={**log, **extra})
    with pytest.raises(TrainingError, match=message):
        make_training().resume()


def test_a_cut_off_checkpoint(make_training):
    checkpoint = stopped(make_training())
    checkpoint.write_bytes(checkpoint.read_bytes()[:-40])
    with pytest.raises(TrainingError, match=r"expected a team file \(.npz\), got BadZipFile"):
        make_training().resume()


def test_a_finished_team_is_left_as_it_is(make_training, whole):
    again = make_training("whole.npz")
    assert again.resume()
    run(again)
    assert again.team.digest == whole.team.digest
    with pytest.raises(TrainingError, match="seed"):
        make_training("whole.npz", seed=2).resume()


def test_what_is_in_the_way(make_training, whole, here):
    with pytest.raises(OutputError, match=r"whole.npz: expected a name that is free.*--force"):
        make_training("whole.npz").begin()
    make_training("whole.npz", force=True).begin()
    checkpoint = stopped(make_training())
    with pytest.raises(OutputError, match=r"expected no checkpoint.*--resume.*--force"):
        make_training().begin()
    forced = make_training(force=True)
    forced.begin()
    run(forced)
    assert not checkpoint.exists()
    with pytest.raises(OutputError, match=r"an existing folder .*, got 'none'; make it first$"):
        Training(whole.trainer, here / "absent" / "a.npz").begin()
    with pytest.raises(OutputError, match=r"got a folder$"):
        Training(whole.trainer, here, force=True).begin()
    assert load_team(here / "team.npz").digest == whole.team.digest


def test_a_checkpoint_after_every_scenario(make_training, curriculum):
    training, places = make_training(), []

    def report(training, episode):
        if training.checkpoint.exists():
            places.append(read_team(training.checkpoint)[1]["place"].tolist())

    training.run(threads(1), [report])
    expected = [[number, 0, 0] for number in range(1, curriculum.n_scenarios)]
    assert [list(place) for place in dict.fromkeys(tuple(place[:3]) for place in places)] == expected
    assert len({place[3] for place in places}) > 1, "episodes of the scenarios before"


class FullDisk(zipfile.ZipFile):
    """A writer that finds no space left for what is not a checkpoint."""

    def __init__(self, file, *words, **more):
        if isinstance(file, Path) and self.fails_at(file):
            raise OSError(errno.ENOSPC, "No space left on device")
        super().__init__(file, *words, **more)

    def fails_at(self, file):
        return file.name.endswith(".npz")


def test_a_full_disk_loses_no_training(make_training, whole, here, monkeypatch):
    training = make_training()
    with monkeypatch.context() as full:
        full.setattr(zipfile, "ZipFile", FullDisk)
        message = r"team.npz: cannot be written: No space left on device; continue from .*checkpoint with --resume$"
        with pytest.raises(OutputError, match=message):
            run(training)
    assert training.team is None
    assert sorted(path.name for path in here.glob("team*")) == ["team.npz.checkpoint"]
    again = make_training()
    assert again.resume()
    assert again.trainer.done
    assert not run(again), "nothing is trained again"
    assert sorted(path.name for path in here.glob("team*")) == ["team.csv", "team.npz"]
    for suffix in (".npz", ".csv"):
        assert (here / f"team{suffix}").read_bytes() == (here / f"whole{suffix}").read_bytes()


def test_a_log_that_cannot_be_written_loses_no_training(make_training, whole, here, monkeypatch):
    training = make_training()
    training.log_path = here / "absent" / "log.csv"
    with pytest.raises(OutputError, match=r"log.csv: cannot be written: No such file or directory; continue from "):
        run(training)
    assert not training.path.exists()
    assert load_team(training.checkpoint).digest == whole.team.digest


def test_a_disk_that_fills_up_leaves_the_checkpoint_before(make_training, whole, monkeypatch):
    training = make_training()
    with monkeypatch.context() as full:

        def report(training, episode):
            if training.checkpoint.exists():
                full.setattr(FullDisk, "fails_at", lambda *_: True)

        full.setattr(zipfile, "ZipFile", FullDisk)
        with pytest.raises(OutputError, match=r"checkpoint: cannot be written: .*; continue from .* with --resume$"):
            training.run(threads(1), [report])
    again = make_training()
    assert again.resume()
    assert again.trainer.progress.scenario_number == 1
    run(again)
    assert again.team.digest == whole.team.digest


class Killed(BaseException):
    """What nothing catches, like the end of a process."""


def test_a_kill_while_a_checkpoint_is_written_leaves_the_one_before(make_training, whole, here, monkeypatch):
    checkpoint = stopped(make_training())
    content, write_array, n_left = checkpoint.read_bytes(), np.lib.format.write_array, [2]

    def write_some(*words, **more):
        n_left[0] -= 1
        if n_left[0] == 0:
            raise Killed
        write_array(*words, **more)

    resumed = make_training()
    assert resumed.resume()
    with monkeypatch.context() as dying:
        dying.setattr(np.lib.format, "write_array", write_some)
        with pytest.raises(Killed):
            run(resumed, until=2)
    assert checkpoint.read_bytes() == content
    (here / ".fireworld-left").mkdir()
    (here / ".fireworld-left" / "team.npz.checkpoint").write_bytes(b"what a kill leaves behind")
    training = make_training()
    assert training.resume()
    run(training)
    assert training.team.digest == whole.team.digest
    assert sorted(path.name for path in here.glob("team*")) == ["team.csv", "team.npz"]
