"""Records to protobuf bytes and back, without the protobuf library: flat messages, packed arrays, one pass.

Arrays travel as their own little-endian bytes, so both directions are a copy. The bytes are those that the protobuf
library writes: fields by rising number, zeros and empty arrays left out. What decodes raises LogError for bytes that
are not such a message.
"""

from __future__ import annotations

import contextlib
import math
import struct
from collections.abc import Iterator, Mapping
from typing import Any, Final, NamedTuple

import numpy as np

from fireworld.errors import LogError
from fireworld.records import DTYPES, Array, Record, Snapshot
from fireworld_recorder.schema import NamedArray, message_of, varint

Buffer = bytes | memoryview

_VARINT, _FIXED64, _BYTES, _FIXED32 = 0, 1, 2, 5
_WIDTHS: Final = {_FIXED64: 8, _FIXED32: 4}
_WIRE_TYPES: Final = {"double": 1, "fixed64": 1, "float": 5, "sfixed32": 5, "uint8": 0, "bool": 0}
_STRUCTS: Final = {
    "double": struct.Struct("<d"),
    "fixed64": struct.Struct("<Q"),
    "float": struct.Struct("<f"),
    "sfixed32": struct.Struct("<i"),
    "uint8": struct.Struct("<B"),
    "bool": struct.Struct("<?"),
}
_SNAPSHOT_DTYPES: Final = frozenset(["|b1", "|i1", "|u1", "<i2", "<u2", "<i4", "<u4", "<i8", "<u8", "<f4", "<f8"])


class _Slot(NamedTuple):
    """How one field travels."""

    name: str
    wire: str
    wire_type: int
    dtype: np.dtype[Any] | None  # of an array; None for a single value
    zero: Any  # what an absent value stands for


class _Layout(NamedTuple):
    """How the records of one type travel."""

    slots: dict[int, _Slot]  # by rising field number
    plan: list[tuple[Any, ...]]  # what `encode` needs of each; plain tuples, because named ones unpack slowly


class _Layouts(dict[type[Any], _Layout]):
    """The layouts of record types; each is worked out once."""

    def __missing__(self, record_type: type[Any]) -> _Layout:
        zeros = {"string": "", "bytes": b"", "bool": False, "double": 0.0, "float": 0.0}
        layout = _Layout({}, [])
        for item in sorted(message_of(record_type).fields, key=lambda field: field.number):
            wire_type = _BYTES if item.repeated else _WIRE_TYPES.get(item.wire, _BYTES)
            tag = varint(item.number << 3 | wire_type)
            dtype = np.dtype(DTYPES[item.wire]) if item.repeated else None
            packing = None if item.repeated else _STRUCTS.get(item.wire)
            absent = packing.pack(0) if packing else b""
            layout.slots[item.number] = _Slot(item.name, item.wire, wire_type, dtype, zeros.get(item.wire, 0))
            layout.plan.append((item.name, dtype, {}, item.wire, packing, tag, absent))
        return self.setdefault(record_type, layout)


_LAYOUTS: Final = _Layouts()


def encode(record: Any) -> bytes:
    """Encode a record (of any type that declares fields with `records.column` and `records.value`).

    Raises:
        ValueError: an array is not one-dimensional, or a value does not fit its declared type.
    """
    parts: list[bytes] = []  # filled by `append`, which is faster here than adding tuples
    values = vars(record)
    for name, dtype, heads, wire, packing, tag, absent in _LAYOUTS[type(record)].plan:
        value = values[name]
        if dtype is not None:
            body = value.tobytes() if value.dtype is dtype and value.ndim == 1 else _cast(value, dtype, name)
            if wire == "uint8" and not body.isascii():
                raise ValueError(f"{name}: a value above 127 in a uint8 column")
        elif packing is not None:
            try:
                body = packing.pack(value)
            except struct.error as error:
                raise ValueError(f"{name}: {value!r} does not fit {wire}") from error
            if body != absent:
                parts.append(tag)
                parts.append(body)
            continue
        else:
            body = value.encode() if wire == "string" else value
        if body:
            head = heads.get(len(body))  # tag and length: what comes before as many bytes
            if head is None:
                head = heads[len(body)] = tag + varint(len(body))
            parts.append(head)
            parts.append(body)
    return b"".join(parts)


def _cast(value: Any, dtype: np.dtype[Any], name: str) -> bytes:
    """Bring an array of another type to the declared one; whole numbers must survive unchanged."""
    array = np.asarray(value)
    if array.ndim != 1:
        raise ValueError(f"{name}: expected one dimension, got shape {array.shape}")
    try:
        cast = array.astype(dtype, casting="same_kind" if dtype.kind == "f" else "unsafe")
    except TypeError as error:
        raise ValueError(f"{name}: {error}") from error
    if dtype.kind != "f" and not np.array_equal(cast, array):
        raise ValueError(f"{name}: values do not fit {dtype}")
    return cast.tobytes()


def _read_varint(data: Buffer, position: int) -> tuple[int, int]:
    """Read a varint; return it and the position after it."""
    number = 0
    for shift in range(0, 64, 7):
        if position >= len(data):
            raise LogError("a message ends inside a number")
        byte = data[position]
        position += 1
        number |= (byte & 0x7F) << shift
        if byte < 0x80:
            return number, position
    raise LogError("a message holds a number of more than 64 bits")


