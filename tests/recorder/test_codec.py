"""The codec against itself, against the protobuf library, and against bytes that are no message."""

import contextlib
import dataclasses

import numpy as np
import pytest
from fireworld_recorder import codec, schema
from fireworld_recorder.schema import TOPICS, Commit, message_of
from fireworld_recorder.writer import own_channels
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from hypothesis import given, settings
from hypothesis import strategies as st

from fireworld.errors import LogError
from fireworld.records import DTYPES, STEP_TOPICS, Buildings, Civilians, Decisions, Draws, Score

FLAT = tuple(topic for topic in TOPICS if message_of(topic).fields)
SCALARS = {
    "double": st.floats(),
    "float": st.floats(width=32),
    "sfixed32": st.integers(-(2**31), 2**31 - 1),
    "fixed64": st.integers(0, 2**64 - 1),
    "uint8": st.integers(0, 127),
    "bool": st.booleans(),
    "string": st.text(st.characters(codec="utf-8"), max_size=8),
    "bytes": st.binary(max_size=40),
}


def values_of(item):
    scalar = SCALARS[item.wire]
    if not item.repeated:
        return scalar
    return st.lists(scalar, max_size=5).map(lambda values: np.array(values, DTYPES[item.wire]))


def records_of(record_type):
    fields = {item.name: values_of(item) for item in message_of(record_type).fields}
    return st.builds(record_type, **fields)


def same_value(a, b):
    return np.array_equal(a, b, equal_nan=not isinstance(a, str | bytes))


def same(a, b):
    return all(same_value(x, y) for x, y in zip(vars(a).values(), vars(b).values(), strict=True))


@pytest.fixture(scope="module")
def protobuf_types():
    """The protobuf library's message class of every record type, from the descriptors of a log."""
    pool = descriptor_pool.DescriptorPool()
    types = {}
    for channel in own_channels(imported=True):
        pool.Add(descriptor_pb2.FileDescriptorSet.FromString(channel.schema).file[0])
    for topic in TOPICS:
        descriptor = pool.FindMessageTypeByName(f"{schema.PACKAGE}.{message_of(topic).name}")
        types[topic] = message_factory.GetMessageClass(descriptor)
    return types


@settings(max_examples=150)
@given(record=st.sampled_from(FLAT).flatmap(records_of))
def test_a_record_survives_encoding(record):
    assert same(codec.decode(type(record), codec.encode(record)), record)


@settings(max_examples=150)
@given(record=st.sampled_from(FLAT).flatmap(records_of))
def test_bytes_are_those_of_the_protobuf_library(protobuf_types, record):
    data = codec.encode(record)
    theirs = protobuf_types[type(record)].FromString(data)
    for item in message_of(type(record)).fields:
        ours, value = getattr(record, item.name), getattr(theirs, item.name)
        if item.repeated:
            assert np.array_equal(np.array(value, DTYPES[item.wire]), ours, equal_nan=True)
        else:
            assert same_value(value, ours)
    assert theirs.SerializeToString(deterministic=True) == data
    assert same(codec.decode(type(record), theirs.SerializeToString(deterministic=True)), record)


def test_snapshots_agree_with_the_protobuf_library(protobuf_types):
    arrays = {"b": np.arange(6, dtype=np.int64).reshape(2, 3), "a": np.array(2.5), "c": np.empty((0, 4), np.float32)}
    data = codec.encode_snapshot(arrays)
    theirs = protobuf_types[schema.Snapshot].FromString(data)
    assert [(item.name, item.dtype, list(item.shape)) for item in theirs.arrays] == [
        ("a", "<f8", []),
        ("b", "<i8", [2, 3]),
        ("c", "<f4", [0, 4]),
    ]
    back = codec.decode_snapshot(theirs.SerializeToString(deterministic=True))
    for name, array in arrays.items():
        assert back.arrays[name].dtype == array.dtype
        assert np.array_equal(back.arrays[name], array)
        assert back.arrays[name].flags.aligned
        assert back.arrays[name].flags.owndata or back.arrays[name].base is not None


def test_unknown_fields_are_skipped(protobuf_types):
    record = Score(1.0, 2.0, 3.0, 4, 5, 6, 7, 8.0)
    extra = bytes([0xFA, 0x06, 2, 1, 2, 0xF8, 0x06, 0x96, 0x01, 0xFD, 0x06, 1, 2, 3, 4, 0xF9, 0x06, *range(8)])
    assert same(codec.decode(Score, codec.encode(record) + extra), record)
    assert same(codec.decode(Score, extra + codec.encode(record)), record)


def test_absent_fields_are_zero_or_empty():
    empty = codec.decode(Buildings, b"")
    assert all(len(getattr(empty, item.name)) == 0 for item in dataclasses.fields(empty))
    assert codec.decode(Commit, b"") == Commit(step=0, terminated=False, truncated=False, hash=b"")


