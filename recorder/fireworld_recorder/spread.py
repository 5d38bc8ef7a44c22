"""How a difference spreads: which buildings, brigades and civilians it has reached, step by step."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain, count
from typing import Final, NamedTuple

import numpy as np

from fireworld.records import Array, Buildings, CityRecord, StepRecord
from fireworld_recorder.match import FieldDifference, Rules
from fireworld_recorder.step_difference import FirstDifference, find_differences

KINDS: Final = ("building", "brigade", "civilian")
"""The entities that are counted: those that are the same ones in both runs all the time."""

Counts = tuple[int | None, int | None, int | None, int | None]
"""Of a row: buildings, states, brigades, civilians."""

Differences = list[list[FieldDifference]]
"""Of a step, as `find_differences` returns them."""


class ValuePair(NamedTuple):
    """One number in both runs; None where only the other run has the step."""

    a: float | None
    b: float | None


@dataclass(frozen=True, slots=True)
class SpreadRow:
    """How far a difference has come at one step."""

    step: int
    n_buildings: int | None
    """That differ in any field; None, as the next three, where only one run has the step."""
    n_states: int | None
    """Buildings whose fieryness differs."""
    n_brigades: int | None
    n_civilians: int | None
    score: ValuePair
    n_burning: ValuePair
    n_burnt_out: ValuePair


@dataclass(frozen=True)
class Spread:
    """How a difference spread from step to step."""

    rows: Sequence[SpreadRow] = ()
    """At the step where the runs first differ and 1, 2, 5, 10, 20, 50... after it, and the last: of the steps that
    both runs have."""
    n_entities: Mapping[str, int] = field(default_factory=dict)
    """By kind: how many there are."""
    n_reached: Mapping[str, int] = field(default_factory=dict)
    """By kind: how many differed at some step."""
    first_by_entity: Mapping[str, FirstDifference | None] = field(default_factory=dict)
    """By kind: the first that differed and in what; None if none did."""


class SpreadTally:
    """Counts, step by step; holds one bit for each entity, and the rows of a few steps.

    Args:
        city: of the first run.
        watch: called with the row of every step that either run has.
    """

    def __init__(self, city: CityRecord, watch: Callable[[SpreadRow], None] | None = None) -> None:
        self._reached = {kind: np.zeros(n, dtype=bool) for kind, n in entity_counts(city).items()}
        self._first: dict[str, FirstDifference | None] = dict.fromkeys(KINDS)
        self._kept: list[SpreadRow] = []
        self._last: SpreadRow | None = None
        self._next_step: int | None = None  # the next to be kept; None before the first difference
        self._distances = _distances()
        self._watch = watch

    def take_both(
        self,
        a: StepRecord,
        b: StepRecord,
        found: Differences,
        describe: Callable[[FieldDifference], FirstDifference],
        *,
        differs: bool,
    ) -> None:
        """Add a step that both runs have.

        Args:
            a: the step of the first run.
            b: that of the second.
            found: its differences, from `find_differences`.
            describe: puts one of them into words.
            differs: whether the runs differ in this step or did before, in anything.
        """
        counts = dict.fromkeys(KINDS, 0)
        for kind, differing in _differing(found, {kind: len(bits) for kind, bits in self._reached.items()}).items():
            counts[kind] = int(np.count_nonzero(differing))
            self._reached[kind] |= differing
            if counts[kind] and self._first[kind] is None:
                self._first[kind] = describe(next(one for one in chain(*found) if _is_of(kind, one)))
        row = self._row(a.step, (counts["building"], _n_states(found), counts["brigade"], counts["civilian"]), a, b)
        if self._next_step is None and differs:
            self._next_step = row.step
        if self._next_step is not None:
            self._last = row
            if row.step >= self._next_step:
                self._keep(row)

    def take_one(self, a: StepRecord | None, b: StepRecord | None) -> None:
        """Add a step that only one run has."""
        present = a or b
        if present is not None:
            self._row(present.step, (None,) * 4, a, b)

    def spread(self) -> Spread:
        """Return the spread up to the last step added."""
        return Spread(
            rows=tuple(dict.fromkeys([*self._kept, self._last] if self._last else [])),
            n_entities={kind: len(bits) for kind, bits in self._reached.items()},
            n_reached={kind: int(np.count_nonzero(bits)) for kind, bits in self._reached.items()},
            first_by_entity=dict(self._first),
        )

    def _keep(self, row: SpreadRow) -> None:
        """Add a row to the spread, and compute the step of the next."""
        self._kept.append(row)
        first = self._kept[0].step
        self._next_step = next(first + distance for distance in self._distances if first + distance > row.step)

    def _row(self, step: int, counts: Counts, a: StepRecord | None, b: StepRecord | None) -> SpreadRow:
        score, burning, burnt_out = (
            ValuePair(*(None if record is None else getattr(record.score, name) for record in (a, b)))
            for name in ("score", "n_burning", "n_burnt_out")
        )
        row = SpreadRow(step, *counts, score, burning, burnt_out)
        if self._watch is not None:
            self._watch(row)
        return row


def _distances() -> Iterator[int]:
    """Yield 1, 2, 5, 10, 20, 50, ..."""
    for power in count():
        yield from (factor * 10**power for factor in (1, 2, 5))


def entity_counts(city: CityRecord) -> dict[str, int]:
    """Count the entities of each kind."""
    return {
        "building": len(city.building_id),
        "brigade": len(city.brigade_tank_litres),
        "civilian": len(city.civilian_hp),
    }


def differing_entities(a: StepRecord, b: StepRecord, rules: Rules, city: CityRecord) -> dict[str, Array]:
    """Return which entities differ in a step, in any field that the rules compare, by kind: (n,) bool."""
    return _differing(find_differences(a, b, rules), entity_counts(city))


def _differing(found: Differences, n_entities: Mapping[str, int]) -> dict[str, Array]:
    """Return which entities differ, by kind: (n,) bool.

    A field that only one of the runs recorded, such as Q-values, is left out.
    """
    differing = {kind: np.zeros(n, dtype=bool) for kind, n in n_entities.items()}
    for one in chain(*found):
        kind, unequal = one.item.per, one.unequal
        if kind in differing and unequal is not None and n_entities[kind] and len(unequal) % n_entities[kind] == 0:
            differing[kind] |= unequal.reshape(n_entities[kind], -1).any(axis=1)
    return differing


def _n_states(found: Differences) -> int:
    """Count the buildings whose fieryness differs."""
    for one in chain(*found):
        if (one.topic, one.item.name) == (Buildings.topic, "fieryness") and one.unequal is not None:
            return int(np.count_nonzero(one.unequal))
    return 0


def _is_of(kind: str, found: FieldDifference) -> bool:
    """Return whether a difference is one of single entities of a kind."""
    return found.unequal is not None and found.item.per == kind
