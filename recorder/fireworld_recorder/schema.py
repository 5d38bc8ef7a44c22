"""What travels in a log: one protobuf message per topic, derived from the field metadata of fireworld.records.

`python -m fireworld_recorder.schema --write` regenerates what is checked in: the binary descriptors that every log
carries, their readable form, and the tables of docs/log-format.md. Only that needs the protobuf library.
"""

from __future__ import annotations

import argparse
import dataclasses
import inspect
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Final

from fireworld.records import PHASES, STEP_TOPICS, Array, CityRecord, Snapshot, Wire, column, value

if TYPE_CHECKING:
    from google.protobuf.descriptor_pb2 import FileDescriptorSet

PACKAGE: Final = "fireworld.log.v1"
DESCRIPTORS: Final = Path(__file__).with_name("fireworld_log.binpb")
PROTO: Final = Path(__file__).with_name("fireworld_log.proto")
DOCS: Final = Path(__file__).parents[2] / "docs" / "log-format.md"
UNITS: Final = ("m", "m2", "m3", "litres")
"""Units that a name can end in."""
COUNTS: Final[Mapping[str, str]] = {
    "building": "n",
    "offset": "n+1",
    "brigade": "n_brigades",
    "civilian": "n_civilians",
    "site": "n_sites",
    "event": "n_events",
}
"""What the number of some kinds of entities is called in shapes."""
DOCS_BEGIN: Final = "<!-- generated from fireworld/records.py by `python -m fireworld_recorder.schema --write` -->\n"
DOCS_END: Final = "<!-- end of the generated part -->\n"


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
    def text(self) -> str:
        """The documentation after the shape, where that has a name."""
        return f"({self.shape},) {self.doc}".strip() if self.per in COUNTS else self.doc

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


def _unit_of(name: str) -> str:
    """Return the unit that a name ends in, if it does."""
    _, _, last = name.rpartition("_")
    return last if last in UNITS and last != name else ""


TOPICS: Final[tuple[type[Any], ...]] = (CityRecord, *STEP_TOPICS, Snapshot, Commit)
"""Record types in the order in which their channels are registered: channel 1 is /city."""


def descriptors() -> Iterator[tuple[Message, bytes]]:
    """Pair every topic's message with its binary FileDescriptorSet, in channel order.

    The checked-in set holds one file per topic. A set is a repeated field, so each entry, cut out with its tag
    and length, is a set of one file: a log carries every message once instead of all messages for every topic.
    """
    data = DESCRIPTORS.read_bytes()
    position = 0
    for record_type in TOPICS:
        length, shift, cursor = 0, 0, position + 1
        while True:
            byte = data[cursor]
            length |= (byte & 0x7F) << shift
            cursor, shift = cursor + 1, shift + 7
            if byte < 0x80:
                break
        yield message_of(record_type), data[position : cursor + length]
        position = cursor + length


def build_descriptors() -> FileDescriptorSet:
    """Make the FileDescriptorSet that belongs to the records as they are now; needs the protobuf library."""
    from google.protobuf import descriptor_pb2  # a developer's library

    kinds = descriptor_pb2.FieldDescriptorProto
    files = descriptor_pb2.FileDescriptorSet()

    def fill(target: descriptor_pb2.DescriptorProto, message: Message) -> None:
        target.name = message.name
        for item in message.fields:
            target.field.add(
                name=item.name,
                number=item.number,
                label=kinds.LABEL_REPEATED if item.repeated else kinds.LABEL_OPTIONAL,
                type=kinds.Type.Value("TYPE_" + item.proto_type.split()[-1].upper()),
            )

    for record_type in TOPICS:
        message = message_of(record_type)
        file = files.file.add(
            name=f"fireworld/log/v1/{message.topic.lstrip('/')}.proto", package=PACKAGE, syntax="proto3"
        )
        body = file.message_type.add()
        fill(body, message)
        if record_type is Snapshot:
            fill(body.nested_type.add(), dataclasses.replace(message_of(NamedArray), name="Array"))
            body.field.add(
                name="arrays",
                number=1,
                label=kinds.LABEL_REPEATED,
                type=kinds.TYPE_MESSAGE,
                type_name=f".{PACKAGE}.Snapshot.Array",
            )
    return files


def proto_text() -> str:
    """Write the messages as a .proto file for people to read."""
    lines = [
        "// The messages of a fireworld log. Generated by `python -m fireworld_recorder.schema --write`; do not edit.",
        'syntax = "proto3";',
        f"package {PACKAGE};",
    ]

    def body(message: Message, indent: str) -> list[str]:
        return [f"{indent}  {item.proto_type} {item.name} = {item.number};  // {item.text}" for item in message.fields]

    for record_type in TOPICS:
        message = message_of(record_type)
        lines += ["", f"// {message.topic}: {message.doc}", f"message {message.name} {{"]
        if record_type is Snapshot:
            lines += ["  message Array {", *body(message_of(NamedArray), "  "), "  }", "  repeated Array arrays = 1;"]
        lines += [*body(message, ""), "}"]
    return "\n".join(lines) + "\n"


def docs_text() -> str:
    """Write the tables of topics and fields for docs/log-format.md."""
    lines: list[str] = []
    for record_type in TOPICS:
        message = message_of(record_type)
        phase = f" Phase: {PHASES[message.topic]}." if message.topic in PHASES else ""
        lines += [f"### {message.topic}", "", message.doc + phase, ""]
        fields = message.fields
        if record_type is Snapshot:
            lines += ["Field 1, `arrays`, repeats this message:", ""]
            fields = message_of(NamedArray).fields
        lines += ["| no. | field | type | meaning |", "|---|---|---|---|"]
        lines += [f"| {item.number} | `{item.name}` | {item.proto_type} | {item.text} |" for item in fields]
        lines += [""]
    return "\n".join(lines)


def with_generated_part(page: str) -> str:
    """Replace the generated part of the log-format page."""
    before, _, rest = page.partition(DOCS_BEGIN)
    _, _, after = rest.partition(DOCS_END)
    return f"{before}{DOCS_BEGIN}\n{docs_text()}\n{DOCS_END}{after}"


def main() -> None:
    """Regenerate the checked-in descriptors, the .proto file and the tables of the docs."""
    parser = argparse.ArgumentParser(prog="python -m fireworld_recorder.schema", description=main.__doc__)
    parser.add_argument("--write", action="store_true", required=True, help="write the three files")
    parser.parse_args()
    DESCRIPTORS.write_bytes(build_descriptors().SerializeToString(deterministic=True))
    PROTO.write_text(proto_text(), encoding="utf-8")
    DOCS.write_text(with_generated_part(DOCS.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
