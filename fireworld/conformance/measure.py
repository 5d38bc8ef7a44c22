"""How far two outputs of a step are apart, and when that counts as a difference."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from fireworld.city.city import Array, Float64Array

RELATIVE_TOLERANCE: Final = 1e-9
EXACT: Final = frozenset({"fieryness", "fuel", "water", "ever_watered", "tank", "requests"})
"""Outputs that must be equal; the others may be apart by the tolerance."""


@dataclass
class Tally:
    """How one output compares over all steps so far."""

    name: str
    n_compared: int = 0
    n_differing: int = 0
    largest: float | None = None
    """Largest relative difference; None for outputs that must be equal."""

    def add(self, ours: Array, theirs: Array, *, scale: Array | float, resolution: float) -> Array:
        """Compare the values of a step and return where they differ, bool of the same shape.

        A difference is relative to the greater of the trace's value and a scale, because what is left of a building's
        heat after it was cooled all the way is rounding noise: relative to itself it means nothing.

        Args:
            ours: computed here.
            theirs: the trace's.
            scale: what counts as a small value: for energies the heat capacity, which is one degree.
            resolution: rounding of the trace's type; the tolerance is not finer than that.
        """
        if self.name in EXACT:
            with np.errstate(over="ignore"):
                differs: Array = ours != theirs.astype(ours.dtype)
        else:
            gap = relative_gap(ours, theirs, scale)
            self.largest = max(self.largest or 0.0, float(gap.max(initial=0.0)))
            differs = gap > max(RELATIVE_TOLERANCE, resolution)
        self.n_compared += differs.size
        self.n_differing += int(np.count_nonzero(differs))
        return differs


def relative_gap(ours: Array, theirs: Array, scale: Array | float) -> Float64Array:
    """Return |ours - theirs| / max(|theirs|, scale), infinite where ours is not finite."""
    with np.errstate(all="ignore"):
        gap = np.abs(ours - theirs) / np.maximum(np.abs(theirs), scale)
    return np.where(np.isfinite(gap), gap, np.inf)
