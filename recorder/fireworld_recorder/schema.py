"""What travels in a log: one protobuf message per topic, derived from the field metadata of fireworld.records.

Descriptors in binary form, as logs carry them, are made here; their readable form by `make docs`.
"""

from __future__ import annotations

import dataclasses
import functools
import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Final, NamedTuple

from fireworld.records import STEP_TOPICS, Array, CityRecord, Snapshot, Wire, column, value

PACKAGE: Final = "fireworld.log.v1"
PROTO: Final = Path(__file__).with_name("fireworld_log.proto")
_TYPE_NUMBERS: Final = {
    "double": 1, "float": 2, "fixed64": 6, "bool": 8, "string": 9, "bytes": 12, "uint32": 13, "sfixed32": 15,
}  # fmt: skip
"""Numbers of the types in protobuf's descriptor.proto."""
_MESSAGE_TYPE, _SINGLE, _REPEATED = 11, 1, 3
UNITS: Final = ("m", "m2", "m3", "litres")
"""Units that a name can end in."""
COUNTS: Final[Mapping[str, str]] = {
    "building": "n",
    "offset": "n+1",
    "brigade": "n_brigades",
    "civilian": "n_civilians",
    "site": "n_sites",
    "event": "n_events",
    "scenario": "n_scenarios",
    "candidate": "n_candidates",
    "fire": "n_fires",
    "weight": "n_weights",
}
"""What the number of some kinds of entities is called in shapes."""


class Channel(NamedTuple):
    """A topic and the schema of its messages."""

    topic: str
    schema_name: str
    schema: bytes


@dataclass(frozen=True)
class NamedArray:
    """An array of a snapshot: its name, type, shape and bytes."""

    name: str = value(1, "string", "name of the array")
    dtype: str = value(2, "string", "numpy type, such as <f8")
    shape: Array = column(3, "sfixed32", "length of each axis", per="axis")
    data: bytes = value(4, "bytes", "the values, little-endian, last axis fastest")


@dataclass(frozen=True)
class Commit:
    """The end of a step: without it the step does not count."""

    topic: ClassVar[str] = "/commit"
    step: int = value(1, "sfixed32", "the step that is complete")
    terminated: bool = value(2, "bool", "nothing burns any more")
    truncated: bool = value(3, "bool", "the scenario's last step")
    hash: bytes = value(4, "bytes", "32 bytes, chained to the commit before: the digest of the run up to here")


@dataclass(frozen=True)
class Field:
    """One field of a message."""

    number: int
    name: str
    wire: Wire
    doc: str
    unit: str
    """What it is measured in; empty for counts, indices and codes."""
    per: str = ""
    """What an array has entries for; empty for a single value."""
    width: int = 1
    """Entries of an array for each of these."""
    names: tuple[str, ...] = ()
    """What the numbers 0, 1, 2, ... stand for."""
    imported: bool = False
    """Imported logs alone have it."""

    @property
    def repeated(self) -> bool:
        """Whether it is an array."""
        return self.per != ""

    @property
    def shape(self) -> str:
        """Length of an array in words, as in "n_brigades"; "any" if it has no name, empty for a single value."""
        if not self.repeated:
            return ""
        count = COUNTS.get(self.per, "any")
        return count if self.width == 1 else f"{count} * {self.width}"

    @property
    def proto_type(self) -> str:
        """The protobuf type; "uint8" is our name for an unsigned number below 128, one byte as a varint."""
        scalar = "uint32" if self.wire == "uint8" else self.wire
        return f"repeated {scalar}" if self.repeated else scalar


@dataclass(frozen=True)
class Message:
    """One message type: a topic, or a part of one."""

    name: str
    topic: str
    doc: str
    fields: tuple[Field, ...]


def message_of(record_type: type[Any]) -> Message:
    """Derive the message of a record type from its dataclass fields."""
    fields = tuple(
        Field(**{**item.metadata, "name": item.name, "unit": item.metadata["unit"] or _unit_of(item.name)})
        for item in dataclasses.fields(record_type)
        if "number" in item.metadata
    )
    return Message(
        name=record_type.__name__.removesuffix("Record"),
        topic=getattr(record_type, "topic", ""),
        doc=" ".join((inspect.getdoc(record_type) or "").split()),
        fields=fields,
    )


def channel_of(record_type: type[Any], package: str, *, declared: Callable[[Field], bool] = lambda _: True) -> Channel:
    """Return the channel of a topic; its schema is a FileDescriptorSet, by protobuf's descriptor.proto.

    Args:
        record_type: of the topic.
        package: of the protobuf message.
        declared: whether a field is part of the schema.
    """
    message = message_of(record_type)
    message = dataclasses.replace(message, fields=tuple(item for item in message.fields if declared(item)))
    body = _descriptor(message)
    if record_type is Snapshot:  # the only message that is made of others
        array = dataclasses.replace(message_of(NamedArray), name="Array")
        kind = _number(5, _MESSAGE_TYPE) + _text(6, f".{package}.{message.name}.{array.name}")
        arrays = _text(1, "arrays") + _number(3, 1) + _number(4, _REPEATED) + kind
        body += _part(2, arrays) + _part(3, _descriptor(array))
    name = f"{package.replace('.', '/')}/{message.topic.removeprefix('/')}.proto"
    file = _text(1, name) + _text(2, package) + _part(4, body) + _text(12, "proto3")
    return Channel(message.topic, f"{package}.{message.name}", _part(1, file))


def _descriptor(message: Message) -> bytes:
    """Return the DescriptorProto of a message of plain fields."""
    fields = [
        _text(1, item.name)
        + _number(3, item.number)
        + _number(4, _REPEATED if item.repeated else _SINGLE)
        + _number(5, _TYPE_NUMBERS[item.proto_type.split()[-1]])
        for item in message.fields
    ]
    return _text(1, message.name) + b"".join(_part(2, one) for one in fields)


@functools.cache
def varint(number: int) -> bytes:
    """Encode a non-negative integer as a protobuf varint."""
    parts = bytearray()
    while number >= 0x80:
        parts.append(number & 0x7F | 0x80)
        number >>= 7
    parts.append(number)
    return bytes(parts)


def _number(field_number: int, value: int) -> bytes:
    return varint(field_number << 3) + varint(value)


def _part(field_number: int, body: bytes) -> bytes:
    return varint(field_number << 3 | 2) + varint(len(body)) + body


def _text(field_number: int, text: str) -> bytes:
    return _part(field_number, text.encode())


def _unit_of(name: str) -> str:
    """Return the unit that a name ends in, if it does."""
    _, _, last = name.rpartition("_")
    return last if last in UNITS and last != name else ""


TOPICS: Final[tuple[type[Any], ...]] = (CityRecord, *STEP_TOPICS, Snapshot, Commit)
"""Record types in the order in which their channels are registered: channel 1 is /city."""
