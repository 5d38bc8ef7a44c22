"""Logs whose bytes were altered, and logs with valid checksums that say odd things: only complaints come out."""

import dataclasses
import functools
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
import zstandard
from click.testing import CliRunner
from fireworld_recorder.chain import Chain, step_messages
from fireworld_recorder.codec import encode
from fireworld_recorder.container import MAGIC
from fireworld_recorder.describe import describe
from fireworld_recorder.diff import compare
from fireworld_recorder.header import to_metadata
from fireworld_recorder.reader import open_log
from fireworld_recorder.recover import channels_of, recover
from fireworld_recorder.schema import Channel, Commit, message_of
from fireworld_recorder.totals import totals_of
from fireworld_recorder.writer import StepFile, own_channels
from hypothesis import given
from hypothesis import strategies as st

from fireworld.cli.info import command
from fireworld.errors import FireworldError
from fireworld.records import DTYPES, STEP_TOPICS
from tests.fuzz.support import FOLDER, FUZZ, altered, file_of, only_complaints, target
from tests.recorder import synthetic

pytestmark = pytest.mark.slow

CITY = synthetic.city(n_buildings=4, n_brigades=2, n_civilians=2)
RECORDS = synthetic.run(3, city_record=CITY)
GOOD = Path(FOLDER.name) / "good.mcap"


@functools.cache
def good_bytes() -> bytes:
    """A log of four steps."""
    write(GOOD, [step_messages(record) for record in RECORDS])
    return GOOD.read_bytes()


def write(path, steps, *, metadata=None, attachments=None, channels=(), city=None, numbers=None):
    """Write messages as a log with all checksums and hashes right."""
    header = synthetic.header()
    city = encode(CITY) if city is None else city
    chain = Chain(city)
    with StepFile(
        path,
        metadata=metadata or to_metadata(header),
        attachments=header.attachments if attachments is None else attachments,
        channels=[*own_channels(), *channels],
        city=city,
        force=True,
    ) as file:
        for number, messages in zip(numbers or range(len(steps)), steps, strict=False):
            for topic, data in messages:
                chain.add(topic, data)
            commit = encode(chain.commit(step=number, terminated=False, truncated=False))
            file.commit(0, [*messages, (Commit.topic, commit)])


def use(path):
    """Do with a log all that can be done without a simulator."""
    with only_complaints():
        log = open_log(path, partial=True)
        for act in (list, totals_of, _columns, _compare, _export, _rescue, _info):
            try:
                act(log)
            except FireworldError as error:  # one kind of use may be refused where another is not
                if not str(error).isprintable():
                    raise


def _columns(log):
    for topic in STEP_TOPICS:
        for item in message_of(topic).fields:
            if item.repeated:
                assert len(log.ragged(topic.topic, item.name)) == len(log)


def _compare(log):
    good_bytes()
    assert compare(log, log).same
    compare(open_log(GOOD), log)


def _info(log):
    describe(channels_of(log.found))
    for options in ([], ["--json"], ["--schema"]):
        done = CliRunner().invoke(command, [str(log.path), *options], standalone_mode=False)
        if done.exception is not None:
            raise done.exception


def _export(log):
    from fireworld_recorder.parquet import export

    export(log, Path(FOLDER.name) / "tables", force=True)


def _rescue(log):
    output = Path(FOLDER.name) / "rescued.mcap"
    if len(log):
        assert recover(log.path, output, force=True).digest == log.digest == open_log(output).digest


@target
@FUZZ
@given(st.deferred(lambda: altered(good_bytes())))
def test_log_bytes(data):
    use(file_of(data, "altered.mcap"))


TOPICS = [topic.topic for topic in STEP_TOPICS]
payloads = st.binary(max_size=30)


