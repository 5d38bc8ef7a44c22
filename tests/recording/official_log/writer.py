"""Official logs made up here, in every form: what a kernel would write of a small town in which two buildings burn."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

ROAD, BLOCKADE, BUILDING, REFUGE, HYDRANT = 2, 3, 4, 5, 6
CIVILIAN, BRIGADE, AMBULANCE = 11, 12, 13
ENTITY_NAMES = {
    2: "ROAD", 3: "BLOCKADE", 4: "BUILDING", 5: "REFUGE", 6: "HYDRANT", 11: "CIVILIAN", 12: "FIRE_BRIGADE",
    13: "AMBULANCE_TEAM",
}  # fmt: skip
X, Y, FLOORS, IGNITION, FIERYNESS, CODE, GROUND, TOTAL, APEXES, EDGES = 6, 7, 10, 12, 13, 15, 16, 17, 18, 19
POSITION, HISTORY, HP, DAMAGE, BURIEDNESS, WATER, TEMPERATURE, IMPORTANCE = 20, 22, 24, 25, 26, 28, 29, 30
PROPERTY_NAMES = {
    6: "X", 7: "Y", 10: "FLOORS", 12: "IGNITION", 13: "FIERYNESS", 15: "BUILDING_CODE", 16: "BUILDING_AREA_GROUND",
    17: "BUILDING_AREA_TOTAL", 18: "APEXES", 19: "EDGES", 20: "POSITION", 22: "POSITION_HISTORY", 24: "HP",
    25: "DAMAGE", 26: "BURIEDNESS", 28: "WATER_QUANTITY", 29: "TEMPERATURE", 30: "IMPORTANCE",
}  # fmt: skip

Thing = tuple[int, int, dict[int, Any]]  # kind, id, properties; an undefined one is None


def square(x: int, y: int, side: int, neighbours: tuple[int, int, int, int] = (0, 0, 0, 0)) -> list[tuple[int, ...]]:
    """Return the edges of a square: south, east, north, west, with who lives behind each."""
    corners = [(x, y), (x + side, y), (x + side, y + side), (x, y + side)]
    return [(*corners[k], *corners[(k + 1) % 4], neighbours[k]) for k in range(4)]


def _building(number: int, x: int, *, kind: int = BUILDING, **more: int) -> Thing:
    facts = {X: x + 5000, Y: 5000, FLOORS: 2, CODE: 1, GROUND: 100, TOTAL: 200, FIERYNESS: 0, IMPORTANCE: 1}
    facts |= {EDGES: square(x, 0, 10_000, (0, 0, 900 + number, 0))}
    return kind, number, facts | {int(key): value for key, value in more.items()}


def _road(number: int, x: int, south: int, west: int, east: int, *, kind: int = ROAD) -> Thing:
    return kind, number, {X: x + 5000, Y: 12_000, EDGES: square(x, 10_000, 10_000, (south, east, 0, west))}


def _person(kind: int, number: int, position: int, x: int, **more: int) -> Thing:
    facts = {X: x, Y: -5, POSITION: position, HP: 10_000, DAMAGE: 0, BURIEDNESS: 0, HISTORY: []}
    return kind, number, facts | {int(key): value for key, value in more.items()}


def town() -> list[Thing]:
    """Three buildings in a row and the roads along them, two civilians, a brigade and an ambulance."""
    return [
        _road(901, -20_000, 1, 0, 902),
        _road(902, -10_000, 2, 901, 903, kind=HYDRANT),
        _road(903, 0, 3, 902, 0),
        _building(1, -20_000, kind=REFUGE),
        _building(2, -10_000),
        _building(3, 0, **{str(IMPORTANCE): 5}),
        _person(CIVILIAN, 50, 2, -4_000, **{str(BURIEDNESS): 40}),
        _person(CIVILIAN, 51, 3, 6_000),
        _person(BRIGADE, 60, 901, -15_000, **{str(WATER): 7_500}),
        _person(AMBULANCE, 70, 902, -5_000),
    ]


SETTINGS = {
    "random.seed": "17",
    "kernel.timesteps": "6",
    "gis.map.dir": "/home/somebody/maps/row/map",
    "fire.tank.maximum": "7500",
    "fire.extinguish.max-sum": "500",
    "fire.extinguish.max-distance": "50000",
    "resq-fire.rays.dir": "/home/somebody/rays",
    "score.function": "rescuecore2.standard.score.LegacyScoreFunction",
    **{
        f"score.standard.building-fire.{name}": text
        for name, text in {
            "heating": "0.66", "burning": "0.33", "inferno": "0.0", "water-damage": "0.90", "minor-damage": "0.75",
            "moderate-damage": "0.5", "severe-damage": "0.25", "burnt-out": "0",
        }.items()
    },
}  # fmt: skip


def steps() -> list[list[Thing]]:
    """Return what changes in steps 1 to 6."""
    return [
        [(BUILDING, 2, {IGNITION: True, FIERYNESS: 1, TEMPERATURE: 90}), (CIVILIAN, 50, {HISTORY: None})],
        [(BUILDING, 2, {TEMPERATURE: 250, FIERYNESS: 2}), (CIVILIAN, 50, {DAMAGE: 20, HP: 9_980})],
        [
            (BUILDING, 3, {FIERYNESS: 1, TEMPERATURE: 60}),
            (BUILDING, 2, {FIERYNESS: 3, TEMPERATURE: 311}),
            (CIVILIAN, 50, {POSITION: 70, X: None, Y: None, BURIEDNESS: 0}),
            (BRIGADE, 60, {X: -14_000, Y: 9, POSITION: 901, WATER: 0}),
            (BLOCKADE, 2_000_000_000, {APEXES: [1, 2, 3, 4], POSITION: 901}),
        ],
        [(BUILDING, 3, {FIERYNESS: 5, TEMPERATURE: 12}), (AMBULANCE, 70, {X: -5_500, Y: 1}), (ROAD, 903, {})],
        [(CIVILIAN, 51, {HP: 0, DAMAGE: 500}), (CIVILIAN, 50, {POSITION: 1, X: -15_000, Y: 5_000})],
        [(BUILDING, 2, {FIERYNESS: 8, TEMPERATURE: 100})],
    ]


@dataclass
class Log:
    """What a log tells; `end`: whether it has its last record."""

    town: list[Thing] = field(default_factory=town)
    settings: dict[str, str] | None = field(default_factory=lambda: dict(SETTINGS))
    steps: list[list[Thing]] = field(default_factory=steps)
    end: bool = True
    first_step: int = 1
    perception: int = 300
    """Bytes of what each agent perceives in a step."""


def varint(number: int) -> bytes:
    number &= (1 << 64) - 1
    out = bytearray()
    while number >= 0x80:
        out.append(number & 0x7F | 0x80)
        number >>= 7
    out.append(number)
    return bytes(out)


def _int(number: int, value: int) -> bytes:
    return varint(number << 3) + varint(value) if value else b""


def part(number: int, body: bytes) -> bytes:
    return varint(number << 3 | 2) + varint(len(body)) + body


def _property(name: int, value: Any, prefix: int) -> bytes:
    body = _int(1, name + prefix)
    if value is None:
        return body
    body += _int(2, 1)
    if isinstance(value, bool):
        return body + varint(4 << 3) + varint(int(value))
    if isinstance(value, int):
        return body + varint(3 << 3) + varint(value)
    if name == EDGES:
        edges = [b"".join(_int(k, n) for k, n in enumerate(edge, start=1)) for edge in value]
        return body + part(9, b"".join(part(1, edge) for edge in edges))
    return body + part(7, part(1, b"".join(map(varint, value))) if value else b"")


def _thing(thing: Thing, *, prefixed: bool, changed: bool) -> bytes:
    kind, number, facts = thing
    kind += 0x1100 if prefixed else 0
    head = _int(1, number) + _int(2, kind) if changed else _int(1, kind) + _int(2, number)
    return head + b"".join(part(3, _property(name, value, 0x1200 if prefixed else 0)) for name, value in facts.items())


def messages(log: Log, *, prefixed: bool = False) -> Iterator[bytes]:
    """Yield the protobuf messages of a log."""
    yield part(1, b"")
    yield part(2, b"".join(part(1, _thing(one, prefixed=prefixed, changed=False)) for one in log.town))
    if log.settings is not None:
        pairs = [part(1, key.encode()) + part(2, text.encode()) for key, text in log.settings.items()]
        yield part(5, part(1, b"".join(part(1, pair) for pair in pairs)))
    for time, changes in enumerate(log.steps, start=log.first_step):
        yield part(4, _int(1, time) + _int(2, 60) + part(3, bytes(log.perception)))
        yield part(3, _int(1, time))
        body = b"".join(part(1, _thing(one, prefixed=prefixed, changed=True)) for one in changes)
        yield part(6, _int(1, time) + part(2, body + part(2, varint(2_000_000_001))))
    if log.end:
        yield part(7, b"")


def protobuf(log: Log, *, prefixed: bool = False, framed: bool = True) -> bytes:
    return b"".join((len(one).to_bytes(4, "big") if framed else b"") + one for one in messages(log, prefixed=prefixed))


def _number(value: int) -> bytes:
    return (value & 0xFFFFFFFF).to_bytes(4, "big")


def _text(text: str) -> bytes:
    return _number(len(text.encode())) + text.encode()


def _old_properties(facts: dict[int, Any]) -> bytes:
    out = _number(len(facts))
    for name, value in facts.items():
        out += _text(f"urn:rescuecore2.standard:property:{PROPERTY_NAMES[name].lower().replace('_', '')}")
        if value is None:
            out += b"\0"
            continue
        if name == EDGES:
            data = _number(len(value)) + b"".join(_number(n) for edge in value for n in edge)
        elif isinstance(value, list):
            data = _number(len(value)) + b"".join(map(_number, value))
        else:
            data = bytes([value]) if isinstance(value, bool) else _number(value)
        out += b"\1" + _number(len(data)) + data
    return out


def _old_kind(kind: int) -> bytes:
    return _text(f"urn:rescuecore2.standard:entity:{ENTITY_NAMES[kind].lower().replace('_', '')}")


def old(log: Log) -> bytes:
    """Write a log in the form of before 2021."""
    records = [(0xE542D585, b"")]
    body = _number(len(log.town))
    for kind, number, facts in log.town:
        content = _old_properties(facts)
        body += _old_kind(kind) + _number(number) + _number(len(content)) + content
    records.append((1, body))
    if log.settings is not None:
        pairs = b"".join(_text(key) + _text(text) for key, text in log.settings.items())
        records.append((5, _number(len(log.settings)) + pairs))
    for time, changes in enumerate(log.steps, start=log.first_step):
        records += [(2, _number(time) + bytes(log.perception)), (3, _number(time))]
        body = _number(time) + _number(len(changes))
        for kind, number, facts in changes:
            body += _number(number) + _old_kind(kind) + _old_properties(facts)
        records.append((4, body + _number(1) + _number(2_000_000_001)))
    records += [(0, b"")] if log.end else []
    return b"".join(_number(kind) + _number(len(body)) + body for kind, body in records)


def _json_property(name: int, value: Any, *, numbers: bool) -> dict[str, Any]:
    found: dict[str, Any] = {"urn": name + 0x1200 if numbers else PROPERTY_NAMES[name]}
    if value is None:
        return found
    found["defined"] = True
    if isinstance(value, bool):
        return found | {"boolValue": value}
    if isinstance(value, int):
        return found | {"intValue": value}
    if name == EDGES:
        keys = ("startX", "startY", "endX", "endY", "neighbour")
        edges = [{key: n for key, n in zip(keys, edge, strict=True) if n} for edge in value]
        return found | {"edgeList": {"edges": edges}}
    return found | {"intList": {"values": value} if value else {}}


def as_json(log: Log, *, numbers: bool = False) -> bytes:
    """Write a log as JSON, with names or with the numbers of 2022."""

    def thing(one: Thing) -> dict[str, Any]:
        kind, number, facts = one
        properties = [_json_property(name, value, numbers=numbers) for name, value in facts.items()]
        return {
            "urn": kind + 0x1100 if numbers else ENTITY_NAMES[kind], "entityID": number, "properties": properties,
        }  # fmt: skip

    records: list[dict[str, Any]] = [
        {"start": {}},
        {"initialCondition": {"entities": [thing(one) for one in log.town]}},
    ]
    if log.settings is not None:
        records.append({"config": {"config": {"data": log.settings}}})
    for time, changes in enumerate(log.steps, start=log.first_step):
        records.append({"perception": {"time": time, "visible": {"changes": [{"entityID": 1}]}}})
        records.append({"command": {"time": time}})
        records.append({"update": {"time": time, "changes": {"changes": [thing(one) for one in changes]}}})
    records += [{"end": {}}] if log.end else []
    return json.dumps({"records": records}, indent=1).encode()
