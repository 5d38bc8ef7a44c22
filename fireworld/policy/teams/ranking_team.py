"""Teams with a ranking: the weights by which brigades value burning buildings."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Self

import numpy as np

from fireworld.errors import TrainingError, expected
from fireworld.kernels.arrays import Array
from fireworld.policy.kernel import KernelPolicy, from_assignment, from_rankings
from fireworld.policy.teams.npz import check_arrays, check_finite
from fireworld.policy.teams.ranking_words import (
    HINT,
    N_TARGET_WEIGHTS,
    STRENGTHS,
    WEIGHTS,
    Preference,
    RankingDifference,
    Weight,
    WeightChange,
    targets_in_words,
)
from fireworld.policy.teams.team import Team, no_states
from fireworld.shown import SHOWN_MAX, Block, TextTable


@dataclass(frozen=True, eq=False, repr=False)
class RankingTeam(Team):
    """Weights that brigades follow, one row each (or one for all), and where they come from."""

    kind: ClassVar[str] = "ranking"
    what: ClassVar[str] = "a ranking of targets"

    weights: Array  # (rows, 17) float64
    own_targets: bool
    """Brigades go for any burning building of their site, not only for the four that the paper's actions name."""
    provenance: Mapping[str, Any] = field(default_factory=dict)
    """Curriculum, method, seed, version: plain values."""
    assigned: bool = False
    """Brigades are assigned to own targets together, so that the sum of values is highest; all follow one row."""

    @property
    def digest(self) -> str:
        """SHA-256 of what the brigades follow."""
        kind = repr((self.weights.shape, self.own_targets, *(["assigned"] if self.assigned else []))).encode()
        return hashlib.sha256(kind + self.arrays()["weights"].tobytes()).hexdigest()

    @property
    def summary(self) -> str:
        """What is ranked."""
        own = "own targets, to which brigades are assigned together" if self.assigned else "own targets"
        return "a ranking of " + (own if self.own_targets else "the paper's actions")

    @property
    def counted(self) -> Sequence[Weight]:
        """The weights that count: without those of the actions, where brigades name targets of their own."""
        return WEIGHTS[:N_TARGET_WEIGHTS] if self.own_targets else WEIGHTS

    @property
    def by_size(self) -> list[tuple[Weight, list[float]]]:
        """The weights that count and their values in every row, the largest of any brigade first."""
        pairs = zip(self.counted, self.weights.T.tolist(), strict=False)
        return sorted(pairs, key=lambda pair: -max(map(abs, pair[1])))

    def policy(self) -> KernelPolicy:
        """Return the policy of the team."""
        if self.assigned:
            return from_assignment(self.weights[0])
        return from_rankings(self.weights, own_targets=self.own_targets)

    def arrays(self) -> dict[str, Array]:
        """Return the weights."""
        return {"weights": np.ascontiguousarray(self.weights, dtype="<f8")}

    def header(self) -> dict[str, Any]:
        """Return the names of the weights, and what is ranked."""
        assigned = {"assigned": True} if self.assigned else {}
        return {"weights": [weight.name for weight in WEIGHTS], "own_targets": self.own_targets, **assigned}

    @classmethod
    def from_file(
        cls, header: dict[str, Any], arrays: dict[str, Array], *, provenance: Mapping[str, Any], source: str
    ) -> Self:
        """Make a team of what its file holds; see `Team.from_file`."""
        names, own_targets = header.pop("weights", None), header.pop("own_targets", None)
        wanted = [weight.name for weight in WEIGHTS]
        if names != wanted:
            raise TrainingError(expected(source, "weights", ", ".join(wanted), str(names)))
        if not isinstance(own_targets, bool):
            raise TrainingError(expected(source, "own_targets", "true or false", own_targets))
        assigned = header.pop("assigned", False)
        if not isinstance(assigned, bool) or (assigned and not own_targets):
            kept = "true or false, and true only with own_targets"
            raise TrainingError(expected(source, "assigned", kept, assigned))
        check_arrays(arrays, "weights", source=source)
        weights = arrays.pop("weights")
        if weights.ndim != 2 or not len(weights) or weights.shape[1] != len(WEIGHTS) or weights.dtype != np.float64:
            shape = f"float64 weights of shape (brigades, {len(WEIGHTS)})"
            raise TrainingError(expected(source, "weights", shape, f"{weights.dtype} {weights.shape}"))
        if assigned and len(weights) != 1:
            raise TrainingError(expected(source, "weights", "one row, which all follow", f"{len(weights)} rows"))
        check_finite(weights, "weights", source=source)
        return cls(np.ascontiguousarray(weights), own_targets, provenance, assigned)

    def preferences(self, *, row: int) -> list[Preference]:
        """Return what the brigades that follow a row prefer, the largest weight first; weights of 0 are left out."""
        chosen = sorted(zip(self.counted, self.weights[row].tolist(), strict=False), key=lambda pair: -abs(pair[1]))
        largest = abs(chosen[0][1])
        found = []
        for weight, value in chosen:
            if value != 0.0:
                strength = next((word for word, share in STRENGTHS if abs(value) >= share * largest), "")
                found.append(Preference(weight, value, strength))
        return found

    def sentences(self, *, row: int) -> Iterator[str]:
        """Yield what the brigades that follow a row do, a sentence for each strength."""
        found = self.preferences(row=row)
        if not found:
            yield "all weights are 0: every target is worth the same, and the first one is taken"
        for strength, _ in STRENGTHS:
            words = [preference.words for preference in found if preference.strength == strength]
            if words:
                yield f"{strength}: {', '.join(words)}"

    def difference(self, other: Self) -> RankingDifference:
        """Compare the weights of another team with these; TrainingError if it has another number of rows."""
        if len(self.weights) != len(other.weights):
            wanted = f"as many rows as in A, {len(self.weights)}"
            raise TrainingError(expected("B", "weights", wanted, f"{len(other.weights)} of them"))
        changed: list[WeightChange] = []
        for row, (of_a, of_b) in enumerate(zip(self.weights.tolist(), other.weights.tolist(), strict=True)):
            found = [
                WeightChange(row, weight.name, a, b) for weight, a, b in zip(WEIGHTS, of_a, of_b, strict=True) if a != b
            ]
            changed += sorted(found, key=lambda change: -abs(change.b - change.a))
        return RankingDifference(
            len(self.weights), tuple(changed), (self.own_targets, other.own_targets), (self.assigned, other.assigned)
        )

    def describe(self, *, states: Sequence[str] = (), limit: int = SHOWN_MAX) -> Iterator[Block]:
        """Yield the weights, and what they come to in words."""
        del limit
        no_states(self.what, states)
        n = len(self.weights)
        whose = (
            "one row of weights for all brigades" if n == 1 else f"{n} rows of weights, one for each brigade in turn"
        )
        yield f"a ranking of {targets_in_words(own_targets=self.own_targets, assigned=self.assigned)}, {whose}"
        yield from (*self.origin, f"digest {self.digest}", "")
        columns = ["value"] if n == 1 else [f"brigade {row}" for row in range(n)]
        rows = [
            [weight.name, weight.meaning, *(f"{value:+.3f}" if value else "0" for value in values)]
            for weight, values in self.by_size
        ]
        yield TextTable(["weight", "of what", *columns], rows, n_left=2)
        yield from ("", HINT)
        for row in range(n):
            yield from ("", *([f"brigade {row}"] if n > 1 else []), *self.sentences(row=row))

    def as_dict(self, *, states: Sequence[str] = (), limit: int = SHOWN_MAX) -> dict[str, Any]:
        """Return what `describe` shows as plain values."""
        del limit
        no_states(self.what, states)
        idle = [*zip(WEIGHTS, self.weights.T.tolist(), strict=True)][len(self.counted) :]
        return {
            "digest": self.digest,
            "own_targets": self.own_targets,
            "assigned": self.assigned,
            "n_rows": len(self.weights),
            "provenance": self.short_provenance,
            "weights": [
                {"name": weight.name, "meaning": weight.meaning, "counts": weight in self.counted, "values": values}
                for weight, values in (*self.by_size, *idle)
            ],
            "preferences": [[one.as_dict() for one in self.preferences(row=row)] for row in range(len(self.weights))],
        }
