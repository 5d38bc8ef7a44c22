"""Writing a log and reading it back; outputs that cannot be written."""

import contextlib
import dataclasses
import errno
import os
import subprocess
import sys
import tracemalloc
from pathlib import Path
from types import SimpleNamespace

import mcap.reader
import numpy as np
import pytest
from fireworld_recorder.chain import Digest
from fireworld_recorder.reader import open_log
from fireworld_recorder.schema import message_of
from fireworld_recorder.writer import LogWriter
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

from fireworld.errors import FieldError, LogError, OutputError
from fireworld.records import STEP_TOPICS, MemoryRecording, Recording, StoredRun
from tests.recorder import synthetic
from tests.recorder.conftest import write_log


def assert_same_record(a, b):
    assert (a.step, a.terminated, a.truncated) == (b.step, b.terminated, b.truncated)
    for topic in STEP_TOPICS:
        x, y = getattr(a, topic.topic[1:]), getattr(b, topic.topic[1:])
        for item in message_of(topic).fields:
            assert np.array_equal(getattr(x, item.name), getattr(y, item.name)), (topic.topic, item.name)
    assert (a.snapshot is None) == (b.snapshot is None)
    if a.snapshot is not None:
        assert a.snapshot.arrays.keys() == b.snapshot.arrays.keys()
        assert all(np.array_equal(a.snapshot.arrays[name], b.snapshot.arrays[name]) for name in a.snapshot.arrays)


def test_a_run_survives_writing_and_reading(log_path, records, city):
    log = open_log(log_path)
    assert log.damage is None
    assert log.state == "complete"
    assert log.header == synthetic.header()
    assert all(np.array_equal(getattr(log.city, name), value) for name, value in vars(city).items())
    assert log.steps.dtype == np.int64
    assert log.steps.tolist() == list(range(31))
    assert log.snapshots == [10, 20, 30]
    for read, written in zip(log, records, strict=True):
        assert_same_record(read, written)
    assert_same_record(log.step(17), records[17])


def test_columns_are_those_of_the_records(log_path, records, city):
    log, memory = open_log(log_path), MemoryRecording(synthetic.header(), city, records)
    for topic, name in [("/buildings", "temperature"), ("/score", "n_burning"), ("draws", "key"), ("/brigades", "hp")]:
        assert np.array_equal(log.column(topic, name), memory.column(topic, name))
    assert log.column("/buildings", "temperature").dtype == np.float32
    ragged = log.ragged("/events", "entity")
    assert [values.tolist() for values in ragged] == [values.tolist() for values in memory.ragged("/events", "entity")]
    with pytest.raises(LogError, match="0 to 30, got 31"):
        log.step(31)


@pytest.fixture(params=["log", "memory"])
def recording(request, log_path, records, city):
    """The same run as a log and in memory."""
    return open_log(log_path) if request.param == "log" else MemoryRecording(synthetic.header(), city, records)


def test_a_recording_is_what_it_says(recording, records):
    assert isinstance(recording, Recording)
    assert isinstance(recording, StoredRun)
    assert (recording.state, recording.damage) == ("complete", None)
    assert len(recording) == 31
    assert_same_record(recording.step(17), records[17])
    assert repr(recording).endswith(": synthetic, easiest, seed 7, 31 steps>")
    with pytest.raises(LogError, match="step: expected one of the steps 0 to 30, got 31"):
        recording.step(31)


def test_a_field_has_one_name_in_all_spellings(recording):
    wanted = recording.column("/buildings", "temperature")
    for names in [("buildings", "temperature"), ("buildings.temperature",), ("/buildings.temperature",)]:
        assert np.array_equal(recording.column(*names), wanted)
        assert np.array_equal(recording.ragged(*names), wanted)
    assert recording.column("draws.key").dtype == np.uint64
    assert recording.column("score.n_burning").dtype == np.int32


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (("/events", "entity"), "/events: entity: its length changes from step to step; use ragged"),
        (
            ("/buildings", "temprature"),
            "expected one of temperature, energy, fuel_share, water_litres, fieryness, got 'temprature'; try temper",
        ),
        (("buildings.heat",), "field of buildings: expected one of temperature, .*, fieryness, got 'heat'$"),
        (("buildings",), "field of buildings: expected one of temperature, .*, got ''"),
        (
            ("buildings.temperature", "x"),
            "field of buildings: expected one of .*, got 'temperature.x'; try temperature",
        ),
        (("/nothing", "x"), "topic of a recording: expected one of draws, .*, buildings, .*, events, got 'nothing'"),
        (("building", "energy"), "got 'building'; try buildings.energy"),
        (("td_error",), "got 'td_error'; try decisions.td_error"),
        (("hp",), "got 'hp'; try brigades.hp, civilians.hp"),
        (("city", "floors"), "expected one of draws, .* got 'city'"),
    ],
)
def test_names_of_no_field_are_answered_with_those_there_are(recording, names, message):
    for read in (recording.column, recording.ragged):
        if read == recording.ragged and "ragged" in message:
            continue
        with pytest.raises(FieldError, match=message) as caught:
            read(*names)
        assert isinstance(caught.value, LogError)
        assert isinstance(caught.value, ValueError)


