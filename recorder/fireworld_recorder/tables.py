"""A run as tidy tables: which there are, what their columns are, and the rows that each step adds to them.

Columns, units and meanings come from the field metadata of fireworld.records; what is written here is only which
fields make which table.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from fireworld.errors import LogError, expected
from fireworld.records import (
    ACTIONS,
    DTYPES,
    Array,
    Brigades,
    Buildings,
    CityRecord,
    Civilians,
    Decisions,
    Draws,
    Entity,
    Events,
    Observations,
    Rewards,
    Score,
    StepRecord,
)
from fireworld_recorder.schema import Commit, Field, message_of

_NUMPY_TYPES: Final[Mapping[str, str]] = {**DTYPES, "bool": "|b1"}


@dataclass(frozen=True)
class Column:
    """One column of a table."""

    name: str
    dtype: str
    """numpy type."""
    doc: str
    unit: str = ""
    names: tuple[str, ...] = ()
    """Texts that the numbers stand for; the column holds the texts, and nothing for a number that has none."""


@dataclass(frozen=True)
class Table:
    """One table.

    Attributes:
        name: also the name of its file.
        doc: what a row is.
        columns: in their order.
        read: the values of a step (of the city, for the table `city`), one array per column, all of one length;
            None for a column that has nothing to say there.
    """

    name: str
    doc: str
    columns: tuple[Column, ...]
    read: Callable[[Any], list[Array | None]]


def _columns_of(topic: type[Any], per: str, prefix: str = "") -> dict[Field, list[Column]]:
    """List the columns of a topic's fields per entity: a coded field has a second one for its names."""
    found = {}
    for item in message_of(topic).fields:
        if item.per == per and item.width == 1:
            column = Column(prefix + item.name, _NUMPY_TYPES[item.wire], item.doc, item.unit)
            named = Column(f"{column.name}_name", "U", f"name of {column.name}", names=item.names)
            found[item] = [column, named] if item.names else [column]
    return found


def _column(topic: type[Any], name: str) -> Column:
    """Return the column of one field."""
    (item,) = (item for item in message_of(topic).fields if item.name == name)
    return Column(name, _NUMPY_TYPES[item.wire], item.doc, item.unit)


_STEP: Final = dataclasses.replace(_column(Commit, "step"), doc="step, a simulated minute; 0 is the state before")


def _entities(name: str, doc: str, index: Column | None, per: Entity, *topics: type[Any]) -> Table:
    """Make the table with a row for each step and entity, of all fields with an entry for each entity.

    Args:
        name: of the table.
        doc: what a row is.
        index: numbers the entities; None if one of the fields identifies them.
        per: what these fields have an entry for.
        topics: whose fields they are.
    """
    fields = {topic: _columns_of(topic, per) for topic in topics}
    columns = [_STEP, *([index] if index else [])]
    columns += [column for topic in topics for columns_of in fields[topic].values() for column in columns_of]

    def read(record: StepRecord) -> list[Array | None]:
        values: list[Array | None] = []
        for topic, items in fields.items():
            part = getattr(record, topic.topic[1:])
            for item, columns_of in items.items():
                values += [getattr(part, item.name)] * len(columns_of)
        return _step_rows(name, record.step, values, numbered=index is not None)

    return Table(name, doc, tuple(columns), read)


def _step_rows(table: str, step: int, values: list[Array | None], *, numbered: bool) -> list[Array | None]:
    """Put step and number before the values of a step's entities; a field that is empty has nothing to say."""
    n_rows = max(len(value) for value in values if value is not None)
    for value in values:
        if value is not None and len(value) not in {0, n_rows}:
            raise LogError(expected(f"step {step}", table, f"{n_rows} values in every field", len(value)))
    head: list[Array | None] = [np.full(n_rows, step, np.int32)]
    if numbered:
        head.append(np.arange(n_rows, dtype=np.int32))
    return head + [value if value is not None and len(value) == n_rows else None for value in values]


def _decisions() -> Table:
    """Make the table of what the brigades saw and chose, with a column for the Q-value of each action."""
    plain = _entities("decisions", "", _BRIGADE, "brigade", Observations, Decisions)
    (q_values,) = (item for item in message_of(Decisions).fields if item.width > 1)
    columns = [
        Column(f"q_{action.replace('-', '_')}", DTYPES[q_values.wire], f"value of the action `{action}`")
        for action in ACTIONS
    ]

    def read(record: StepRecord) -> list[Array | None]:
        values = plain.read(record)
        n_brigades, flat = len(values[0]) if values[0] is not None else 0, record.decisions.q_values
        if len(flat) not in {0, n_brigades * len(ACTIONS)}:
            wanted = f"{n_brigades * len(ACTIONS)} values"
            raise LogError(expected(f"step {record.step}", "decisions: q_values", wanted, len(flat)))
        by_action = flat.reshape(-1, len(ACTIONS))
        return values + [by_action[:, k] if len(flat) else None for k in range(len(ACTIONS))]

    doc = "what each brigade saw, chose and why; from step 1 on"
    return dataclasses.replace(plain, doc=doc, columns=(*plain.columns, *columns), read=read)


def _steps() -> Table:
    """Make the table with a row for each step, of all fields with a single value; those of some get a prefix."""
    prefixes: dict[type[Any], str] = {Draws: "draw_", Decisions: "", Rewards: "reward_", Score: ""}
    fields = {topic: _columns_of(topic, "", prefix) for topic, prefix in prefixes.items()}
    endings = [_column(Commit, name) for name in ("terminated", "truncated")]
    columns = [column for items in fields.values() for columns_of in items.values() for column in columns_of]

    def read(record: StepRecord) -> list[Array | None]:
        values = [
            getattr(getattr(record, topic.topic[1:]), item.name) for topic, items in fields.items() for item in items
        ]
        row = [record.step, *values, record.terminated, record.truncated]
        return [np.array([value], column.dtype) for value, column in zip(row, (_STEP, *columns, *endings), strict=True)]

    return Table("steps", "luck, reward and score of a step, and how the run ended", (_STEP, *columns, *endings), read)


def _city() -> Table:
    """Make the table with a row for each building, of what never changes."""
    fields = _columns_of(CityRecord, "building")
    columns = [column for columns_of in fields.values() for column in columns_of]

    def read(city: CityRecord) -> list[Array | None]:
        values = [getattr(city, item.name) for item, columns_of in fields.items() for _ in columns_of]
        return _step_rows("city", 0, values, numbered=True)[1:]

    return Table("city", "a building: what never changes", (_BUILDING, *columns), read)


_BUILDING: Final = Column("building", "<i4", "index of the building, the same in every table")
_BRIGADE: Final = Column("brigade", "<i4", "index of the brigade")

TABLES: Final[Mapping[str, Table]] = {
    table.name: table
    for table in (
        _city(),
        _entities("buildings", "a building after a step", _BUILDING, "building", Buildings),
        _entities("brigades", "a brigade after a step", _BRIGADE, "brigade", Brigades),
        _decisions(),
        _entities(
            "civilians",
            "a civilian after a step",
            Column("civilian", "<i4", "index of the civilian"),
            "civilian",
            Civilians,
        ),
        _entities("sites", "a fire site before the brigades chose", None, "site", Observations),
        _entities(
            "events",
            "something that happened in a step",
            Column("event", "<i4", "number of the event in its step"),
            "event",
            Events,
        ),
        _steps(),
    )
}
"""All tables by name; `city` is read from the city, all others from each step."""
