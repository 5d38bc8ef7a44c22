"""What the readings come to: main effects with intervals, a permutation test, and how the readings lie about zero."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from fireworld.draws import below
from fireworld.evaluation.statistics import Interval, mean
from fireworld.kernels.arrays import Array

TRAININGS_LEAST: Final = 3
"""Trainings of a reading from which it has an interval."""
N_PERMUTATIONS: Final = 2000
_PERMUTE: Final = 1001
"""Purpose of the draws of this module."""
_STUDENT_95: Final = (12.7062, 4.30265, 3.18245, 2.77645, 2.57058)
"""Of 1, 2, 3 ... degrees of freedom."""
_NORMAL_95: Final = 1.959963984540054


@dataclass(frozen=True)
class Effect(Interval):
    """A mean, or what the other level of a choice changes in one, and how sure that is."""

    choice: str = ""

    @property
    def can_tell(self) -> bool:
        """Whether there is enough for an interval."""
        return math.isfinite(self.high)

    def text(self) -> str:
        """Return it for people: "+0.14 [-0.04, +0.31]"."""
        if not self.can_tell:
            return f"{self.mean:+z.2f} [no interval]"
        return f"{self.mean:+z.2f} [{self.low:+.2f}, {self.high:+.2f}]"


def main_effects(names: Sequence[str], signs: Array, means: Array) -> list[Effect]:
    """Estimate what each choice changes, all others balanced.

    Trainings of a reading go together: its mean is one value, so that intervals are robust to what they have in common.

    Args:
        names: of the choices.
        signs: (readings, choices), -1 ours and 1 the other level.
        means: (readings,) of each reading.
    """
    effects, half = _contrasts(signs, means), 2.0 * _half_width(signs, means)
    return [
        Effect(float(one), float(one - half), float(one + half), name) for name, one in zip(names, effects, strict=True)
    ]


def over_readings(signs: Array, means: Array) -> Effect:
    """Estimate the mean over all readings, as uncertain as main effects leave it; arguments as of `main_effects`."""
    middle, half = mean(means), _half_width(signs, means)
    return Effect(middle, middle - half, middle + half)


def over_trainings(values: Array) -> Effect:
    """Estimate a mean over the trainings of one reading, whose runs go together: a training's mean is one value.

    Two trainings say too little of how trainings differ (their t is 12.7): the ends are then infinite.

    Args:
        values: (trainings, seeds).
    """
    means = np.array([mean(row) for row in values])
    n, middle, half = len(means), mean(means), math.inf
    if n >= TRAININGS_LEAST:
        variance = math.fsum(((means - middle) ** 2).tolist()) / (n - 1)
        half = student_95(n - 1) * math.sqrt(variance / n)
    return Effect(middle, middle - half, middle + half)


def permutation_p(signs: Array, means: Array) -> float:
    """Return how often shuffled readings have main effects as large, squared and added up: "no reading matters"."""
    found, n = _sum_of_squares(_contrasts(signs, means)), len(means)
    n_as_large = 0
    for number in range(N_PERMUTATIONS):
        order = list(range(n))
        for place in range(n - 1, 0, -1):
            other = below(n, _PERMUTE, place, number, bound=place + 1)
            order[place], order[other] = order[other], order[place]
        n_as_large += _sum_of_squares(_contrasts(signs, means[order])) >= found - 1e-12
    return (1 + n_as_large) / (1 + N_PERMUTATIONS)


def student_95(freedom: int) -> float:
    """Return the two-sided 95 % quantile of Student's t: the first ones as they are, then by an expansion, to 0.1 %."""
    if freedom <= len(_STUDENT_95):
        return _STUDENT_95[freedom - 1]
    z, n = _NORMAL_95, float(freedom)
    return (
        z
        + (z**3 + z) / (4 * n)
        + (5 * z**5 + 16 * z**3 + 3 * z) / (96 * n**2)
        + (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / (384 * n**3)
    )


def _sum_of_squares(effects: Array) -> float:
    return math.fsum((effects**2).tolist())


def _contrasts(signs: Array, means: Array) -> Array:
    """Return the mean of each choice's other level minus that of ours, (choices,); the same bits on every machine."""
    off = means - mean(means)
    return np.array([math.fsum(column) for column in (signs.T * off).tolist()]) * 2.0 / len(means)


def _half_width(signs: Array, means: Array) -> float:
    """Return half the width of the interval of a mean over readings, by what main effects leave of their spread."""
    n_readings, n_choices = signs.shape
    left = n_readings - n_choices - 1
    if left <= 0:
        return math.inf
    parts = [math.fsum(row) for row in (signs * _contrasts(signs, means)).tolist()]
    fitted = mean(means) + np.array(parts) / 2.0
    spread = math.sqrt(math.fsum(((means - fitted) ** 2).tolist()) / left)
    return student_95(left) * spread / math.sqrt(n_readings)
