"""The parts of an official log, as all its forms yield them: the start of the run, its configuration, its steps."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from fireworld.errors import LogError

N_ENTITIES_MAX: Final = 2_000_000
N_EDGES_MAX: Final = 100_000
ID_MAX: Final = 2**31 - 1


class Edge(NamedTuple):
    """One side of an area, from corner to corner; whole millimetres."""

    x: int
    y: int
    end_x: int
    end_y: int
    neighbour: int
    """Of the area on its other side, which can be walked into; 0: none."""


Value = int | Sequence[Edge] | None
"""Of a property: a number, the sides of an area, or None where it is not defined."""


class Entity(NamedTuple):
    """An entity with those of its properties that are read, or those of them that changed."""

    kind: int
    id: int
    properties: Mapping[int, Value]


@dataclass(frozen=True)
class Initial:
    """All entities at the start of the run."""

    entities: Sequence[Entity]


@dataclass(frozen=True)
class Configuration:
    """What the kernel was configured with."""

    values: Mapping[str, str]


@dataclass(frozen=True)
class Updates:
    """What changed in a step."""

    time: int
    changes: Sequence[Entity]


@dataclass(frozen=True)
class End:
    """The log ends here."""


Part = Initial | Configuration | Updates | End
Parts = Iterator[Part]


@dataclass
class Form:
    """What a reader has found out about the form of a log on its way.

    Attributes:
        text: the form in words.
        numbering: how it calls entities, as far as that is known.
    """

    text: str
    numbering: str = field(default="")

    def __str__(self) -> str:
        return f"{self.text}, {self.numbering}" if self.numbering else self.text


class CutOffError(LogError):
    """A log that ends within a record: what comes before is whole."""
