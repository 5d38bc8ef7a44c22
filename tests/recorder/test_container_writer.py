"""The writer of MCAP files against the library's own, and what becomes of long fields."""

import io

import numpy as np
import pytest
from fireworld_recorder import container_writer
from fireworld_recorder.codec import encode, long_fields
from fireworld_recorder.container_writer import LONG_FIELD_BYTES, ContainerWriter
from mcap.reader import make_reader
from mcap.records import Chunk, ChunkIndex, MessageIndex
from mcap.stream_reader import StreamReader
from mcap.writer import Writer

from fireworld.records import Buildings

CHUNKS = [
    (0, [(1, b"city")]),
    (60, [(2, b""), (1, b"a"), (2, b"b" * 300)]),  # a channel may occur several times
    (180, [(3, bytes(range(256)))]),
]


def written(chunks, topics=("/one", "/two", "/three")):
    file = io.BytesIO()
    writer = ContainerWriter(file, profile="p", library="l")
    writer.add_metadata("m", {"key": "ä"})
    writer.add_attachment("a.yaml", "application/yaml", b"x: 1\n")
    for topic in topics:
        writer.register(topic, schema_name=f"s{topic}", schema=topic.encode(), encoding="protobuf")
    for number, (time, messages) in enumerate(chunks):
        writer.write_chunk(messages, time=time, sequence=number)
    writer.finish()
    return file.getvalue()


@pytest.mark.parametrize("n_chunks", range(len(CHUNKS) + 1))
def test_a_file_is_what_the_library_writes(n_chunks):
    file = io.BytesIO()
    writer = Writer(file, chunk_size=1 << 40, enable_data_crcs=True)
    writer.start("p", "l")
    writer.add_metadata("m", {"key": "ä"})
    writer.add_attachment(0, 0, "a.yaml", "application/yaml", b"x: 1\n")
    for topic in ("/one", "/two", "/three"):
        schema = writer.register_schema(f"s{topic}", "protobuf", topic.encode())
        writer.register_channel(topic, "protobuf", schema)
    for number, (time, messages) in enumerate(CHUNKS[:n_chunks]):
        for channel, data in messages:
            writer.add_message(channel, time, data, time, number)
        writer.flush()
    writer.finish()
    assert written(CHUNKS[:n_chunks]) == file.getvalue()


def burning_buildings(n):
    """(n,) columns whose numbers are as different in kind as those of a large fire."""
    generator = np.random.default_rng(1)
    energy = generator.uniform(1e4, 4e5, n)
    return Buildings(
        temperature=(np.rint(energy / 20.0) / 64.0).astype(np.float32),
        energy=energy,
        fuel_share=generator.uniform(0.0, 1.0, n).astype(np.float32),
        water_litres=np.zeros(n, np.int32),
        fieryness=generator.integers(1, 4, n).astype(np.uint8),
    )


def test_long_fields_are_compressed_apart_and_read_by_all(monkeypatch):
    message = encode(burning_buildings(1000))
    assert [end - start for start, end in long_fields(message, LONG_FIELD_BYTES)] == [1 + 2 + 8 * 1000]
    chunks = [(60 * step, [(1, b"before"), (2, message), (3, b"after")]) for step in range(3)]
    data = written(chunks)
    found = [(channel.topic, item.data) for _, channel, item in make_reader(io.BytesIO(data)).iter_messages()]
    assert found == [("/one", b"before"), ("/two", message), ("/three", b"after")] * 3
    monkeypatch.setattr(container_writer, "LONG_FIELD_BYTES", 1 << 30)
    assert len(data) < 0.97 * len(written(chunks))


def test_after_a_chunk_that_compresses_well_long_fields_are_not_apart(monkeypatch):
    cold, hot = [(1, bytes(20_000))], [(1, encode(burning_buildings(1000)))]
    sizes = [index.compressed_size for index in chunk_indexes(written([(0, cold), (60, hot), (120, hot)]))]
    monkeypatch.setattr(container_writer, "LONG_FIELD_BYTES", 1 << 30)
    undivided = chunk_indexes(written([(0, cold), (60, hot)]))[1].compressed_size
    assert sizes[1] == undivided
    assert sizes[2] < 0.97 * undivided


def test_indexes_lead_to_chunks_and_messages():
    data = written([*CHUNKS, (240, [(1, encode(burning_buildings(1000))), (3, b"z")])])
    summary = make_reader(io.BytesIO(data)).get_summary()
    statistics = summary.statistics
    assert (statistics.message_count, statistics.chunk_count, statistics.message_end_time) == (7, 4, 240)
    assert statistics.channel_message_counts == {1: 3, 2: 2, 3: 2}
    for index in summary.chunk_indexes:
        assert isinstance(index, ChunkIndex)
        chunk = record_at(data, index.chunk_start_offset)
        assert isinstance(chunk, Chunk)
        assert (chunk.message_start_time, chunk.uncompressed_size) == (
            index.message_start_time,
            index.uncompressed_size,
        )
        for channel, offset in index.message_index_offsets.items():
            entries = record_at(data, offset)
            assert isinstance(entries, MessageIndex)
            assert entries.channel_id == channel


def chunk_indexes(data):
    return make_reader(io.BytesIO(data)).get_summary().chunk_indexes


def record_at(data, offset):
    """Read the record at a place of a file."""
    return next(StreamReader(io.BytesIO(data[offset:]), skip_magic=True, emit_chunks=True).records)
