"""A log of every format version stays readable for ever: these files are never made anew."""

from pathlib import Path

import pytest

from recorder.chain import Digest
from recorder.reader import open_log

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


def test_its_records_still_have_its_digest():
    """Encoding what was decoded gives the same bytes: a golden log stays comparable without being read."""
    log = open_log(DATA / "fireworld-log-1.mcap")
    digest = Digest(log.city)
    for record in log:
        digest.add(record)
    assert digest.digest == log.digest
