"""Where two networks differ, in words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import Any, ClassVar, NamedTuple

import numpy as np

from fireworld.policy.teams.network_layers import Layer
from fireworld.policy.teams.ranking_words import targets_in_words
from fireworld.policy.teams.team import TeamDifference
from fireworld.shown import SHOWN_MAX, Block, TextTable


class LayerChange(NamedTuple):
    """A layer that differs."""

    layer: int
    shape_a: str
    """Inputs and outputs, as in 13-64; empty where there is no such layer."""
    shape_b: str
    n_changed: int | None
    """Weights and biases that differ; None where the shapes do."""
    largest: float | None
    """The largest of these changes."""


@dataclass(frozen=True)
class NetworkDifference(TeamDifference):
    """Where two networks differ."""

    what: ClassVar[str] = "two networks"

    headers: tuple[Mapping[str, Any], Mapping[str, Any]]
    """Of A and B: what they read, what comes between their layers, what they value."""
    changed: tuple[LayerChange, ...]
    n_layers: int
    """Of the deeper one."""

    @classmethod
    def of(
        cls, headers: tuple[Mapping[str, Any], Mapping[str, Any]], a: Sequence[Layer], b: Sequence[Layer]
    ) -> NetworkDifference:
        """Compare the layers of B with those of A."""
        pairs = enumerate(zip_longest(a, b))
        found = [change for k, (of_a, of_b) in pairs if (change := _change(k, of_a, of_b)) is not None]
        return cls(headers, tuple(found), max(len(a), len(b)))

    @property
    def same(self) -> bool:
        """Whether the brigades of both do the same."""
        return not self.changed and self.headers[0] == self.headers[1]

    def describe(self, *, limit: int = SHOWN_MAX) -> Iterator[Block]:
        """Yield what differs."""
        del limit
        if self.same:
            yield f"the same: {self.n_layers} layer{'s' if self.n_layers > 1 else ''}"
            return
        a, b = self.headers
        if a["own_targets"] != b["own_targets"]:
            in_words = [targets_in_words(own_targets=one["own_targets"]) for one in self.headers]
            yield f"A values {in_words[0]}, B {in_words[1]}"
        for key in ("features", "activations"):
            if a[key] != b[key]:
                yield f"{key}: {', '.join(a[key]) or 'none'}; in B {', '.join(b[key]) or 'none'}"
        n = len(self.changed)
        yield f"{n} layer{'' if n == 1 else 's'} differ{'s' if n == 1 else ''}"
        if n:
            rows = [
                [str(one.layer), one.shape_a or "-", one.shape_b or "-", _written(one.n_changed), _written(one.largest)]
                for one in self.changed
            ]
            yield ""
            yield TextTable(["layer", "A", "B", "numbers that differ", "by at most"], rows)

    def as_dict(self, *, limit: int = SHOWN_MAX) -> dict[str, Any]:
        """Return what differs as plain values."""
        del limit
        a, b = self.headers
        return {
            **{key: [a[key], b[key]] for key in a},
            "n_layers": self.n_layers,
            "changed": [one._asdict() for one in self.changed],
        }


def _change(k: int, a: Layer | None, b: Layer | None) -> LayerChange | None:
    """Return how a layer differs, None if it does not; a network that is less deep has none."""
    of_a, of_b = ("" if one is None else "-".join(map(str, one.weights.shape)) for one in (a, b))
    if a is None or b is None or a.weights.shape != b.weights.shape:
        return LayerChange(k, of_a, of_b, None, None)
    apart = [np.abs(new - old) for old, new in zip(a, b, strict=True)]
    n_changed = sum(int((one > 0).sum()) for one in apart)
    return LayerChange(k, of_a, of_b, n_changed, max(float(one.max()) for one in apart)) if n_changed else None


def _written(number: float | None) -> str:
    return "-" if number is None else f"{number:.6g}"
