"""When a fire is contested: the limits of what rules that do not learn make of it. Loads nothing heavy."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal

from fireworld.arguments import ArgumentError
from fireworld.errors import expected

Contest = Literal["lost", "contested", "held"]

LOST_BELOW: Final = 0.12
"""Mean score of six rules, as a share of the maximum. If one of them saves all, it is 0.17: below, none does."""
HELD_ABOVE: Final = 0.6
"""The same. If four of them save all, it is 0.67: above, most do."""
N_SEEDS: Final = 10
FIRST_SEED: Final = 1000
"""Of the runs of every rule; policies are mostly compared, and trained, on others."""


@dataclass(frozen=True)
class Limits:
    """Between which mean scores of the rules, as shares of the maximum, a fire is contested."""

    lost_below: float = LOST_BELOW
    held_above: float = HELD_ABOVE

    def __post_init__(self) -> None:
        """Raise ArgumentError for limits that leave nothing between them."""
        for name, value in (("lost_below", self.lost_below), ("held_above", self.held_above)):
            if not isinstance(value, int | float) or not (math.isfinite(value) and 0 <= value <= 1):
                raise ArgumentError(expected(name, "", "a number from 0 to 1", value))
        if self.lost_below >= self.held_above:
            raise ArgumentError(
                expected("lost_below", "", f"less than held_above ({self.held_above})", self.lost_below)
            )

    def verdict(self, score: float) -> Contest:
        """Return what a fire is, of which the rules make this mean score."""
        if score < self.lost_below:
            return "lost"
        return "held" if score > self.held_above else "contested"
