"""Compare two values of a field, by rules: tolerances and fields to ignore."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import Any, Final, NamedTuple

import numpy as np

from fireworld.errors import LogError, expected, nearest
from fireworld.records import STEP_TOPICS, Array, CityRecord, Snapshot
from fireworld_recorder.schema import Commit, Field, message_of

_TYPES: Final[tuple[type[Any], ...]] = (CityRecord, *STEP_TOPICS)
_FIELDS: Final = {topic.topic: message_of(topic).fields for topic in _TYPES}
_ENDINGS: Final = tuple(item for item in message_of(Commit).fields if item.wire == "bool")
"""How a run ended: the fields of /commit that are no number of a step and no hash."""


class FieldDifference(NamedTuple):
    """Where two values of one field differ: the first entry that does."""

    topic: str
    item: Field
    position: int | None  # in the array; None for a single value, and for arrays of different lengths
    a: Any
    b: Any
    lengths: bool = False  # a and b are the lengths of two arrays
    unequal: Array | None = None  # (length,) where the arrays differ; None for a single value, and for other lengths

    @property
    def entity_index(self) -> int | None:
        """Of the entity that the entry belongs to."""
        return None if self.position is None else self.position // self.item.width


class Rules:
    """Which fields are compared, and how exactly.

    Args:
        tolerances: by `topic.field` or `field`: the largest difference that counts as none.
        ignore: topics, `topic.field`s or `field`s to leave out.

    Raises:
        LogError: a name is not a field, or a tolerance is not a number >= 0.
    """

    def __init__(self, tolerances: Mapping[str, float], ignore: Collection[str]) -> None:
        tolerances = {check_field_name("tolerance", name): tolerance for name, tolerance in tolerances.items()}
        ignore = {check_field_name("ignore", name, topics=True) for name in sorted(ignore)}
        for name, tolerance in tolerances.items():
            if not (math.isfinite(tolerance) and tolerance >= 0):
                raise LogError(expected("tolerance", name, "a number >= 0", tolerance))
        # Snapshots hold what the topics hold, and more, so the rules for fields would have to hold for them too.
        self.snapshots = not tolerances and not ignore
        self.endings = [
            item for item in _ENDINGS if {Commit.topic[1:], item.name, _full(Commit.topic, item)}.isdisjoint(ignore)
        ]
        self.fields: dict[str, list[tuple[Field, float]]] = {}
        for topic, items in _FIELDS.items():
            self.fields[topic] = [
                (item, tolerances.get(_full(topic, item), tolerances.get(item.name, 0.0)))
                for item in items
                if {topic[1:], item.name, _full(topic, item)}.isdisjoint(ignore)
            ]


def check_field_name(where: str, name: str, *, topics: bool = False) -> str:
    """Return the name of a field, or with `topics` of a topic, without the slash that a topic may begin with.

    Raises:
        LogError: there is no such field; with the nearest names.
    """
    name = name.removeprefix("/")
    fields = {**_FIELDS, Commit.topic: _ENDINGS} if topics else _FIELDS
    known = {_full(topic, item) for topic, items in fields.items() for item in items}
    known |= {item.name for items in fields.values() for item in items}
    if topics:
        known |= {topic[1:] for topic in (*fields, Snapshot.topic)}
    if name not in known:
        hint = nearest(name, known, n=3, otherwise="`fireworld info LOG --schema` lists them")
        raise LogError(expected(where, "", "a field of the log", name, hint))
    return name


def find(topic: str, item: Field, a: Any, b: Any, tolerance: float = 0.0) -> FieldDifference | None:
    """Find the first entry in which two values of a field differ; None if they are the same."""
    if not item.repeated:
        return None if _values_equal(a, b, tolerance) else FieldDifference(topic, item, None, a, b)
    if len(a) != len(b):
        return FieldDifference(topic, item, None, len(a), len(b), lengths=True)
    unequal = unequal_entries(a, b, tolerance)
    if unequal is None:
        return None
    position = int(np.argmax(unequal))
    return FieldDifference(topic, item, position, a[position].item(), b[position].item(), unequal=unequal)


def unequal_entries(a: Array, b: Array, tolerance: float = 0.0) -> Array | None:
    """Return at which entries two arrays of one length differ, (length,) bool; None if they are the same.

    NaN equals NaN, -0.0 equals 0.0, and an infinity only itself, whatever the tolerance.
    """
    if a.tobytes() == b.tobytes():
        return None
    unequal: Array = (a != b) & ~((a != a) & (b != b))  # noqa: PLR0124  # only NaN differs from itself
    if tolerance:
        with np.errstate(invalid="ignore", over="ignore"):
            unequal &= ~(np.abs(a.astype(np.float64) - b.astype(np.float64)) <= tolerance)
    return unequal if unequal.any() else None


def _values_equal(a: Any, b: Any, tolerance: float) -> bool:
    if a == b or (a != a and b != b):  # noqa: PLR0124  # only NaN differs from itself
        return True
    return bool(tolerance) and not isinstance(a, str) and abs(a - b) <= tolerance


def _full(topic: str, item: Field) -> str:
    return f"{topic[1:]}.{item.name}"
