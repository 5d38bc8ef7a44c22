"""What the readings come to: main effects with intervals, a permutation test, and how the readings lie about zero."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from fireworld.draws import below
from fireworld.kernels.arrays import Array

N_PERMUTATIONS: Final = 2000
_PERMUTE: Final = 1001
"""Purpose of the draws of this module."""
_NORMAL_95: Final = 1.959963984540054


@dataclass(frozen=True)
class Effect:
    """What the other level of a choice changes in a mean."""

    choice: str
    mean: float
    low: float  # of the 95 % interval
    high: float

    def text(self) -> str:
        """Return it for people: "+0.14 [-0.04, +0.31]"."""
        return f"{self.mean:+.2f} [{self.low:+.2f}, {self.high:+.2f}]"


def main_effects(names: Sequence[str], signs: Array, means: Array) -> list[Effect]:
    """Estimate what each choice changes, all others balanced.

    Trainings of a reading go together: its mean is one value, so that intervals are robust to what they have in common.

    Args:
        names: of the choices.
        signs: (readings, choices), -1 ours and 1 the other level.
        means: (readings,) of each reading.
    """
    n_readings, n_choices = signs.shape
    effects = _contrasts(signs, means)
    fitted = means.mean() + signs @ effects / 2.0
    left = n_readings - n_choices - 1
    spread = math.sqrt(math.fsum(((means - fitted) ** 2).tolist()) / left) if left > 0 else math.inf
    half = student_95(left) * 2.0 * spread / math.sqrt(n_readings) if left > 0 else math.inf
    return [
        Effect(name, float(one), float(one - half), float(one + half)) for name, one in zip(names, effects, strict=True)
    ]


def permutation_p(signs: Array, means: Array) -> float:
    """Return how often shuffled readings have main effects as large, squared and added up: "no reading matters"."""
    found, n = float((_contrasts(signs, means) ** 2).sum()), len(means)
    n_as_large = 0
    for number in range(N_PERMUTATIONS):
        order = list(range(n))
        for place in range(n - 1, 0, -1):
            other = below(n, _PERMUTE, place, number, bound=place + 1)
            order[place], order[other] = order[other], order[place]
        n_as_large += float((_contrasts(signs, means[order]) ** 2).sum()) >= found - 1e-12
    return (1 + n_as_large) / (1 + N_PERMUTATIONS)


def student_95(freedom: int) -> float:
    """Return the two-sided 95 % quantile of Student's t, by its expansion about the normal; to 1 % from 3 on."""
    z, n = _NORMAL_95, float(freedom)
    return (
        z
        + (z**3 + z) / (4 * n)
        + (5 * z**5 + 16 * z**3 + 3 * z) / (96 * n**2)
        + (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / (384 * n**3)
    )


def _contrasts(signs: Array, means: Array) -> Array:
    """Return the mean of each choice's other level minus that of ours, (choices,)."""
    found: Array = signs.T @ (means - means.mean()) * 2.0 / len(means)
    return found
