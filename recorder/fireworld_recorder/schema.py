"""What travels in a log: one protobuf message per topic, derived from the field metadata of fireworld.records.

`make docs` renews what is made from it: the binary descriptors that every log carries, and their readable form.
"""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Final

from fireworld.records import STEP_TOPICS, Array, CityRecord, Snapshot, Wire, column, value

PACKAGE: Final = "fireworld.log.v1"
DESCRIPTORS: Final = Path(__file__).with_name("fireworld_log.binpb")
PROTO: Final = Path(__file__).with_name("fireworld_log.proto")
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
