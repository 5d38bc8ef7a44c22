"""Logs that were cut off, killed, altered or written by others: a clear error or a verified beginning, nothing else."""

import dataclasses
import os
import random
import signal
import struct
import subprocess
import sys
import tracemalloc

import numpy as np
import pytest
from fireworld_recorder.chain import Chain, step_messages
from fireworld_recorder.codec import decode, encode
from fireworld_recorder.container import MAGIC
from fireworld_recorder.header import to_metadata
from fireworld_recorder.reader import open_log
from fireworld_recorder.recover import recover
from fireworld_recorder.schema import Channel, Commit
from fireworld_recorder.writer import LogWriter, StepFile, own_channels
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from fireworld.errors import LogError, OutputError
from tests.recorder import synthetic
from tests.recorder.conftest import write_log

pytestmark = pytest.mark.slow


def raw_steps(path):
    return [[(topic, bytes(payload)) for topic, payload in raw] for raw in open_log(path, partial=True).raw_steps()]


def open_if_possible(path):
    """Open a changed log; None if it is refused, with one line that names it."""
    try:
        return open_log(path, partial=True)
    except LogError as error:
        message = str(error)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message
    return None


class Checker:
    """Checks what can be read of a changed log against the original."""

    def __init__(self, folder, original):
        self._path = folder / "changed.mcap"
        self._path.write_bytes(original)
        self._original = original
        self._steps = raw_steps(self._path)
        self._rescued = {}
        self._n_checks = 0

    def check(self, data):
        """Return how many steps are readable, -1 if the log is not."""
        assert data != self._original
        self._path.write_bytes(data)
        with pytest.raises(LogError, match=r"changed\.mcap: "):
            open_log(self._path)
        log = open_if_possible(self._path)
        if log is None:
            return -1
        assert log.damage is not None
        assert log.header == synthetic.header()
        steps = raw_steps(self._path)
        assert steps == self._steps[: len(steps)]
        assert len(list(log)) == len(steps)
        self._n_checks += 1
        if steps and self._n_checks % 5 == 0:
            self._check_recovery(log)
        return len(steps)

    def _check_recovery(self, log):
        """What is rescued is a whole log of these steps, and the same bytes whatever the damage was."""
        output = self._path.with_name("rescued.mcap")
        assert recover(self._path, output, force=True).digest == log.digest
        data = output.read_bytes()
        if self._rescued.setdefault(len(log), data) is data:
            assert open_log(output).digest == log.digest
            assert raw_steps(output) == self._steps[: len(log)]
        assert data == self._rescued[len(log)]


@pytest.fixture
def checker(tmp_path, small_log):
    return Checker(tmp_path, small_log)


def chunk_offsets(data):
    """Where the chunks of a complete log begin; then where its data section ends."""
    offsets, position = [], len(MAGIC)
    while True:
        opcode, length = struct.unpack_from("<BQ", data, position)
        if opcode == 6:
            offsets.append(position)
        position += 9 + length
        if opcode == 15:
            return offsets, position


def test_truncation_anywhere_keeps_every_committed_step(tmp_path, small_log):
    path = tmp_path / "cut.mcap"
    path.write_bytes(small_log)
    digests = [commit.hash.hex() for commit in (decode(Commit, raw[-1][1]) for raw in raw_steps(path))]
    offsets, end = chunk_offsets(small_log)
    # What follows a chunk is only its index: a step is safe when its chunk is whole.
    chunk_ends = [offset + 9 + struct.unpack_from("<Q", small_log, offset + 1)[0] for offset in offsets]
    lengths = {*range(0, len(small_log), 61), *range(offsets[-2], end), *range(len(small_log) - 40, len(small_log))}
    for length in sorted(lengths, reverse=True):
        os.truncate(path, length)
        log = open_if_possible(path)
        n_steps = -1 if log is None else len(log)
        assert n_steps == sum(chunk_end <= length for chunk_end in chunk_ends) - 1, f"cut at byte {length}"
        if log is not None:
            assert log.state == "partial"
            assert n_steps == 0 or log.digest == digests[n_steps - 1]


def test_a_flipped_byte_anywhere_is_noticed(checker, small_log):
    generator = random.Random(5)
    positions = [generator.randrange(len(small_log)) for _ in range(600)]
    # and every byte of the places where the file is held together
    offsets, end = chunk_offsets(small_log)
    positions += [
        *range(40),
        *range(offsets[3], offsets[3] + 60),
        *range(end - 13, end),
        *range(len(small_log) - 40, len(small_log)),
    ]
    outcomes = set()
    for position in positions:
        data = bytearray(small_log)
        data[position] ^= 1 << generator.randrange(8)
        outcomes.add(checker.check(bytes(data)))
    assert outcomes >= {-1, 0, 3, 7}, "the flips reached header, first, middle and last part"