@st.composite
def odd_payloads(draw, record):
    """Give some array of some topic another length and other numbers, or alter the bytes of a message."""
    messages = dict(step_messages(record))
    for _ in range(draw(st.integers(1, 3))):
        topic = draw(st.sampled_from(STEP_TOPICS))
        part = getattr(record, topic.topic[1:])
        item = draw(st.sampled_from(message_of(topic).fields))
        if item.repeated:
            kind = np.dtype(DTYPES[item.wire])
            raw = draw(st.binary(max_size=64))
            if item.wire == "uint8":
                raw = bytes(byte & 127 for byte in raw)
            values = np.frombuffer(raw[: len(raw) // kind.itemsize * kind.itemsize], kind)
            part = dataclasses.replace(part, **{item.name: values})
        messages[topic.topic] = draw(st.just(encode(part)) | altered(messages[topic.topic], most=2) | payloads)
    return list(messages.items())


@target
@FUZZ
@given(st.tuples(*(odd_payloads(record) for record in RECORDS)))
def test_log_messages(steps):
    path = Path(FOLDER.name) / "odd.mcap"
    write(path, steps)
    use(path)


@target
@FUZZ
@given(
    city=st.just(encode(CITY)) | altered(encode(CITY), most=2),
    names=st.lists(st.text(max_size=6), max_size=2),
    schemas=st.lists(altered(own_channels()[1].schema, most=2) | payloads, min_size=2, max_size=2),
    numbers=st.lists(st.integers(-(2**31), 2**31 - 1), min_size=4, max_size=4),
    texts=st.dictionaries(st.sampled_from(sorted(to_metadata(synthetic.header()))), st.text(max_size=8), max_size=2),
)
def test_log_frame(city, names, schemas, numbers, texts):
    path = Path(FOLDER.name) / "frame.mcap"
    names = [name for name in dict.fromkeys(names) if name not in TOPICS]
    channels = [Channel(name, "odd", schema) for name, schema in zip(names, schemas, strict=False)]
    steps = [[*step_messages(record), *((name, b"\x08\x01") for name in names)] for record in RECORDS]
    metadata = _sealed(
        {**to_metadata(synthetic.header()), **{key: text for key, text in texts.items() if key != "format"}}
    )
    write(path, steps, metadata=metadata, channels=channels, city=city, numbers=numbers)
    use(path)


def _sealed(metadata):
    """Give altered metadata a checksum that fits."""
    from fireworld_recorder import header

    return {**metadata, "checksum": header._checksum(metadata)}


def chunk(content, *, size=None, compressed=None):
    """Make the record of a chunk that claims a size, with or without holding that much."""
    packed = zstandard.compress(content) if compressed is None else compressed
    size = len(content) if size is None else size
    body = struct.pack("<QQQI", 0, 0, size, zlib.crc32(content) if compressed is None else 0)
    body += struct.pack("<I", 4) + b"zstd" + struct.pack("<Q", len(packed)) + packed
    return b"\x06" + struct.pack("<Q", len(body)) + body


def record_of(opcode, body=b""):
    """Make a record of a chunk."""
    return bytes([opcode]) + struct.pack("<Q", len(body)) + body


@pytest.mark.parametrize(
    "bomb",
    [
        pytest.param(lambda: chunk(b"", size=2**40, compressed=_frame(2**40)), id="claims-a-terabyte"),
        pytest.param(lambda: chunk(b"", size=2**28, compressed=_frame(2**28)), id="claims-the-most-and-holds-nothing"),
        pytest.param(lambda: chunk(bytes(2**26)), id="zeros"),
        pytest.param(lambda: chunk(record_of(0x81) * 2**21), id="records-of-no-known-kind"),
        pytest.param(lambda: chunk(_channel() * 2**19), id="one-channel-again-and-again"),
        pytest.param(lambda: chunk(_channel() + _message() * 2**19), id="one-message-again-and-again"),
    ],
)
def test_a_few_bytes_that_unpack_to_many_are_refused_soon(bomb):
    """Placed behind the city of a good log, where the first step would be."""
    good = good_bytes()
    path = file_of(good[: _second_chunk(good)] + bomb() + good[_second_chunk(good) :], "bomb.mcap")
    assert path.stat().st_size < 200_000
    with only_complaints():
        log = open_log(path, partial=True)
        assert len(log) == 0
        assert log.damage is not None


def _frame(size):
    """The beginning of a zstd frame that claims a size."""
    return b"\x28\xb5\x2f\xfd\xe0" + struct.pack("<Q", size) + b"\x01\x00\x00"


def _channel():
    text = b"/x"
    return record_of(4, struct.pack("<HHI", 99, 0, len(text)) + text + struct.pack("<I", 0) + struct.pack("<I", 0))


def _message():
    return record_of(5, struct.pack("<HIQQ", 99, 0, 0, 0))


def _second_chunk(data):
    """Where the chunk of the first step begins."""
    position, n_chunks = len(MAGIC), 0
    while True:
        opcode, length = struct.unpack_from("<BQ", data, position)
        n_chunks += opcode == 6
        if n_chunks == 2:
            return position
        position += 9 + length
