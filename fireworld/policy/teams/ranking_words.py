"""What the weights of a ranking mean and come to, in words; where two rankings differ."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Final, NamedTuple

from fireworld.policy.teams.team import TeamDifference
from fireworld.records import ACTIONS
from fireworld.shown import SHOWN_MAX, Block, TextTable, more

HINT: Final = "a weight counts by its size and by how much what it weighs differs from target to target; mind the units"


class Weight(NamedTuple):
    """One thing that a brigade sees of a target and gives a weight."""

    name: str
    meaning: str
    """With the unit in which it is counted."""
    above: str
    """What a weight above 0 comes to."""
    below: str
    """What a weight below 0 comes to."""


def _of(group: str) -> tuple[Weight, ...]:
    """Return the weights of a group; they are in a table beside this module, a line each."""
    text = Path(__file__).with_name("weights.txt").read_text(encoding="utf-8")
    table = [line.split(" | ") for line in text.splitlines()]
    return tuple(Weight(*words) for name, *words in table if name == group)


OF_BUILDING: Final = _of("building")
OF_BRIGADE: Final = _of("brigade")
OF_TEAM: Final = _of("team")
AROUND: Final = _of("around")
"""What only networks may read."""
OF_ACTION: Final = tuple(
    Weight(action, f"1 if the action {action} names it", f"prefers what {action} names", f"avoids what {action} names")
    for action in ACTIONS
)
WEIGHTS: Final = (*OF_BUILDING, *OF_BRIGADE, *OF_TEAM, *OF_ACTION)
"""The weights of a ranking in their order; those of the actions count only where the brigades choose among actions."""
N_TARGET_WEIGHTS: Final = len(WEIGHTS) - len(OF_ACTION)

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
        return self.weight.above if self.value > 0 else self.weight.below

    def as_dict(self) -> dict[str, Any]:
        """Return the preference as plain values."""
        return {"weight": self.weight.name, "strength": self.strength, "words": self.words}


def targets_in_words(*, own_targets: bool, assigned: bool = False) -> str:
    """Return among what a ranking chooses, and how."""
    if assigned:
        return "all burning buildings of the fire site, to which brigades are assigned together"
    return "all burning buildings of the fire site" if own_targets else "the targets of the paper's four actions"


class WeightChange(NamedTuple):
    """A weight that differs."""

    row: int
    name: str
    a: float
    b: float


@dataclass(frozen=True)
class RankingDifference(TeamDifference):
    """Where two rankings differ."""

    what: ClassVar[str] = "two rankings"

    n_rows: int
    changed: tuple[WeightChange, ...]
    """Row by row, in each the largest change first."""
    own_targets: tuple[bool, bool]
    assigned: tuple[bool, bool]

    @property
    def same(self) -> bool:
        """Whether the brigades of both do the same."""
        return not self.changed and all(one == other for one, other in (self.own_targets, self.assigned))

    def describe(self, *, limit: int = SHOWN_MAX) -> Iterator[Block]:
        """Yield which weights differ."""
        if self.same:
            yield f"the same: {self.n_rows} row{'s' if self.n_rows > 1 else ''} of weights"
            return
        a, b = (
            targets_in_words(own_targets=own, assigned=assigned)
            for own, assigned in zip(self.own_targets, self.assigned, strict=True)
        )
        if a != b:
            yield f"A ranks {a}, B {b}"
        n = len(self.changed)
        yield f"{n} weight{'' if n == 1 else 's'} differ{'s' if n == 1 else ''}"
        if not n:
            return
        whose = ["of"] if self.n_rows > 1 else []
        rows = [
            [
                one.name,
                *([f"brigade {one.row}"] if whose else []),
                *(f"{value:+.6g}" for value in (one.a, one.b, one.b - one.a)),
            ]
            for one in self.changed[:limit]
        ]
        yield ""
        yield TextTable(["weight", *whose, "A", "B", "B - A"], rows, n_left=1 + len(whose))
        yield from more(n, limit)

    def as_dict(self, *, limit: int = SHOWN_MAX) -> dict[str, Any]:
        """Return what differs as plain values."""
        return {
            "n_rows": self.n_rows,
            "n_changed": len(self.changed),
            "own_targets": list(self.own_targets),
            "assigned": list(self.assigned),
            "changed": [{"row": one.row, "weight": one.name, "a": one.a, "b": one.b} for one in self.changed[:limit]],
        }