def test_two_writings_are_identical_bytes(tmp_path, log_path, records):
    assert write_log(tmp_path / "elsewhere.mcap", records).read_bytes() == log_path.read_bytes()


def test_bytes_do_not_depend_on_the_process(tmp_path, log_path):
    code = """
import sys, pathlib
from tests.recorder import conftest, synthetic
conftest.write_log(pathlib.Path(sys.argv[1]), synthetic.run(30))
"""
    path = tmp_path / "other.mcap"
    environment = os.environ | {"PYTHONHASHSEED": "4711", "TZ": "Asia/Tokyo"}
    subprocess.run([sys.executable, "-c", code, str(path)], check=True, env=environment, cwd=Path.cwd())
    assert path.read_bytes() == log_path.read_bytes()


def test_digest_without_a_file_is_that_of_the_log(log_path, records, city):
    digest = Digest(city)
    for record in records:
        digest.write(record)
    assert digest.digest == open_log(log_path).digest


def test_digest_tells_runs_apart_but_not_their_snapshots_or_headers(tmp_path, log_path, records):
    plain = [dataclasses.replace(record, snapshot=None) for record in records]
    other_name = write_log(tmp_path / "a.mcap", plain, header=synthetic.header(policy="other"))
    assert open_log(other_name).digest == open_log(log_path).digest
    ended = [*records[:-1], dataclasses.replace(records[-1], terminated=True)]
    assert open_log(write_log(tmp_path / "b.mcap", ended)).digest != open_log(log_path).digest
    assert open_log(write_log(tmp_path / "c.mcap", synthetic.run(30, seed=8))).digest != open_log(log_path).digest


def test_other_readers_read_the_log(log_path):
    with log_path.open("rb") as file:
        reader = mcap.reader.make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert reader.get_header().profile == "fireworld"
        assert reader.get_header().library == "fireworld-log/1"
        assert summary.statistics.chunk_count == 1 + 31
        times = {(message.sequence, message.log_time, message.publish_time) for _, _, message in reader.iter_messages()}
        assert times == {(step, step * 60_000_000_000, step * 60_000_000_000) for step in range(31)}
        (metadata,) = reader.iter_metadata()
        assert metadata.name == "fireworld.run"
        assert list(metadata.metadata) == sorted(metadata.metadata)
        assert metadata.metadata["seed"] == "7"
        attachments = {item.name: item for item in reader.iter_attachments()}
    assert attachments["scenario.yaml"].data == b"name: synthetic\n"
    assert {item.create_time for item in attachments.values()} == {0}


def test_a_log_explains_itself_to_the_protobuf_library(log_path, records):
    temperatures, hashes = [], []
    with log_path.open("rb") as file:
        for schema, channel, message in mcap.reader.make_reader(file).iter_messages(["/buildings", "/commit"]):
            pool = descriptor_pool.DescriptorPool()
            for item in descriptor_pb2.FileDescriptorSet.FromString(schema.data).file:
                pool.Add(item)
            assert (schema.encoding, channel.message_encoding) == ("protobuf", "protobuf")
            decoded = message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.name)).FromString(message.data)
            if channel.topic == "/buildings":
                temperatures.append(decoded.temperature[3])
            else:
                hashes.append(decoded.hash.hex())
    assert temperatures == [record.buildings.temperature[3] for record in records]
    assert hashes[-1] == open_log(log_path).digest


def test_a_run_without_steps_is_a_log(tmp_path, city):
    log = open_log(write_log(tmp_path / "empty.mcap", []))
    assert len(log) == 0
    assert list(log) == []
    assert log.digest == Digest(city).digest
    assert log.column("/buildings", "fuel_share").shape == (0, 0)
    assert log.column("/score", "score").shape == (0,)


def test_header_survives_strange_texts(tmp_path):
    header = synthetic.header(scenario="Größe\n=x", forked_from="ab:12", seed=-3, attachments={})
    assert open_log(write_log(tmp_path / "a.mcap", [], header=header)).header == header


def test_existing_output_is_refused_and_replaced_with_force(tmp_path, records):
    path = write_log(tmp_path / "a.mcap", records[:2])
    before = path.read_bytes()
    with pytest.raises(OutputError, match=r"a\.mcap: expected a name that is free.*--force"):
        write_log(path, records[:3])
    assert path.read_bytes() == before
    write_log(path, records[:3], force=True)
    assert len(open_log(path)) == 3
    assert list(tmp_path.iterdir()) == [path]


def test_output_that_appears_meanwhile_is_not_overwritten(tmp_path, records, city):
    path = tmp_path / "a.mcap"
    writer = LogWriter(path, synthetic.header(), city)
    writer.write(records[0])
    path.write_bytes(b"somebody else's")
    with pytest.raises(OutputError, match="existing file"):
        writer.close()
    assert path.read_bytes() == b"somebody else's"


def test_leftover_of_a_killed_run_is_not_overwritten(tmp_path, records):
    partial = tmp_path / "a.mcap.partial"
    partial.write_bytes(b"precious")
    with pytest.raises(OutputError, match="recover"):
        write_log(tmp_path / "a.mcap", records[:1])
    assert partial.read_bytes() == b"precious"


