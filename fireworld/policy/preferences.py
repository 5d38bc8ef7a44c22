"""What a ranking prefers, in words; where two rankings differ."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from fireworld.errors import TrainingError, expected
from fireworld.policy.ranking import OF_BRIGADE, OF_BUILDING, OF_TEAM, WEIGHTS, Ranking, Weight
from fireworld.records import ACTIONS

WORDS: Final = {
    "temperature": ("prefers hotter buildings", "prefers cooler buildings"),
    "volume": ("prefers larger buildings", "prefers smaller buildings"),
    "fuel_left": ("prefers what has much fuel left", "prefers what has little fuel left"),
    "civilian_distance": ("prefers what is far from civilians", "prefers what is close to civilians"),
    "exposure": ("goes for what endangers unburnt buildings", "leaves what endangers unburnt buildings"),
    "kindling": ("goes for what is about to kindle others", "leaves what is about to kindle others"),
    "steps_needed": ("prefers what takes long to put out", "prefers what is soon put out"),
    "in_range": ("prefers what it can spray at once", "prefers what it has to drive to"),
    "beyond_range": ("prefers a long way", "avoids a long way"),
    "mine": ("stays with its target", "changes its target"),
    "others_here": ("joins those who go for the same", "avoids what others go for"),
    "others_near": ("stays near what others go for", "keeps away from what others go for"),
    "enough": ("goes along where the others are enough", "leaves what the others put out anyway"),
    **{action: (f"prefers what {action} names", f"avoids what {action} names") for action in ACTIONS},
}
"""What a weight above 0 comes to, and one below."""
STRENGTHS: Final = (("above all", 0.5), ("also", 0.2), ("a little", 0.05))
"""Words for the size of a weight, and the least share of the largest weight for which they are used."""


@dataclass(frozen=True)
class Preference:
    """What one weight of a brigade comes to."""

    weight: Weight
    value: float
    strength: str
    """One of STRENGTHS; empty if it hardly counts."""

    @property
    def words(self) -> str:
        """What the brigade does because of it."""
        return WORDS[self.weight.name][self.value < 0]


def counted(ranking: Ranking) -> Sequence[Weight]:
    """Return the weights that count: without those of the actions, where brigades name targets of their own."""
    return (*OF_BUILDING, *OF_BRIGADE, *OF_TEAM) if ranking.own_targets else WEIGHTS


def by_size(ranking: Ranking) -> list[Weight]:
    """Return the weights that count, the largest of any brigade first."""
    place = {weight.name: k for k, weight in enumerate(WEIGHTS)}
    return sorted(counted(ranking), key=lambda weight: -abs(ranking.weights[:, place[weight.name]]).max())


def preferences(ranking: Ranking, *, row: int) -> list[Preference]:
    """Return what the brigades that follow a row prefer, the largest weight first; weights of 0 are left out."""
    values = dict(zip((weight.name for weight in WEIGHTS), ranking.weights[row].tolist(), strict=True))
    chosen = sorted(counted(ranking), key=lambda weight: -abs(values[weight.name]))
    largest = abs(values[chosen[0].name])
    found = []
    for weight in chosen:
        value = values[weight.name]
        if value != 0.0:
            strength = next((word for word, share in STRENGTHS if abs(value) >= share * largest), "")
            found.append(Preference(weight, value, strength))
    return found


def sentences(ranking: Ranking, *, row: int) -> Iterator[str]:
    """Say what the brigades that follow a row do, a sentence for each strength."""
    found = preferences(ranking, row=row)
    if not found:
        yield "all weights are 0: every target is worth the same, and the first one is taken"
    for strength, _ in STRENGTHS:
        words = [preference.words for preference in found if preference.strength == strength]
        if words:
            yield f"{strength}: {', '.join(words)}"


@dataclass(frozen=True)
class WeightChange:
    """A weight that differs."""

    row: int
    name: str
    a: float
    b: float


@dataclass(frozen=True)
class RankingDifference:
    """Where two rankings differ."""

    n_rows: int
    changed: tuple[WeightChange, ...]
    """Row by row, in each the largest change first."""
    own_targets: tuple[bool, bool]

    @property
    def same(self) -> bool:
        """Whether the brigades of both do the same."""
        return not self.changed and self.own_targets[0] == self.own_targets[1]


def compare_rankings(a: Ranking, b: Ranking) -> RankingDifference:
    """Compare two rankings, weight by weight.

    Raises:
        TrainingError: they have another number of rows.
    """
    if len(a.weights) != len(b.weights):
        wanted = f"as many rows as in A, {len(a.weights)}"
        raise TrainingError(expected("B", "weights", wanted, f"{len(b.weights)} of them"))
    changed = []
    for row, (of_a, of_b) in enumerate(zip(a.weights.tolist(), b.weights.tolist(), strict=True)):
        found = [
            WeightChange(row, weight.name, was, is_now)
            for weight, was, is_now in zip(WEIGHTS, of_a, of_b, strict=True)
            if was != is_now
        ]
        changed += sorted(found, key=lambda change: -abs(change.b - change.a))
    return RankingDifference(len(a.weights), tuple(changed), (a.own_targets, b.own_targets))
