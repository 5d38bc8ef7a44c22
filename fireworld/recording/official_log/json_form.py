"""Official logs as JSON, `{"records": [...]}`: protobuf's own mapping, read record by record."""

from __future__ import annotations

import codecs
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

from fireworld.errors import LogError, expected
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

_HEAD: Final = re.compile(r'\s*\{\s*"records"\s*:\s*\[')
_HEAD_CHARACTERS_MAX: Final = 1 << 10
_GAP: Final = re.compile(r"[\s,]*")
_LITERAL_CHARACTERS: Final = 16
"""A fault so near the end of the text may be that the rest of a literal is still to come."""
_RECORD_CHARACTERS_MAX: Final = 32 << 20
_EDGE: Final = ("startX", "startY", "endX", "endY", "neighbour")


def begins(start: bytes) -> bool:
    """Return whether a file begins like JSON."""
    return start.removeprefix(codecs.BOM_UTF8).lstrip()[:1] == b"{"


def read_parts(source: Bytes, form: Form) -> Parts:
    """Yield the parts of a log.

    Raises:
        CutOffError: it ends within a record.
        LogError: a record makes no sense.
    """
    form.text = "JSON"
    for number, record in enumerate(_records(source), start=1):
        try:
            part = _part(_mapping(record), form)
        except LogError as error:
            raise LogError(f"record {number}: {error}") from None
        if part is not None:
            yield part


class _Text:
    """The text of a file, of which the part that is looked at is held."""

    def __init__(self, source: Bytes) -> None:
        self.text = ""
        self._pieces = source.read_all()
        self._decoder = codecs.getincrementaldecoder("utf-8-sig")()
        self._ended = False

    def drop(self, n: int) -> None:
        """Forget the first characters."""
        self.text = self.text[n:]

    def more(self) -> bool:
        """Take as much again as is held, so that a long record is not parsed too often; False at the end of the file.

        Raises:
            LogError: it is no UTF-8, or what is held is too long for a record.
        """
        wanted, taken = max(1, len(self.text)), []
        try:
            while wanted > 0 and not self._ended:
                piece = next(self._pieces, b"")
                self._ended = not piece
                taken.append(self._decoder.decode(piece, final=self._ended))
                wanted -= len(taken[-1])
        except UnicodeDecodeError:
            raise LogError("expected JSON in UTF-8, got other bytes") from None
        self.text += "".join(taken)
        if len(self.text) > _RECORD_CHARACTERS_MAX:
            raise LogError(f"expected records of at most {_RECORD_CHARACTERS_MAX} characters, got more")
        return any(taken)


def _records(source: Bytes) -> Iterator[Any]:
    """Yield the records one by one; the text of one is held at a time."""
    held = _Text(source)
    while (head := _HEAD.match(held.text)) is None:
        if len(held.text) > _HEAD_CHARACTERS_MAX or not held.more():
            raise LogError(expected("JSON", "", '{"records": [...]}', held.text[:20]))
    held.drop(head.end())
    while True:
        gap = _GAP.match(held.text)
        held.drop(gap.end() if gap else 0)
        if held.text.startswith("]"):
            break
        found = _next_record(held)
        if found is not None:
            yield found[0]
            held.drop(found[1])
    while held.more():
        pass
    if held.text[1:].strip() != "}":
        raise LogError(expected("JSON", "", "} after the records", held.text[1:20].strip() or "nothing more"))


def _next_record(held: _Text) -> tuple[Any, int] | None:
    """Return the record that the text begins with and where it ends; None if more of the text was taken instead."""
    try:
        record, end = json.JSONDecoder().raw_decode(held.text)
    except json.JSONDecodeError as error:
        if "Unterminated" not in error.msg and error.pos < len(held.text) - _LITERAL_CHARACTERS:
            raise LogError(f"expected JSON, got {error.msg}") from None
        if held.more():
            return None
        raise CutOffError("it ends within a record") from None
    except RecursionError:
        raise LogError("expected records, got arrays in arrays in arrays") from None
    except ValueError:  # an integer of thousands of digits
        raise LogError("expected JSON with numbers of sane size, got something larger") from None
    if end == len(held.text) and held.more():  # a number may continue
        return None
    return record, end


def _part(record: Mapping[str, Any], form: Form) -> Part | None:
    """Return what a record holds; None if that is not read."""
    if "initialCondition" in record:
        found = _sequence(_mapping(record["initialCondition"]).get("entities", []))
        return Initial([_entity(_mapping(one), form) for one in found])
    if "config" in record:
        data = _mapping(_mapping(_mapping(record["config"]).get("config", {})).get("data", {}))
        return Configuration({key: str(value) for key, value in data.items()})
    if "update" in record:
        update = _mapping(record["update"])
        changes = _sequence(_mapping(update.get("changes", {})).get("changes", []))
        return Updates(_integer(update.get("time", 0)), [_entity(_mapping(one), form) for one in changes])
    if "end" in record:
        return End()
    if {"start", "perception", "command"}.isdisjoint(record):
        wanted = "one of start, initialCondition, config, perception, command, update, end"
        raise LogError(expected("record", "", wanted, ", ".join(record) or "nothing"))
    return None


def _entity(entity: Mapping[str, Any], form: Form) -> Entity:
    kind = _name(entity.get("urn", 0))
    if not form.numbering:
        is_name = isinstance(kind, str) and not kind.isdecimal()
        form.numbering = "names as texts" if is_name else "names as numbers"
    properties: dict[int, Value] = {}
    for item in map(_mapping, _sequence(entity.get("properties", []))):
        name = names.property_number(_name(item.get("urn", 0)))
        if name in names.READ:
            properties[name] = _value(item) if item.get("defined") is True else None
    return Entity(names.entity_number(kind), _integer(entity.get("entityID", 0)), properties)


def _value(item: Mapping[str, Any]) -> Value:
    for key in ("intValue", "boolValue"):
        if key in item:
            return _integer(item[key])
    if "edgeList" not in item:
        return None
    edges = _sequence(_mapping(item["edgeList"]).get("edges", []))
    if len(edges) > N_EDGES_MAX:
        raise LogError(f"an area of {len(edges)} edges")
    return [Edge(*(_integer(_mapping(edge).get(key, 0)) for key in _EDGE)) for edge in edges]


def _mapping(value: Any) -> Mapping[str, Any]:
    if not isinstance(value, dict):
        raise LogError(expected("JSON", "", "an object", value))
    return value


def _sequence(value: Any) -> Sequence[Any]:
    if not isinstance(value, list):
        raise LogError(expected("JSON", "", "an array", value))
    return value


def _name(value: Any) -> int | str:
    if not isinstance(value, int | str):
        raise LogError(expected("urn", "", "a number or a text", value))
    return value


def _integer(value: Any) -> int:
    if not isinstance(value, int) or not -(2**31) <= value < 2**31:
        raise LogError(expected("JSON", "", "a number of 32 bits", value))
    return int(value)
