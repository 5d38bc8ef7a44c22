"""Describe the messages of a log: topics, fields, types, units and shapes, from the schemas it carries."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from fireworld.errors import LogError
from fireworld.records import PHASES
from fireworld_recorder.chain import SCENE_PREFIX
from fireworld_recorder.codec import parts, walk
from fireworld_recorder.schema import TOPICS, Channel, Field, Message, NamedArray, message_of

_SCALARS: Final[Mapping[int, str]] = {
    1: "double", 2: "float", 3: "int64", 4: "uint64", 5: "int32", 6: "fixed64", 7: "fixed32", 8: "bool", 9: "string",
    12: "bytes", 13: "uint32", 15: "sfixed32", 16: "sfixed64", 17: "sint32", 18: "sint64",
}  # fmt: skip
"""Names of protobuf's types by their numbers in descriptor.proto; messages and enumerations go by their own names."""
_REPEATED: Final = 3
_OF_ARRAYS: Final = {item.number: item for item in message_of(NamedArray).fields}
"""Of a snapshot's arrays, the only message inside another that there is."""
_OF_SCENE: Final = "Drawn by other tools; derived from the step, and no part of the digest."


@dataclass(frozen=True)
class FieldWords:
    """One field of a topic, in words."""

    number: int
    name: str
    type: str
    shape: str = ""
    """Length of an array in words, "any" if it has no name; empty for a single value."""
    unit: str = ""
    doc: str = ""


@dataclass(frozen=True)
class TopicWords:
    """One topic, in words."""

    topic: str
    message: str
    known: bool
    """Whether this version reads the topic; others are skipped."""
    phase: str
    doc: str
    fields: tuple[FieldWords, ...]


def describe(channels: Iterable[Channel], topics: Iterable[type[Any]] = TOPICS) -> list[TopicWords]:
    """Describe the topics of a log.

    Args:
        channels: topics and schemas, as `writer.own_channels` and `recover.channels_of` list them.
        topics: record types that this version knows of this kind of log.

    Raises:
        LogError: a schema is not a protobuf descriptor.
    """
    described, ours = [], {record_type.topic: message_of(record_type) for record_type in topics}
    for channel in channels:
        known = ours.get(channel.topic)
        try:
            fields = tuple(_fields(channel, known))
        except (LogError, UnicodeDecodeError, TypeError) as error:  # a text that is none, a number where bytes belong
            raise LogError(f"the schema of {channel.topic} is no protobuf descriptor") from error
        described.append(
            TopicWords(
                topic=channel.topic,
                message=channel.schema_name,
                known=known is not None,
                phase=PHASES.get(channel.topic, ""),
                doc=known.doc if known else _OF_SCENE if channel.topic.startswith(SCENE_PREFIX) else "",
                fields=fields,
            )
        )
    return described


def _fields(channel: Channel, known: Message | None) -> Iterator[FieldWords]:
    """Read a FileDescriptorSet: file = 1, in it message_type = 4."""
    ours = {item.number: item for item in known.fields} if known else {}
    messages = [message for file in parts(channel.schema, 1) for message in parts(file, 4)]
    name = channel.schema_name.rpartition(".")[2]
    own = [message for message in messages if _name(message) == name]  # a set may hold what the message is made of, too
    for message in own or messages:
        yield from _message_fields(message, ours)


def _message_fields(message: Any, ours: Mapping[int, Field], prefix: str = "") -> Iterator[FieldWords]:
    """Read a DescriptorProto: field = 2, nested_type = 3; fields of nested messages follow their own."""
    for part in parts(message, 2):
        yield _field(part, ours, prefix)
    for nested in parts(message, 3):
        yield from _message_fields(nested, _OF_ARRAYS, f"{_name(nested)}.")


def _field(part: Any, ours: Mapping[int, Field], prefix: str) -> FieldWords:
    """Read a FieldDescriptorProto: name = 1, number = 3, label = 4, type = 5, type_name = 6."""
    raw = {number: value for number, _, value in walk(part)}
    number, name = int(raw.get(3, 0)), str(raw.get(1, b""), "utf-8")
    scalar = _SCALARS.get(raw.get(5, 0)) or str(raw.get(6, b""), "utf-8").rpartition(".")[2] or "unknown"
    repeated = raw.get(4) == _REPEATED
    known = ours.get(number)
    if known is None or known.name != name:
        return FieldWords(
            number, prefix + name, f"repeated {scalar}" if repeated else scalar, "any" if repeated else ""
        )
    return FieldWords(number, prefix + name, known.proto_type, known.shape, known.unit, known.doc)


def _name(message: Any) -> str:
    return "".join(str(value, "utf-8") for value in parts(message, 1))