def test_several_bytes_changed_inserted_or_lost_are_noticed(checker, small_log):
    generator = random.Random(6)
    for _ in range(150):
        position, length = generator.randrange(len(small_log)), generator.randrange(1, 40)
        checker.check(small_log[:position] + small_log[position + length :])
        checker.check(small_log[:position] + generator.randbytes(length) + small_log[position:])
        checker.check(small_log[:position] + bytes(length) + small_log[position:])


def test_bytes_after_the_end_are_noticed(checker, small_log):
    assert checker.check(small_log + b"x") == 7
    assert checker.check(small_log + small_log) == 7
    assert checker.check(small_log[: len(small_log) // 2] + bytes(4096)) >= 0


def test_absurd_lengths_take_no_memory(checker, small_log):
    offsets, _ = chunk_offsets(small_log)
    tracemalloc.start()
    for position in (9, offsets[2] + 1, offsets[2] + 9 + 16):
        for value in (2**63, 2**40, 2**31):
            data = bytearray(small_log)
            data[position : position + 8] = value.to_bytes(8, "little")
            checker.check(bytes(data))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 5_000_000


def test_a_killed_run_keeps_its_committed_steps(tmp_path):
    code = """
import sys
from tests.recorder import synthetic
from fireworld_recorder.writer import LogWriter
city = synthetic.city()
with LogWriter(sys.argv[1], synthetic.header(), city) as log:
    for step in range(10_000):
        log.write(synthetic.record(step, city_record=city, last=30))
        print(step, flush=True)
"""
    path = tmp_path / "run.mcap"
    with subprocess.Popen([sys.executable, "-c", code, str(path)], stdout=subprocess.PIPE, text=True) as process:
        reported = [int(process.stdout.readline()) for _ in range(25)]
        process.send_signal(signal.SIGKILL)
        reported += [int(line) for line in process.stdout if line.strip()]
    assert not path.exists()
    partial = open_log(tmp_path / "run.mcap.partial", partial=True)
    assert partial.state == "partial"
    assert len(partial) in {reported[-1] + 1, reported[-1] + 2}
    # and recovering under the run's own name, from the partial file beside it
    recovery = recover(partial.path, path)
    assert recovery.n_steps == len(partial)
    log = open_log(path)
    assert log.digest == recovery.digest == partial.digest
    assert partial.path.exists()


@pytest.mark.parametrize("n_steps", [1, 4, 7])
def test_recovered_log_is_what_a_shorter_run_would_have_written(tmp_path, small_log, records, n_steps):
    offsets, end = chunk_offsets(small_log)
    cut = [*offsets, end][n_steps + 1] + 5
    (tmp_path / "cut.mcap").write_bytes(small_log[:cut])
    recovery = recover(tmp_path / "cut.mcap", tmp_path / "good.mcap")
    assert (recovery.n_steps, recovery.last_step) == (n_steps, n_steps - 1)
    clean = write_log(tmp_path / "clean.mcap", records[:n_steps])
    assert (tmp_path / "good.mcap").read_bytes() == clean.read_bytes()
    assert recovery.digest == open_log(clean).digest
    assert not list(tmp_path.glob("*.recovering"))


def test_recover_refuses_what_it_cannot_do(tmp_path, small_log, records):
    log = tmp_path / "a.mcap"
    log.write_bytes(small_log[: chunk_offsets(small_log)[0][1] + 5])
    with pytest.raises(LogError, match="nothing"):
        recover(log, tmp_path / "b.mcap")
    good = write_log(tmp_path / "good.mcap", records[:2])
    with pytest.raises(OutputError, match="--force"):
        recover(good, good)
    with pytest.raises(LogError, match="No such file"):
        recover(tmp_path / "missing.mcap", tmp_path / "b.mcap")
    before = good.read_bytes()
    recover(good, good, force=True)
    assert good.read_bytes() == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.mcap", "good.mcap"]


@pytest.mark.parametrize(
    ("data", "words"),
    [(b"", "an empty file"), (b"scenario: x\n", "expected an MCAP recording"), (MAGIC, "without its closing index")],
)
def test_other_files_are_refused(tmp_path, data, words):
    path = tmp_path / "a.mcap"
    path.write_bytes(data)
    with pytest.raises(LogError, match=words):
        open_log(path, partial=True)


def test_missing_file_and_folder_are_refused(tmp_path):
    with pytest.raises(LogError, match="No such file"):
        open_log(tmp_path / "a.mcap")
    with pytest.raises(LogError, match="expected a recording, got a folder"):
        open_log(tmp_path)


def keep(messages):
    return messages


def custom_log(path, records, city, *, header=None, channels=(), change=keep, swap=keep, metadata=None):
    """Write a log as others might: topics and fields `change`d before they are hashed, or `swap`ped after."""
    encoded = encode(city)
    chain = Chain(encoded)
    header = header or synthetic.header()
    with StepFile(
        path,
        metadata=metadata or to_metadata(header),
        attachments=header.attachments,
        channels=[*own_channels(), *channels],
        city=encoded,
        force=False,
    ) as file:
        for record in records:
            messages = change(step_messages(record))
            for topic, data in messages:
                chain.add(topic, data)
            commit = chain.commit(step=record.step, terminated=record.terminated, truncated=record.truncated)
            file.commit(record.step, [*swap(messages), (Commit.topic, encode(commit))])
    return path


def test_topics_and_fields_of_later_versions_are_skipped_and_kept_by_recover(tmp_path, records, city):
    extra = Channel("/ambulances", "fireworld.log.v1.Ambulances", b"")

    def add(messages):
        return [("/ambulances", b"\x08\x05"), *((topic, data + b"\xf8\x06\x01") for topic, data in messages)]

    path = custom_log(tmp_path / "later.mcap", records[:4], city, channels=[extra], change=add)
    log = open_log(path)
    assert [record.step for record in log] == [0, 1, 2, 3]
    assert log.column("/buildings", "fuel_share").shape == (4, 12)
    assert log.topics["/ambulances"].n_messages == 4
    assert [record.buildings for record in log][3].energy.tolist() == records[3].buildings.energy.tolist()
    recover(path, tmp_path / "copy.mcap")
    assert (tmp_path / "copy.mcap").read_bytes() == path.read_bytes()


def test_topics_that_an_older_version_lacks_are_empty(tmp_path, records, city):
    def drop(messages):
        return [(topic, data) for topic, data in messages if topic != "/draws"]

    log = open_log(custom_log(tmp_path / "older.mcap", records[:2], city, change=drop))
    assert log.step(1).draws.key == 0


@pytest.mark.parametrize(("key", "value", "words"), [
    ("format", "fireworld-log/2", "expected fireworld-log/1, got 'fireworld-log/2'; it was written by a newer"),
    ("format", "otherworld/1", "format: expected fireworld-log/1, got 'otherworld/1'"),
    ("seed", "8", "fireworld.run: expected its own checksum"),
])  # fmt: skip
def test_other_formats_and_altered_headers_are_refused_by_name(tmp_path, records, city, key, value, words):
    metadata = to_metadata(synthetic.header()) | {key: value}
    path = custom_log(tmp_path / "a.mcap", records[:2], city, metadata=metadata)
    with pytest.raises(LogError, match=words):
        open_log(path, partial=True)


def test_a_newer_container_is_refused_by_name(tmp_path, small_log):
    path = tmp_path / "a.mcap"
    path.write_bytes(small_log.replace(b"fireworld-log/1", b"fireworld-log/2", 1))
    with pytest.raises(LogError, match=r"fireworld-log/2.*newer fireworld"):
        open_log(path)


def test_a_lost_attachment_is_noticed(tmp_path, records, city):
    header = synthetic.header()
    path = custom_log(
        tmp_path / "a.mcap",
        records[:1],
        city,
        header=synthetic.header(attachments={"scenario.yaml": b"name: synthetic\n"}),
        metadata=to_metadata(header),
    )
    with pytest.raises(LogError, match=r"policy\.npz"):
        open_log(path, partial=True)


def test_a_step_altered_with_valid_checksums_breaks_the_chain(tmp_path, records, city):
    swapped = [dataclasses.replace(record, events=records[3].events) for record in records[:4]]
    numbers = iter(range(4))

    def swap_third(messages):
        number = next(numbers)
        return step_messages(swapped[number]) if number == 2 else messages

    log = open_log(custom_log(tmp_path / "a.mcap", records[:4], city, swap=swap_third), partial=True)
    assert log.damage == "damaged: the hash of step 2 does not fit; good up to step 1"


def test_a_log_that_shrinks_while_it_is_read_is_noticed(tmp_path, small_log):
    path = tmp_path / "a.mcap"
    path.write_bytes(small_log)
    log = open_log(path)
    path.write_bytes(small_log[: len(small_log) // 2])
    with pytest.raises(LogError, match="changed since it was opened"):
        list(log)
    path.unlink()
    with pytest.raises(LogError, match="cannot be read"):
        log.column("/score", "score")


def test_a_run_under_way_can_be_read(tmp_path, records, city):
    with LogWriter(tmp_path / "a.mcap", synthetic.header(), city) as writer:
        for record in records[:3]:
            writer.write(record)
        log = open_log(tmp_path / "a.mcap.partial", partial=True)
        writer.write(records[3])
        assert [record.step for record in log] == [0, 1, 2]


@pytest.mark.parametrize("options", [
    {"chunk_size": 3000, "compression": CompressionType.NONE},
    {"chunk_size": 1 << 30, "enable_crcs": False},
    {"use_chunking": False},
])  # fmt: skip
def test_a_log_rewritten_by_another_tool_is_the_same_run(tmp_path, log_path, options):
    path = tmp_path / "a.mcap"
    with log_path.open("rb") as source, path.open("wb") as target:
        reader = make_reader(source)
        writer = Writer(target, **options)
        writer.start("fireworld", "another tool")
        for item in reader.iter_metadata():
            writer.add_metadata(item.name, item.metadata)
        for item in reader.iter_attachments():
            writer.add_attachment(0, 0, item.name, item.media_type, item.data)
        ids = {}
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            if channel.id not in ids:
                schema_id = writer.register_schema(schema.name, schema.encoding, schema.data)
                ids[channel.id] = writer.register_channel(channel.topic, "protobuf", schema_id)
            writer.add_message(ids[channel.id], message.log_time, message.data, message.publish_time, 0)
        writer.finish()
    log = open_log(path)
    assert log.digest == open_log(log_path).digest
    assert log.snapshots == [10, 20, 30]
    assert [record.step for record in log] == list(range(31))
    assert log.step(20).snapshot is not None
    assert log.column("/buildings", "fuel_share").shape == (31, 12)


def odd_log(path, city, messages):
    """Write a log of steps given as (number, messages), every hash and checksum right."""
    chain = Chain(encode(city))
    with StepFile(
        path,
        metadata=to_metadata(synthetic.header()),
        attachments=synthetic.header().attachments,
        channels=own_channels(),
        city=encode(city),
        force=False,
    ) as file:
        for number, step in messages:
            for topic, data in step:
                chain.add(topic, data)
            commit = chain.commit(step=number, terminated=False, truncated=False)
            file.commit(0, [*step, (Commit.topic, encode(commit))])
    return open_log(path, partial=True)


@pytest.mark.parametrize("number", [-1, 307_445_735, 2**31 - 1])
def test_a_step_whose_time_cannot_be_written_is_not_accepted(tmp_path, records, city, number):
    log = odd_log(tmp_path / "a.mcap", city, [(0, step_messages(records[0])), (number, step_messages(records[1]))])
    if number < 0:
        assert log.damage == "damaged: a step has the number -1; good up to step 0"
    assert len(log) == 1
    assert recover(log.path, tmp_path / "b.mcap").n_steps == 1


def test_a_topic_twice_in_a_step_is_not_accepted(tmp_path, records, city):
    messages = step_messages(records[1])
    log = odd_log(tmp_path / "a.mcap", city, [(0, step_messages(records[0])), (1, [*messages, messages[3]])])
    assert log.damage == "damaged: a step holds /brigades twice; good up to step 0"


def test_a_step_too_large_to_be_read_is_not_written(tmp_path, records, city, monkeypatch):
    monkeypatch.setattr("fireworld_recorder.writer.CHUNK_PAYLOAD_MAX", 20_000)
    large = dataclasses.replace(records[1].events, kind=np.full(9000, 2, np.uint8), entity=np.zeros(9000, np.int32))
    with pytest.raises(OutputError, match=r"a\.mcap: step 1: expected at most 20000 bytes in a step, got \d+ bytes"):
        write_log(tmp_path / "a.mcap", [records[0], dataclasses.replace(records[1], events=large)], city=city)
    assert len(open_log(tmp_path / "a.mcap.partial", partial=True)) == 1


@pytest.mark.parametrize("seed", [str(2**63), str(-(2**63) - 1), "nine"])
def test_a_seed_that_is_no_number_of_64_bits_is_refused(tmp_path, records, city, seed):
    path = custom_log(tmp_path / "a.mcap", records[:1], city, header=synthetic.header(seed=seed))
    with pytest.raises(LogError, match="seed: expected a whole number"):
        open_log(path)