def walk(data: Buffer) -> Iterator[tuple[int, int, Any]]:
    """Yield number, wire type and raw value (an int, or the bytes as they lie there) of every field."""
    position, end = 0, len(data)
    while position < end:
        tag = data[position]
        position += 1
        if tag >= 0x80:
            tag, position = _read_varint(data, position - 1)
        number, wire_type = tag >> 3, tag & 7
        if number == 0:
            raise LogError("a message holds a field with number 0")
        if wire_type == _VARINT:
            value, position = _read_varint(data, position)
            yield number, wire_type, value
            continue
        if wire_type == _BYTES:
            length, position = _read_varint(data, position)
        elif wire_type == _FIXED64:
            length = 8
        elif wire_type == _FIXED32:
            length = 4
        else:
            raise LogError(f"field {number} has the unknown wire type {wire_type}")
        if length > end - position:
            raise LogError(f"field {number} is longer than its message")
        yield number, wire_type, data[position : position + length]
        position += length


def parts(data: Buffer, number: int) -> Iterator[Any]:
    """Yield the values of one field, as `walk` yields them."""
    return (value for found, _, value in walk(data) if found == number)


def long_fields(data: Buffer, n_bytes: int) -> list[tuple[int, int]]:
    """List where the fields of at least that many bytes begin and end, up to the first that is no protobuf field."""
    found: list[tuple[int, int]] = []
    position, end = 0, len(data)
    with contextlib.suppress(LogError):
        while position < end:
            start = position
            tag, position = _read_varint(data, position)
            wire_type = tag & 7
            if wire_type == _BYTES:
                length, position = _read_varint(data, position)
                position += length
            elif wire_type == _VARINT:
                _, position = _read_varint(data, position)
            else:
                position += _WIDTHS.get(wire_type, end)  # an unknown type ends the search
            if n_bytes <= position - start and position <= end:
                found.append((start, position))
    return found


def _read(slot: _Slot, wire_type: int, raw: Any) -> Any:
    if wire_type != slot.wire_type:
        raise LogError(f"{slot.name}: expected wire type {slot.wire_type}, got {wire_type}")
    if slot.dtype is not None:
        if len(raw) % slot.dtype.itemsize:
            raise LogError(f"{slot.name}: expected whole {slot.dtype} values, got {len(raw)} bytes")
        # A copy, because kernels want aligned arrays that own their memory.
        array = np.frombuffer(raw, slot.dtype).copy()
        if slot.wire == "uint8" and not bytes(raw).isascii():
            raise LogError(f"{slot.name}: expected numbers below 128")
        return array
    if slot.wire_type == _VARINT:
        limit = 1 if slot.wire == "bool" else 127
        if raw > limit:
            raise LogError(f"{slot.name}: expected at most {limit}, got {raw}")
        return bool(raw) if slot.wire == "bool" else raw
    if slot.wire == "bytes":
        return bytes(raw)
    if slot.wire == "string":
        try:
            return str(raw, "utf-8")
        except UnicodeDecodeError as error:
            raise LogError(f"{slot.name}: expected UTF-8 text") from error
    return _STRUCTS[slot.wire].unpack(raw)[0]


def decode(record_type: type[Record], data: Buffer) -> Record:
    """Decode a record; unknown fields are skipped, absent ones are zero or empty."""
    layout = _LAYOUTS[record_type].slots
    values: dict[str, Any] = {}
    for number, wire_type, raw in walk(data):
        slot = layout.get(number)
        if slot is None:
            continue
        if slot.name in values and slot.dtype is not None:
            raise LogError(f"{slot.name}: an array occurs twice")
        values[slot.name] = _read(slot, wire_type, raw)
    for slot in layout.values():
        if slot.name not in values:
            values[slot.name] = slot.zero if slot.dtype is None else np.empty(0, slot.dtype)
    return record_type(**values)


def decode_field(record_type: type[Any], number: int, data: Buffer) -> Any:
    """Decode one field and step over the others."""
    slot = _LAYOUTS[record_type].slots[number]
    for found, wire_type, raw in walk(data):
        if found == number:
            return _read(slot, wire_type, raw)
    return slot.zero if slot.dtype is None else np.empty(0, slot.dtype)


def encode_snapshot(arrays: Mapping[str, Array]) -> bytes:
    """Encode named arrays, by rising name."""
    parts: list[bytes] = []
    for name in sorted(arrays):
        array = np.asarray(arrays[name])
        dtype = array.dtype.newbyteorder("<")
        if dtype.str not in _SNAPSHOT_DTYPES:
            raise ValueError(f"{name}: arrays of {dtype} cannot be recorded")
        shape = np.array(array.shape, np.int32)
        data = array.astype(dtype, copy=False).tobytes()
        body = encode(NamedArray(name=name, dtype=dtype.str, shape=shape, data=data))
        parts += (b"\x0a", varint(len(body)), body)
    return b"".join(parts)


def decode_snapshot(data: Buffer) -> Snapshot:
    """Decode named arrays."""
    arrays: dict[str, Array] = {}
    for number, wire_type, raw in walk(data):
        if number != 1:
            continue
        if wire_type != _BYTES:
            raise LogError(f"arrays: expected wire type {_BYTES}, got {wire_type}")
        item = decode(NamedArray, raw)
        if item.dtype not in _SNAPSHOT_DTYPES:
            raise LogError(f"{item.name!r}: expected a numeric type, got {item.dtype!r}")
        shape = tuple(int(length) for length in item.shape)
        dtype = np.dtype(item.dtype)
        if min(shape, default=0) < 0 or math.prod(shape) * dtype.itemsize != len(item.data):
            raise LogError(f"{item.name!r}: expected an array of shape {shape}, got {len(item.data)} bytes")
        arrays[item.name] = np.frombuffer(item.data, dtype).reshape(shape).copy()
    return Snapshot(arrays=arrays)
