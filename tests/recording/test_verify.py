"""Verify: whose simulator recorded it, and whether it is the recording that is trusted."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from fireworld_recorder.reader import open_log
from fireworld_recorder.writer import LogWriter

import fireworld as fw
from fireworld import version
from fireworld.arguments import ArgumentError
from fireworld.version import simulator_digest, simulator_version


@pytest.fixture(scope="module")
def log_path(tmp_path_factory):
    path = tmp_path_factory.mktemp("logs") / "run.mcap"
    fw.run("quick", policy="chief", steps=12, record=path)
    return path


def copied(log_path, path, change=lambda record: record, **header):
    """Write a log again as others could: changed, with all its hashes made anew."""
    log = open_log(log_path)
    with LogWriter(path, replace(log.header, **header), log.city) as writer:
        for record in log:
            writer.write(change(record))
    return path


def test_a_recording_has_the_digest_of_its_simulator(log_path, fireworld):
    log = open_log(log_path)
    assert log.header.simulator_digest == simulator_digest()
    assert f"fireworld    {simulator_version()}\n" in fireworld("info", log_path).out
    assert json.loads(fireworld("info", log_path, "--json").out)["header"]["simulator_digest"] == simulator_digest()


def test_the_digest_is_of_the_sources(monkeypatch, tmp_path):
    for name in ("kernels", "draws.py"):
        monkeypatch.setattr(version, "_SIMULATOR", (name,))
        simulator_digest.cache_clear()
        assert len(simulator_digest()) == 64
    one = simulator_digest()
    simulator_digest.cache_clear()
    (tmp_path / "draws.py").write_bytes((version.Path(version.__file__).parent / "draws.py").read_bytes())
    monkeypatch.setattr(version, "__file__", str(tmp_path / "version.py"))
    assert simulator_digest() == one
    simulator_digest.cache_clear()
    content = (tmp_path / "draws.py").read_bytes()
    (tmp_path / "draws.py").write_bytes(content.replace(b"\n", b"\r\n"))  # as git may write it elsewhere
    assert simulator_digest() == one
    simulator_digest.cache_clear()
    (tmp_path / "draws.py").write_bytes(content + b"# one more line\n")
    assert simulator_digest() != one
    monkeypatch.undo()
    simulator_digest.cache_clear()


def test_it_moves_no_digest_of_a_run_and_older_logs_do_without(log_path, tmp_path, fireworld):
    old = copied(log_path, tmp_path / "old.mcap", simulator_digest="")
    assert open_log(old).digest == open_log(log_path).digest
    assert "fireworld    0.1.0\n" in fireworld("info", old).out
    assert not fw.diff(old, log_path).header
    other = copied(log_path, tmp_path / "other.mcap", simulator_digest="ab" * 32)
    assert fw.diff(other, log_path).header == {"simulator_digest": ("ab" * 32, simulator_digest())}
    said = (
        f"changed: simulator: {simulator_version()}, was 0.1.0+abababababab; scenario, policy and seed are the same\n"
    )
    assert said in fireworld("diff", other, log_path).out


def test_who_recorded_what_is_computed_otherwise(log_path, tmp_path, fireworld):
    def warmer(record):
        temperature = record.buildings.temperature + np.float32(record.step == 7)
        return replace(record, buildings=replace(record.buildings, temperature=temperature))

    other = copied(log_path, tmp_path / "other.mcap", warmer, simulator_digest="ab" * 32)
    done = fireworld("verify", other)
    assert done.code == 1
    assert f"recorded by fireworld 0.1.0+abababababab; this is {simulator_version()}\n" in done.out
    same = copied(log_path, tmp_path / "same.mcap", warmer)
    assert "recorded by" not in fireworld("verify", same).out


def test_a_log_made_anew_is_not_the_one_that_is_trusted(log_path, tmp_path, fireworld):
    """A policy that is said to have done what it has not: every hash and the replay are right."""
    digest = open_log(log_path).digest
    longer = tmp_path / "other.mcap"
    fw.run("quick", policy="best", steps=12, record=longer)
    forged = copied(longer, tmp_path / "forged.mcap", policy="chief")
    assert fireworld("verify", forged).code == 0
    done = fireworld("verify", forged, "--trust", digest)
    assert done.code == 1
    assert done.out.endswith("; this is not the recording you trust\n")
    assert not fw.verify(forged, trust=digest)
    assert fireworld("verify", log_path, "--trust", digest).code == 0
    assert fireworld("verify", log_path, "--trust", digest[:12].upper()).code == 0
    found = json.loads(fireworld("verify", forged, "--trust", digest, "--json").out)
    assert (found["same"], found["trust"], found["is_trusted"]) == (True, digest, False)


@pytest.mark.parametrize("trust", ["", "abc", "x" * 64, "a" * 65, 7])
def test_what_is_no_digest(log_path, fireworld, trust):
    with pytest.raises(ArgumentError, match="trust: expected a digest: 12 to 64 hexadecimal digits"):
        fw.verify(log_path, trust=trust)
    done = fireworld("verify", log_path, "--trust", trust)
    assert done.code == 2
    assert done.err.count("\n") == 1


def test_trainings_too(tmp_path, fireworld):
    path = tmp_path / "training.mcap"
    fw.train("paper", set={"n_episodes_max": 2}, output=tmp_path / "team.npz", record=path)
    digest = fw.open_training(path).digest
    assert fw.open_training(path).header.simulator_digest == simulator_digest()
    assert f"fireworld    {simulator_version()}\n" in fireworld("info", path).out
    assert fw.verify(path, trust=digest)
    done = fireworld("verify", path, "--trust", "0" * 12)
    assert done.code == 1
    assert "this is not the recording you trust" in done.out
