"""A training that was cut off at any byte continues, and its log becomes the same, byte for byte."""

import contextlib
import fcntl
import random
import signal
import subprocess
import sys
import time

import pytest
from fireworld_recorder.writer import PARTIAL_SUFFIX

from fireworld.errors import LogError, OutputError, TrainingError
from fireworld.training.log import verify
from fireworld.training.log.reader import TrainingLog, open_training
from fireworld.training.train import train
from fireworld.training.training import StopTraining
from tests.training.log.conftest import SHORT, SHORT_OF


def cut(whole, folder, n_bytes):
    """Leave what a kill after so many bytes leaves; return the name of the log."""
    path = folder / "t.mcap"
    for old in folder.glob("t.*"):
        old.unlink()
    path.with_name(path.name + PARTIAL_SUFFIX).write_bytes(whole[:n_bytes])
    return path


@pytest.mark.slow
@pytest.mark.parametrize(("method", "short"), [*SHORT_OF.items()])
def test_a_log_that_was_cut_anywhere_is_continued_to_the_same_bytes(curriculum, make_log, tmp_path, method, short):
    source = make_log(method)
    whole, team = source.read_bytes(), source.with_suffix(".npz").read_bytes()
    places = random.Random(7)
    n_continued = 0
    for n_bytes in [0, 1, 8, 9, 100, *(places.randrange(k * len(whole) // 30, len(whole)) for k in range(30))]:
        path = cut(whole, tmp_path, n_bytes)
        output = path.with_suffix(".npz")
        with contextlib.suppress(LogError):  # the header is not there yet
            n_continued += len(open_training(path.with_name(path.name + PARTIAL_SUFFIX), partial=True)) > 0
        train(curriculum, method=method, set=short, output=output, record=path, resume=True)
        assert path.read_bytes() == whole
        assert output.read_bytes() == team
        assert sorted(one.name for one in tmp_path.glob("t.*")) == ["t.mcap", "t.npz"]
    assert n_continued >= 10


def test_the_table_of_reports_is_whole_too(curriculum, make_log, tmp_path):
    whole = make_log().read_bytes()
    train(curriculum, set=SHORT, log=tmp_path / "all.csv")
    path = cut(whole, tmp_path, len(whole) // 2)
    train(curriculum, set=SHORT, record=path, log=tmp_path / "t.csv", resume=True)
    assert (tmp_path / "t.csv").read_bytes() == (tmp_path / "all.csv").read_bytes()


def test_a_callback_stops_and_resume_continues(curriculum, make_log, tmp_path):
    path = tmp_path / "t.mcap"

    def stop(training, report):
        if training.n_reports == 5:
            raise StopTraining

    train(curriculum, set=SHORT, output=tmp_path / "t.npz", record=path, callbacks=[stop])
    assert [one.name for one in tmp_path.iterdir()] == ["t.mcap.partial"]
    assert len(open_training(tmp_path / "t.mcap.partial", partial=True)) == 5
    train(curriculum, set=SHORT, output=tmp_path / "t.npz", record=path, resume=True)
    assert path.read_bytes() == make_log().read_bytes()


def test_a_missing_team_is_made_of_a_log_that_is_whole(curriculum, make_log, tmp_path):
    path = tmp_path / "t.mcap"
    path.write_bytes(make_log().read_bytes())
    train(curriculum, set=SHORT, output=tmp_path / "t.npz", record=path, resume=True)
    assert (tmp_path / "t.npz").read_bytes() == make_log().with_suffix(".npz").read_bytes()
    assert path.read_bytes() == make_log().read_bytes()


def test_a_foreign_file_is_not_replaced(curriculum, tmp_path):
    path = tmp_path / "t.mcap.partial"
    path.write_text("my notes")
    with pytest.raises(LogError, match="expected an MCAP recording"):
        train(curriculum, set=SHORT, record=tmp_path / "t.mcap", resume=True)
    assert path.read_text() == "my notes"


def test_the_log_of_another_training_is_not_continued(curriculum, make_log, tmp_path):
    whole = make_log().read_bytes()
    path = cut(whole, tmp_path, len(whole) // 2)
    left = path.with_name(path.name + PARTIAL_SUFFIX).read_bytes()
    for changed, message in [
        ({"set": {**SHORT, "alpha": 0.1}}, "method.alpha: expected 0.1, got 0.7"),
        ({"seed": 9}, "seed: expected 9, got 1"),
        ({"stages": "alone"}, "curriculum.digest: expected"),
    ]:
        with pytest.raises(TrainingError, match=message):
            train(curriculum, **{"set": SHORT, **changed}, record=path, resume=True)
    with pytest.raises(
        OutputError, match="expected no checkpoint, got one of an earlier training; continue from it with --resume"
    ):
        train(curriculum, set=SHORT, record=path)
    assert path.with_name(path.name + PARTIAL_SUFFIX).read_bytes() == left
    assert not path.exists()


def test_damage_in_the_middle_costs_what_comes_after_it(curriculum, make_log, tmp_path):
    whole = bytearray(make_log().read_bytes())
    whole[2 * len(whole) // 3] ^= 1
    path = cut(bytes(whole), tmp_path, len(whole))
    train(curriculum, set=SHORT, record=path, resume=True)
    assert path.read_bytes() == make_log().read_bytes()


def test_a_log_that_is_still_written_is_not_continued(curriculum, make_log, tmp_path):
    whole = make_log().read_bytes()
    path = cut(whole, tmp_path, len(whole) // 2)
    partial = path.with_name(path.name + PARTIAL_SUFFIX)
    with partial.open("rb") as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        with pytest.raises(OutputError, match=r"t\.mcap\.partial: another process is writing it"):
            train(curriculum, set=SHORT, record=path, resume=True)
    assert [one.name for one in tmp_path.glob("t.*")] == [partial.name]
    assert partial.read_bytes() == whole[: len(whole) // 2]
    train(curriculum, set=SHORT, record=path, resume=True)
    assert path.read_bytes() == whole


@pytest.mark.slow
def test_a_training_that_is_killed_continues(curriculum_file, make_log, tmp_path):
    """Real kills at random moments, one after another, of one training."""
    settings = [word for key, value in SHORT.items() for word in ("--set", f"{key}={value}")]
    words = ["train", curriculum_file, *settings, "-o", tmp_path / "t.npz", "--record", tmp_path / "t.mcap"]
    command = [sys.executable, "-m", "fireworld", *map(str, words)]
    moments, n_kills = random.Random(3), 0
    while not (tmp_path / "t.npz").exists():
        begun = (tmp_path / "t.mcap").exists() or (tmp_path / "t.mcap.partial").exists()
        process = subprocess.Popen([*command, *(["--resume"] if begun else [])], stderr=subprocess.DEVNULL)
        deadline = time.monotonic() + 60
        while process.poll() is None and not any(tmp_path.glob("t.mcap*")) and time.monotonic() < deadline:
            time.sleep(0.002)
        time.sleep(moments.random() * 0.02)
        process.send_signal(signal.SIGKILL)
        n_kills += process.wait() == -signal.SIGKILL
        partial = tmp_path / "t.mcap.partial"
        if n_kills >= 8:
            subprocess.run([*command, *(["--resume"] if partial.exists() else [])], check=True, capture_output=True)
    assert (tmp_path / "t.mcap").read_bytes() == make_log().read_bytes()
    assert n_kills > 0


@pytest.mark.parametrize(("method", "short"), [*SHORT_OF.items()])
def test_another_simulator_continues_what_it_learns_alike(curriculum, make_log, tmp_path, monkeypatch, method, short):
    """As verification does, it is judged by what comes out of the last part, not by its sources."""
    whole = make_log(method).read_bytes()
    path = cut(whole, tmp_path, 9 * len(whole) // 10)
    monkeypatch.setattr(verify, "simulator_digest", lambda: "ab" * 32)
    train(curriculum, method=method, set=short, record=path, resume=True)
    assert path.read_bytes() == whole


@pytest.mark.parametrize(("method", "short"), [*SHORT_OF.items()])
def test_another_simulator_that_learns_otherwise_is_noticed(curriculum, make_log, tmp_path, monkeypatch, method, short):
    whole = make_log(method).read_bytes()
    path = cut(whole, tmp_path, 9 * len(whole) // 10)
    partial = path.with_name(path.name + PARTIAL_SUFFIX)
    before = TrainingLog.trainer_before
    monkeypatch.setattr(TrainingLog, "trainer_before", lambda log, number: before(log, number - 1))
    monkeypatch.setattr(verify, "simulator_digest", lambda: "ab" * 32)
    last = len(open_training(partial, partial=True)) - 1
    unit = {"paper": "episode", "targets": "lesson"}.get(method, "generation")
    wanted = rf"t\.mcap\.partial: simulator: expected .*\+[0-9a-f]{{12}}, got .* with which {unit} {last} comes out"
    with pytest.raises(TrainingError, match=f"{wanted} otherwise; begin again with --force"):
        train(curriculum, method=method, set=short, record=path, resume=True)
    assert partial.read_bytes() == whole[: 9 * len(whole) // 10]
