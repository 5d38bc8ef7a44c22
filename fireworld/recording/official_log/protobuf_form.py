"""Official logs of 2021 and later: protobuf messages, each with its length before it, or one after another.

A message has one field, whose number says what it records. Perception, five sixths of a log, and commands are passed
over without being decoded. Numbers of fields are those of the official files RCRSLogProto and RCRSProto.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

from fireworld_recorder.codec import walk

from fireworld.errors import LogError
from fireworld.recording.official_log import names
from fireworld.recording.official_log.parts import (
    N_EDGES_MAX,
    Configuration,
    CutOffError,
    Edge,
    End,
    Entity,
    Form,
    Initial,
    Part,
    Parts,
    Updates,
    Value,
)
from fireworld.recording.official_log.source import Bytes

RECORD_BYTES_MAX: Final = 128 << 20
"""Of a record that is decoded: the start of a run with a hundred thousand buildings has 50 MB."""
START, INITIAL, COMMANDS, PERCEPTION, CONFIGURATION, UPDATES, END = range(1, 8)
"""Fields of a message, by what it records."""
RECORDS: Final = ("none", "start", "initial conditions", "commands", "perception", "configuration", "updates", "end")
_BYTES: Final = 2
_INT, _BOOL, _EDGES = 3, 4, 9
"""Fields of a property that hold its value."""


def begins(start: bytes) -> bool:
    """Return whether a file begins like a log of this form: with the empty record of the start, or its length."""
    return start[:2] == b"\x0a\x00" or (start[:3] == b"\0\0\0" and start[4:5] == b"\x0a")


def read_parts(source: Bytes, form: Form) -> Parts:
    """Yield the parts of a log.

    Raises:
        CutOffError: it ends within a record.
        LogError: a record makes no sense.
    """
    framed = source.peek(1) == b"\0"
    form.text = "protobuf" if framed else "protobuf without lengths"
    n_records = 0
    while not source.at_end():
        n_records += 1
        try:
            part = _read_record(source, form, framed=framed)
        except CutOffError:
            raise
        except LogError as error:
            raise LogError(f"record {n_records}: {error}") from None
        if part is not None:
            yield part
        if isinstance(part, End):
            return


def parse_record(data: bytes, form: Form) -> Part | None:
    """Return what a whole message records, None if that is not read."""
    found: Part | None = None
    for kind, wire_type, body in walk(memoryview(data)):
        _check(kind, wire_type)
        found = _parse(kind, body, form) or found
    return found


def _read_record(source: Bytes, form: Form, *, framed: bool) -> Part | None:
    """Read one message; None if it is not needed."""
    end = None
    if framed:
        length = int.from_bytes(source.read(4), "big")
        end = source.n_read + length
        if length < 2:
            raise LogError(f"expected a record of at least 2 bytes, got {length}")
    tag, n_bytes = _varint(source), _varint(source)
    kind = tag >> 3
    _check(kind, tag & 7)
    if end is not None and source.n_read + n_bytes > end:
        raise LogError(f"{RECORDS[kind]}: it is longer than its length says")
    if kind in {COMMANDS, PERCEPTION}:
        source.skip(n_bytes)
        part = None
    else:
        if n_bytes > RECORD_BYTES_MAX:
            raise LogError(f"{RECORDS[kind]}: expected at most {RECORD_BYTES_MAX} bytes, got {n_bytes}")
        part = _parse(kind, memoryview(source.read(n_bytes)), form)
    if end is not None and source.n_read != end:
        raise LogError(f"{RECORDS[kind]}: it is shorter than its length says")
    return part


def _check(kind: int, wire_type: int) -> None:
    if not START <= kind <= END or wire_type != _BYTES:
        raise LogError(f"expected one of {', '.join(RECORDS[1:])}, got field {kind} of wire type {wire_type}")


def _varint(source: Bytes) -> int:
    number = 0
    for shift in range(0, 35, 7):
        byte = source.read(1)[0]
        number |= (byte & 0x7F) << shift
        if byte < 0x80:
            return number
    raise LogError("expected a length of 32 bits, got more")


def _parse(kind: int, body: Any, form: Form) -> Part | None:
    """Return what the field of a message records."""
    try:
        if kind == INITIAL:
            return Initial([_entity(raw, form) for number, _, raw in walk(body) if number == 1])
        if kind == CONFIGURATION:
            return Configuration(dict(_settings(body)))
        if kind == UPDATES:
            return _updates(body, form)
        return End() if kind == END else None
    except LogError as error:
        raise LogError(f"{RECORDS[kind]}: {error}") from None
    except (TypeError, AttributeError):  # a number where a message should be, or the other way round
        raise LogError(f"{RECORDS[kind]}: a field has another type than it should") from None


def _entity(data: Any, form: Form) -> Entity:
    """Decode an entity of the start."""
    return _with_properties(data, form, kind_field=1, id_field=2)


def _updates(data: Any, form: Form) -> Updates:
    time, changes = 0, []
    for number, _, raw in walk(data):
        if number == 1:
            time = _signed(raw)
        elif number == 2:
            for inner, _, change in walk(raw):
                if inner == 1:
                    changes.append(_with_properties(change, form, kind_field=2, id_field=1))
    return Updates(time, changes)


def _with_properties(data: Any, form: Form, *, kind_field: int, id_field: int) -> Entity:
    """Decode an entity; in updates its number and its kind change places."""
    kind = entity_id = 0
    properties: dict[int, Value] = {}
    for number, _, raw in walk(data):
        if number == kind_field:
            kind = _signed(raw)
        elif number == id_field:
            entity_id = _signed(raw)
        elif number == 3:
            name, value = _property(raw)
            if name in names.READ:
                properties[name] = value
    if not form.numbering:
        form.numbering = "numbers of 2022 and later" if kind >= names.ENTITY_PREFIX else "numbers of 2021"
    return Entity(names.entity_number(kind), entity_id, properties)


def _property(data: Any) -> tuple[int, Value]:
    """Decode a property; of one that is not read, its name alone."""
    name, defined = 0, False
    value: Value = None
    for number, _, raw in walk(data):
        if number == 1:
            name = names.property_number(_signed(raw))
            if name not in names.READ:
                return name, None
        elif number == 2:
            defined = bool(raw)
        elif number in {_INT, _BOOL}:
            value = _signed(raw)
        elif number == _EDGES:
            value = [_edge(edge) for field, _, edge in walk(raw) if field == 1]
            if len(value) > N_EDGES_MAX:
                raise LogError(f"an area of {len(value)} edges")
    return name, value if defined else None


def _edge(data: Any) -> Edge:
    numbers = [0, 0, 0, 0, 0]
    for number, _, raw in walk(data):
        if 1 <= number <= 5:
            numbers[number - 1] = _signed(raw)
    return Edge(*numbers)


def _settings(data: Any) -> Iterator[tuple[str, str]]:
    """Yield the keys and values of a configuration."""
    for number, _, config in walk(data):
        for entry, _, pair in walk(config) if number == 1 else ():
            if entry == 1:
                found = {field: bytes(raw).decode("utf-8", "replace") for field, _, raw in walk(pair)}
                yield found.get(1, ""), found.get(2, "")


def _signed(raw: Any) -> int:
    """Return a varint as a signed number of 32 bits, which negative ones are."""
    if not isinstance(raw, int):
        raise TypeError
    number = raw - (1 << 64) if raw >= 1 << 63 else raw
    if not -(1 << 31) <= number < 1 << 31:
        raise LogError(f"expected a number of 32 bits, got {number}")
    return number
