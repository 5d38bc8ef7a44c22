"""Ranking: the weights by which brigades value burning buildings, in words and as a file."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from fireworld.errors import TrainingError, expected
from fireworld.kernels.arrays import Array
from fireworld.policy.kernel import KernelPolicy, from_rankings
from fireworld.policy.npz import check_arrays, check_finite, parse_arrays, write_arrays
from fireworld.records import ACTIONS

FORMAT: Final = "fireworld-ranking/1"


class Weight(NamedTuple):
    """One thing that a brigade sees of a target and gives a weight."""

    name: str
    meaning: str
    """With the unit in which it is counted."""


OF_BUILDING: Final = (
    Weight("temperature", "temperature of the building, in 500 degrees above ambient"),
    Weight("volume", "its size: root of the volume in 1000 m3"),
    Weight("fuel_left", "share of its fuel that is left"),
    Weight("civilian_distance", "way to the nearest civilian not yet reached by fire, in 100 m, 3 at most"),
    Weight("exposure", "share of its radiation that falls on buildings that never burned, times 3"),
    Weight("kindling", "radiation on buildings that never burned, each counted by how near ignition it is, times 5"),
    Weight("steps_needed", "root of the steps that one brigade would have to spray it"),
)
OF_BRIGADE: Final = (
    Weight("in_range", "1 if the brigade can spray it from where it is"),
    Weight("beyond_range", "how far beyond its range it is, in 100 m, 3 at most"),
    Weight("mine", "1 if the brigade went for it in the last step"),
)
OF_TEAM: Final = (
    Weight("others_here", "how many other brigades go for it"),
    Weight("others_near", "other brigades' targets around it: 1 each, 1/2 at 50 m, 1/5 at 100 m"),
    Weight("enough", "1 if those that go for it put it out in this step"),
)
WEIGHTS: Final = (
    *OF_BUILDING,
    *OF_BRIGADE,
    *OF_TEAM,
    *(Weight(action, f"1 if the action {action} names it") for action in ACTIONS),
)
"""The weights of a ranking in their order; those of the actions count only where the brigades choose among actions."""


@dataclass(frozen=True)
class Ranking:
    """Weights that brigades follow, one row each (or one for all), and where they come from."""

    weights: Array  # (rows, 17) float64
    own_targets: bool
    """Brigades go for any burning building of their site, not only for the four that the paper's actions name."""
    provenance: Mapping[str, Any] = field(default_factory=dict)
    """Curriculum, method, seed, version: plain values."""

    @property
    def digest(self) -> str:
        """SHA-256 of what the brigades follow."""
        content = hashlib.sha256(repr((self.weights.shape, self.own_targets)).encode())
        content.update(np.ascontiguousarray(self.weights, dtype="<f8").tobytes())
        return content.hexdigest()

    def policy(self) -> KernelPolicy:
        """Return the policy of the team."""
        return from_rankings(self.weights, own_targets=self.own_targets)

    @property
    def choices(self) -> str:
        """The scenario's `choices` that the ranking was found with; empty if the file does not tell."""
        return ""


def save_ranking(
    ranking: Ranking, path: Path, *, force: bool = False, extra: Mapping[str, Array] | None = None
) -> None:
    """Write the team file of a ranking, beside and renamed; equal rankings give equal bytes.

    Args:
        ranking: what the brigades follow.
        path: the file to make.
        force: replace an existing file.
        extra: more arrays by name, as a checkpoint has.

    Raises:
        OutputError: the file exists, or cannot be written.
    """
    header = {
        "format": FORMAT,
        "weights": [weight.name for weight in WEIGHTS],
        "own_targets": ranking.own_targets,
        **ranking.provenance,
    }
    arrays = {"weights": np.ascontiguousarray(ranking.weights, dtype="<f8"), **(extra or {})}
    write_arrays(path, header, arrays, force=force)


def parse_ranking(content: bytes, *, source: str) -> tuple[Ranking, dict[str, Array]]:
    """Read the content of the team file of a ranking, and the arrays it holds besides.

    Args:
        content: of the file.
        source: what errors call it.

    Raises:
        TrainingError: not such a file, of another format or other weights, or with weights that make no sense.
    """
    return ranking_of(*parse_arrays(content, source=source), source=source)


def ranking_of(header: dict[str, Any], arrays: dict[str, Array], *, source: str) -> tuple[Ranking, dict[str, Array]]:
    """Make a ranking of the header and the arrays of its file, which this takes apart; as `parse_ranking`."""
    form = header.pop("format", None)
    if form != FORMAT:
        hint = "made by a later fireworld?" if isinstance(form, str) and form.startswith("fireworld-ranking/") else ""
        raise TrainingError(expected(source, "format", FORMAT, form, hint))
    names, own_targets = header.pop("weights", None), header.pop("own_targets", None)
    wanted = [weight.name for weight in WEIGHTS]
    if names != wanted:
        raise TrainingError(expected(source, "weights", ", ".join(wanted), str(names)))
    if not isinstance(own_targets, bool):
        raise TrainingError(expected(source, "own_targets", "true or false", own_targets))
    check_arrays(arrays, "weights", source=source)
    weights = arrays.pop("weights")
    if weights.ndim != 2 or not len(weights) or weights.shape[1] != len(WEIGHTS) or weights.dtype != np.float64:
        shape = f"float64 weights of shape (brigades, {len(WEIGHTS)})"
        raise TrainingError(expected(source, "weights", shape, f"{weights.dtype} {weights.shape}"))
    check_finite(weights, "weights", source=source)
    return Ranking(np.ascontiguousarray(weights), own_targets, header), arrays
