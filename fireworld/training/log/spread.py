"""How far two trainings differ, scenario by scenario: their episodes, what they brought, their final tables."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from fireworld.training.log.played import Played
from fireworld.training.log.reader import Part
from fireworld.training.log.records import Episode, Tables, part_number

LAST: Final = 20
"""Episodes at the end of a scenario over which return and score are averaged: as many as a policy must settle for."""


@dataclass(frozen=True)
class ScenarioDifference:
    """How two trainings compare in a scenario; of a search: in all generations.

    Attributes:
        scenario: its name.
        n_episodes: in either training.
        n_equal: episodes that are the same, of those that both have.
        first: the first that is not; None: all are.
        total_reward: the mean return of the last 20 episodes of either.
        score: the mean score of these, as a share of the maximum.
        n_steps: the mean number of steps of these.
        agreement: the share of the states that both have visited in which the final tables prefer the same action; nan
            where there is none, or a training did not finish the scenario.
        value_difference: the largest difference of a value in the final tables; nan likewise.
    """

    scenario: str
    n_episodes: tuple[int, int]
    n_equal: int
    first: int | None
    total_reward: tuple[float, float]
    score: tuple[float, float]
    n_steps: tuple[float, float]
    agreement: float
    value_difference: float

    @property
    def same(self) -> bool:
        """Whether all episodes are the same."""
        return self.first is None and self.n_episodes[0] == self.n_episodes[1]

    @property
    def verdict(self) -> str:
        """In words."""
        if self.same:
            return "the same"
        if self.first is None:
            return "one has more"
        return "differ from the first" if self.first == 0 else f"differ from {self.first} on"


class Spread:
    """How two trainings compare, scenario by scenario, from their parts in order."""

    def __init__(self) -> None:
        self._lines: dict[int, tuple[dict[int, Any], dict[int, Any]]] = {}
        self._same: dict[int, set[int]] = {}
        self._tables: dict[int, list[Tables | None]] = {}

    def add(self, one: Part | None, other: Part | None, *, same: bool, number: int | None = None) -> None:
        """Add the next part of both; with a number, if they have none of their own."""
        for side, part in enumerate((one, other)):
            if part is None:
                continue
            key, own, line = _line(part)
            place = own if number is None else number
            self._lines.setdefault(key, ({}, {}))[side][place] = line
            if same:
                self._same.setdefault(key, set()).add(place)
            if Tables in part and part[Episode].ended:
                self._tables.setdefault(key, [None, None])[side] = part[Tables]

    def scenarios(self, names: Sequence[str]) -> list[ScenarioDifference]:
        """Return the comparison of each scenario, in the order of the plan."""
        found = []
        for key, sides in sorted(self._lines.items()):
            same = self._same.get(key, set())
            both = sorted(sides[0].keys() & sides[1].keys())
            agreement, largest = _compare_tables(*self._tables.get(key, [None, None]))
            means = [_means(side) for side in sides]
            found.append(
                ScenarioDifference(
                    scenario=names[key] if key >= 0 else "all",
                    n_episodes=(len(sides[0]), len(sides[1])),
                    n_equal=len(same),
                    first=next((number for number in both if number not in same), None),
                    total_reward=(means[0][0], means[1][0]),
                    score=(means[0][1], means[1][1]),
                    n_steps=(means[0][2], means[1][2]),
                    agreement=agreement,
                    value_difference=largest,
                )
            )
        return found


def _line(part: Part) -> tuple[int, int, tuple[float, float, float]]:
    """Return scenario (-1: all), number, and return, score and steps of a part."""
    record = next(iter(part.values()))
    if isinstance(record, Episode | Played):
        score = record.score / record.score_max if record.score_max else 0.0
        return record.scenario, record.episode, (record.total_reward, score, float(record.n_steps))
    score = float(getattr(record, "score_mean", np.nan))
    return -1, part_number(record), (np.nan, score, np.nan)


def _means(side: Mapping[int, tuple[float, float, float]]) -> tuple[float, ...]:
    """Return the means over the last episodes."""
    last = [side[number] for number in sorted(side)[-LAST:]]
    return tuple(float(np.mean([line[k] for line in last])) if last else float("nan") for k in range(3))


def _compare_tables(a: Tables | None, b: Tables | None) -> tuple[float, float]:
    """Return how often two sets of tables prefer the same action where both have been, and the largest difference."""
    if a is None or b is None or (a.n_tables, a.n_states) != (b.n_tables, b.n_states):
        return float("nan"), float("nan")
    (values_a, visits_a), (values_b, visits_b) = a.arrays, b.arrays
    both = visits_a.any(axis=2) & visits_b.any(axis=2)
    same = values_a.argmax(axis=2) == values_b.argmax(axis=2)
    agreement = float(same[both].mean()) if both.any() else float("nan")
    return agreement, float(np.abs(values_a - values_b).max())


SPREAD_HEADS: Final = ("scenario", "episodes", "same", "return", "score", "greedy", "largest", "differ")
SPREAD_NOTE: Final = (
    f"A/B; return, score: means of the last {LAST} episodes; greedy: states in which the\n"
    "final tables prefer the same action, of those that both have visited; largest:\n"
    "difference of a value in them; differ: the first episode that does"
)


def spread_cells(one: ScenarioDifference) -> list[str]:
    """Return the row of a scenario under `SPREAD_HEADS`."""
    (n_a, n_b), (r_a, r_b), (s_a, s_b) = one.n_episodes, one.total_reward, one.score
    nothing = math.isnan(one.agreement)
    return [
        one.scenario,
        f"{n_a}/{n_b}" if n_a != n_b else str(n_a),
        str(one.n_equal),
        "-" if math.isnan(r_a) else f"{_short(r_a)}/{_short(r_b)}",
        f"{s_a:.2f}/{s_b:.2f}",
        "-" if nothing else f"{one.agreement:.0%}",
        "-" if nothing else f"{one.value_difference:.2g}",
        "the end" if one.first is None else f"from {one.first}",
    ]


def _short(value: float) -> str:
    """Write a number in six characters or so."""
    for scale, letter in ((1e6, "M"), (1e3, "k")):
        if abs(value) >= 10 * scale or (letter == "M" and abs(value) >= scale):
            return f"{value / scale:.3g}{letter}"
    return f"{value:.4g}"
