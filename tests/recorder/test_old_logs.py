"""A log of every format version stays readable for ever: these files are never made anew."""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest
from fireworld_recorder.chain import Digest
from fireworld_recorder.reader import open_log
from fireworld_recorder.schema import message_of

from fireworld.records import STEP_TOPICS, CityRecord

DATA = Path(__file__).with_name("data")


def test_log_of_format_1():
    log = open_log(DATA / "fireworld-log-1.mcap")
    assert log.digest == "591dac7c1efaea2c0dd99a285bdbbb689287889db8a11f1497bd87c1f3951950"
    assert (log.header.scenario, log.header.seed, log.header.n_steps_max) == ("synthetic", 7, 500)
    assert sorted(log.header.attachments) == ["policy.npz", "scenario.yaml"]
    assert log.steps.tolist() == [0, 1, 2, 3, 4]
    assert log.snapshots == [2, 4]
    assert log.city.building_id.tolist() == [250, 253, 256, 259, 262]
    assert log.column("/buildings", "temperature")[:, 3].tolist() == pytest.approx(
        [67.56216, 47.98658, 204.85234, 219.37872, 155.34035], rel=1e-6
    )
    assert log.step(3).decisions.q_values.tolist()[:2] == [0.40432197965195565, -1.5239942546930803]
    assert log.step(4).snapshot.arrays["hp"].tolist() == [0, 1, 2, 3]
    assert log.step(4).truncated


def digests_of(log):
    """Digest every field of every topic over all steps, and of the city."""
    digests = {}
    for record_type in (CityRecord, *STEP_TOPICS):
        for item in message_of(record_type).fields:
            of_city = record_type is CityRecord
            parts = [log.city] if of_city else [getattr(record, record_type.topic[1:]) for record in log]
            values = [np.asarray(getattr(part, item.name)) for part in parts]
            content = b"".join(b"%d:" % value.size + np.char.encode(value, "utf-8").tobytes()
                               if value.dtype.kind == "U" else b"%d:" % value.size + value.tobytes()
                               for value in values)  # fmt: skip
            digests[f"{record_type.topic}.{item.name}"] = hashlib.sha256(content).hexdigest()
    return digests


def test_every_value_of_format_1_is_read_as_it_was_written():
    pinned = json.loads((DATA / "fireworld-log-1.json").read_text(encoding="utf-8"))
    path = DATA / "fireworld-log-1.mcap"
    assert hashlib.sha256(path.read_bytes()).hexdigest() == pinned.pop("file"), "the file is never made anew"
    found = digests_of(open_log(path))
    assert {name: found[name] for name in pinned} == pinned
    assert len(pinned) == 98


def test_its_records_still_have_its_digest():
    """Encoding what was decoded gives the same bytes: a golden log stays comparable without being read."""
    log = open_log(DATA / "fireworld-log-1.mcap")
    digest = Digest(log.city)
    for record in log:
        digest.write(record)
    assert digest.digest == log.digest
