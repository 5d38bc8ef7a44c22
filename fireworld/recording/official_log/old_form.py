"""Official logs of before 2021: type and length of each record, then big-endian numbers, and names as texts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from fireworld.errors import LogError
from fireworld.recording.official_log import names
from fireworld.recording.official_log.parts import (
    N_EDGES_MAX,
    N_ENTITIES_MAX,
    Configuration,
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
from fireworld.recording.official_log.protobuf_form import RECORD_BYTES_MAX
from fireworld.recording.official_log.source import Bytes

MAGIC: Final = b"\xe5\x42\xd5\x85"
"""The type of the first record."""
_START: Final = int.from_bytes(MAGIC, "big")
_END, _INITIAL, _PERCEPTION, _COMMANDS, _UPDATES, _CONFIGURATION = range(6)
_NAMES: Final = ("end", "initial conditions", "perception", "commands", "updates", "configuration")
_TEXT_BYTES_MAX: Final = 1 << 16


def read_parts(source: Bytes, form: Form) -> Parts:
    """Yield the parts of a log.

    Raises:
        CutOffError: it ends within a record.
        LogError: a record makes no sense.
    """
    form.text, form.numbering = "the form before 2021", "names as texts"
    n_records = 0
    while not source.at_end():
        n_records += 1
        kind, length = (int.from_bytes(source.read(4), "big") for _ in range(2))
        if (kind == _START) != (n_records == 1) or (kind >= len(_NAMES) and kind != _START):
            raise LogError(f"record {n_records}: {kind:#x} is no type of a record")
        if kind in {_PERCEPTION, _COMMANDS, _START}:
            source.skip(length)
            continue
        if length > RECORD_BYTES_MAX:
            raise LogError(f"record {n_records}: expected at most {RECORD_BYTES_MAX} bytes, got {length}")
        record = _Record(source.read(length))
        try:
            part = _READERS[kind](record)
            record.end()
        except LogError as error:
            raise LogError(f"record {n_records}: {_NAMES[kind]}: {error}") from None
        yield part
        if kind == _END:
            return


class _Record:
    """The bytes of a record, taken front to back."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self.position = 0

    def take(self, n: int) -> bytes:
        """Take bytes."""
        end = self.position + n
        if n < 0 or end > len(self._data):
            raise LogError(f"{n} bytes are more than there are")
        found = self._data[self.position : end]
        self.position = end
        return found

    def end(self) -> None:
        """Check that nothing is left."""
        if self.position != len(self._data):
            raise LogError(f"{len(self._data) - self.position} bytes are left over")

    def number(self) -> int:
        """Take a number of four bytes, with a sign."""
        return int.from_bytes(self.take(4), "big", signed=True)

    def count(self, most: int) -> int:
        """Take how many of something follow."""
        n = self.number()
        if not 0 <= n <= most:
            raise LogError(f"expected from 0 to {most} of what follows, got {n}")
        return n

    def text(self) -> str:
        """Take a text with its length before it."""
        return self.take(self.count(_TEXT_BYTES_MAX)).decode("utf-8", "replace")


def _initial(record: _Record) -> Part:
    entities = []
    for _ in range(record.count(N_ENTITIES_MAX)):
        kind, entity_id, n_bytes = names.entity_number(record.text()), record.number(), record.number()
        end = record.position + n_bytes
        entities.append(Entity(kind, entity_id, _properties(record)))
        if record.position != end:
            raise LogError(f"entity {entity_id}: it is not as long as it says")
    return Initial(entities)


def _updates(record: _Record) -> Part:
    time, changes = record.number(), []
    for _ in range(record.count(N_ENTITIES_MAX)):
        entity_id = record.number()
        changes.append(Entity(names.entity_number(record.text()), entity_id, _properties(record)))
    record.take(4 * record.count(N_ENTITIES_MAX))  # entities that are no more: blockades
    return Updates(time, changes)


def _properties(record: _Record) -> dict[int, Value]:
    found: dict[int, Value] = {}
    for _ in range(record.count(len(names.PROPERTIES))):
        name = names.property_number(record.text())
        defined = record.take(1) == b"\1"
        value = record.take(record.number()) if defined else None
        if name in names.READ:
            found[name] = _value(name, value) if value is not None else None
    return found


def _value(name: int, data: bytes) -> Value:
    numbers = [int.from_bytes(data[k : k + 4], "big", signed=True) for k in range(0, len(data), 4)]
    if name != names.EDGES:
        if len(data) != 4:
            raise LogError(f"{names.PROPERTIES[name]}: expected 4 bytes, got {len(data)}")
        return numbers[0]
    n_edges, numbers = numbers[0] if numbers else 0, numbers[1:]
    if not 0 <= n_edges <= N_EDGES_MAX or len(data) != 4 + 20 * n_edges:
        raise LogError(f"edges: {len(data)} bytes for {n_edges} of them")
    return [Edge(*numbers[k : k + 5]) for k in range(0, len(numbers), 5)]


def _configuration(record: _Record) -> Part:
    pairs = [(record.text(), record.text()) for _ in range(record.count(_TEXT_BYTES_MAX))]
    return Configuration(dict(pairs))


def _end(record: _Record) -> Part:
    del record
    return End()


_READERS: Final[dict[int, Callable[[_Record], Part]]] = {
    _END: _end, _INITIAL: _initial, _UPDATES: _updates, _CONFIGURATION: _configuration,
}  # fmt: skip
