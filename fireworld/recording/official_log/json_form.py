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


def _records(source: Bytes) -> Iterator[Any]:
    """Yield the records one by one; the text of one is held at a time."""
    pieces = source.read_all()
    to_text = codecs.getincrementaldecoder("utf-8-sig")()
    decoder = json.JSONDecoder()
    text, ended = "", False

    def more() -> bool:
        """Take the next piece to the text; False at the end of the file."""
        nonlocal text, ended
        wanted = max(1, len(text))  # twice as much as before, so that a long record is not parsed again and again
        taken = []
        try:
            while wanted > 0 and not ended:
                piece = next(pieces, b"")
                ended = not piece
                taken.append(to_text.decode(piece, final=ended))
                wanted -= len(taken[-1])
        except UnicodeDecodeError:
            raise LogError("expected JSON in UTF-8, got other bytes") from None
        text += "".join(taken)
        if len(text) > _RECORD_CHARACTERS_MAX:
            raise LogError(f"expected records of at most {_RECORD_CHARACTERS_MAX} characters, got more")
        return bool(taken) and any(taken)

    while (head := _HEAD.match(text)) is None:
        if len(text) > _HEAD_CHARACTERS_MAX or not more():
            raise LogError(expected("JSON", "", '{"records": [...]}', text[:20]))
    text = text[head.end() :]
    while True:
        text = text[_GAP.match(text).end() :]  # type: ignore[union-attr]  # it matches the empty text, too
        if text.startswith("]"):
            while more():
                pass
            if text[1:].strip() != "}":
                raise LogError(expected("JSON", "", "} after the records", text[1:20].strip() or "nothing"))
            return
        try:
            record, end = decoder.raw_decode(text)
            if end == len(text) and more():  # a number may go on
                continue
        except RecursionError:
            raise LogError("expected records, got arrays in arrays in arrays") from None
        except json.JSONDecodeError as error:
            if "Unterminated" not in error.msg and error.pos < len(text) - _LITERAL_CHARACTERS:
                raise LogError(f"expected JSON, got {error.msg}") from None
            if more():
                continue
            raise CutOffError("it ends within a record") from None
        except ValueError:  # an integer of thousands of digits
            raise LogError("expected JSON with numbers of sane size, got something larger") from None
        text = text[end:]
        yield record


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