def test_missing_folder_and_folder_as_output_are_refused(tmp_path, records):
    with pytest.raises(OutputError, match="an existing folder"):
        write_log(tmp_path / "no" / "a.mcap", records[:1])
    with pytest.raises(OutputError, match="the name of a file"):
        write_log(tmp_path, records[:1])
    (tmp_path / "link.mcap").symlink_to(tmp_path / "elsewhere.mcap")
    with pytest.raises(OutputError, match="the name of a regular file, got a link"):
        write_log(tmp_path / "link.mcap", records[:1], force=True)
    assert [path.name for path in tmp_path.iterdir()] == ["link.mcap"]


def test_exception_keeps_committed_steps_as_partial(tmp_path, records, city):
    path = tmp_path / "a.mcap"
    with contextlib.suppress(KeyboardInterrupt), LogWriter(path, synthetic.header(), city) as log:
        log.write(records[0])
        log.write(records[1])
        raise KeyboardInterrupt
    assert not path.exists()
    partial = open_log(tmp_path / "a.mcap.partial", partial=True)
    assert partial.steps.tolist() == [0, 1]
    assert partial.state == "partial"
    assert "good up to step 1" in partial.damage


def test_exception_before_the_first_step_leaves_nothing(tmp_path, city):
    with pytest.raises(RuntimeError), LogWriter(tmp_path / "a.mcap", synthetic.header(), city):
        raise RuntimeError
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("share_written", [0.0, 0.5])
def test_interrupt_inside_a_step_keeps_the_steps_before(tmp_path, records, city, monkeypatch, share_written):
    def interrupted(data):
        write(data[: int(len(data) * share_written)])
        raise KeyboardInterrupt

    with contextlib.suppress(KeyboardInterrupt), LogWriter(tmp_path / "a.mcap", synthetic.header(), city) as log:
        log.write(records[0])
        write = log._file.write
        monkeypatch.setattr(log._writer, "_file", SimpleNamespace(write=interrupted))
        log.write(records[1])
    assert not (tmp_path / "a.mcap").exists()
    assert open_log(tmp_path / "a.mcap.partial", partial=True).steps.tolist() == [0]


class FullDisk:
    """A file on a disk that holds only so many bytes more."""

    def __init__(self, file, room):
        self._file, self._room = file, room

    def write(self, data):
        self._room -= len(data)
        if self._room < 0:
            self._file.write(bytes(data)[: self._room])
            self._file.flush()
            raise OSError(errno.ENOSPC, "No space left on device")
        return self._file.write(data)

    def __getattr__(self, name):
        return getattr(self._file, name)


@pytest.mark.parametrize("room", [0, 100, 8_000, 15_000, 24_000, 46_000])
def test_full_disk_is_one_line_and_keeps_committed_steps(tmp_path, records, monkeypatch, room):
    path = tmp_path / "a.mcap"
    plain_open = Path.open

    def full_disk(self, mode="r"):
        file = plain_open(self, mode)
        return FullDisk(file, room) if self.suffix == ".partial" else file

    with monkeypatch.context() as patch:
        patch.setattr(Path, "open", full_disk)
        with pytest.raises(OutputError, match=r"a\.mcap: cannot be written: no space is left on the disk"):
            write_log(path, records)
    assert not path.exists()
    partial = tmp_path / "a.mcap.partial"
    if partial.exists():
        log = open_log(partial, partial=True)
        assert log.steps.tolist() == list(range(len(log)))
        assert len(log) > 0
    else:
        assert room < 10_000


def test_unwritable_folder_is_one_line(tmp_path, records, monkeypatch):
    plain_open = Path.open

    def refuse(self, mode="r"):
        if self.suffix == ".partial":
            raise PermissionError(errno.EACCES, "Permission denied")
        return plain_open(self, mode)

    monkeypatch.setattr(Path, "open", refuse)
    with pytest.raises(OutputError, match="Permission denied"):
        write_log(tmp_path / "a.mcap", records[:1])


def test_steps_must_rise(tmp_path, records, city):
    with LogWriter(tmp_path / "a.mcap", synthetic.header(), city) as log:
        log.write(records[3])
        with pytest.raises(ValueError, match="rising"):
            log.write(records[3])
        log.write(records[5])
    assert open_log(tmp_path / "a.mcap").steps.tolist() == [3, 5]
    assert open_log(tmp_path / "a.mcap").step(5).step == 5


def peak_bytes(path):
    tracemalloc.start()
    for _ in open_log(path):
        pass
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return peak


def test_memory_grows_with_a_step_not_with_the_file(tmp_path):
    big = synthetic.city(2000)
    record = synthetic.record(9, city_record=big, last=200)
    short, long = (
        write_log(tmp_path / name, [dataclasses.replace(record, step=step) for step in range(n_steps)], city=big)
        for name, n_steps in (("short.mcap", 20), ("long.mcap", 200))
    )
    assert peak_bytes(long) < 1.3 * peak_bytes(short)