def test_one_field_is_read_without_the_others():
    record = Civilians(hp=np.array([3, 4], np.int32), damage=np.array([0.5, np.nan]))
    data = codec.encode(record)
    assert codec.decode_field(Civilians, 1, data).tolist() == [3, 4]
    assert np.array_equal(codec.decode_field(Civilians, 2, data), [0.5, np.nan], equal_nan=True)
    assert codec.decode_field(Civilians, 2, b"").tolist() == []


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"\x0a", "ends inside a number"),
        (b"\x0a\x05abc", "longer than its message"),
        (b"\x0a\x05abcde", "whole float32 values"),
        (b"\x09" + bytes(8), "wire type"),
        (b"\x0b", "unknown wire type 3"),
        (b"\x00\x00", "number 0"),
        (b"\xff" * 11, "more than 64 bits"),
        (b"\x0a\x00\x0a\x00", "twice"),
        (b"\x2a\x01\x80", "below 128"),
    ],
)
def test_malformed_messages_are_refused(data, words):
    with pytest.raises(LogError, match=words):
        codec.decode(Buildings, data)


@settings(max_examples=400)
@given(data=st.binary(max_size=60), topic=st.sampled_from(TOPICS))
def test_any_bytes_decode_or_are_refused(data, topic):
    with contextlib.suppress(LogError):
        codec.decode_snapshot(data) if topic is schema.Snapshot else codec.decode(topic, data)


@pytest.mark.parametrize(
    "array",
    [
        schema.NamedArray("a", "|O8", np.array([1], np.int32), bytes(8)),
        schema.NamedArray("a", "nonsense", np.array([1], np.int32), bytes(8)),
        schema.NamedArray("a", "<f8", np.array([2], np.int32), bytes(8)),
        schema.NamedArray("a", "<f8", np.array([-1, -1], np.int32), bytes(8)),
        schema.NamedArray("a", "<f8", np.array([2**31 - 1] * 4, np.int32), bytes(8)),
    ],
)
def test_bad_snapshot_arrays_are_refused(array):
    body = codec.encode(array)
    with pytest.raises(LogError):
        codec.decode_snapshot(b"\x0a" + codec.varint(len(body)) + body)


def decisions(**changes):
    fields = {item.name: np.empty(0) for item in message_of(Decisions).fields}
    return Decisions(**{**fields, "epsilon": 0.0, **changes})


def test_arrays_of_other_types_are_converted_only_without_loss():
    wide = decisions(action=np.array([1, -1]), explored=np.array([True, False]), q_values=np.array([1, 2]))
    back = codec.decode(Decisions, codec.encode(wide))
    assert back.action.tolist() == [1, -1]
    assert back.explored.tolist() == [1, 0]
    assert back.q_values.tolist() == [1.0, 2.0]
    for bad in (
        {"action": np.array([1.5])},
        {"action": np.array([2**40])},
        {"explored": np.array([128], np.uint8)},
        {"action": np.zeros((2, 2), np.int32)},
        {"q_values": np.array([1j])},
    ):
        with pytest.raises(ValueError, match=next(iter(bad))):
            codec.encode(decisions(**bad))
    with pytest.raises(ValueError, match="key"):
        codec.encode(Draws(key=2**64, burn_rate_sum=0.0, health_sum=0.0))


def test_decoded_arrays_are_aligned_and_writable(records):
    for record in records[:3]:
        for topic in STEP_TOPICS:
            back = codec.decode(topic, b"" + codec.encode(getattr(record, topic.topic[1:])))
            for item in message_of(topic).fields:
                if item.repeated:
                    array = getattr(back, item.name)
                    assert array.flags.aligned
                    assert array.flags.writeable
                    assert array.dtype == DTYPES[item.wire]


def test_long_fields_are_found_where_they_are():
    message = codec.encode(
        Buildings(
            temperature=np.zeros(3, np.float32),
            energy=np.zeros(30),
            fuel_share=np.zeros(20, np.float32),
            water_litres=np.zeros(0, np.int32),
            fieryness=np.zeros(100, np.uint8),
        )
    )
    # tag and length: 2 bytes each, 3 from 128 bytes on
    ends = np.cumsum([2 + 12, 3 + 240, 2 + 80, 2 + 100]).tolist()
    assert len(message) == ends[-1]
    assert codec.long_fields(message, 100) == [(ends[0], ends[1]), (ends[2], ends[3])]
    assert codec.long_fields(message[:-1], 100) == [(ends[0], ends[1])]
    assert codec.long_fields(message, 1000) == []


@given(st.binary(max_size=60), st.integers(1, 20))
def test_long_fields_of_any_bytes_lie_inside_them(data, n_bytes):
    last = 0
    for start, end in codec.long_fields(data, n_bytes):
        assert last <= start <= end - n_bytes <= len(data) - n_bytes
        last = end
