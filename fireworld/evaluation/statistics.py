"""Means and 95 % intervals over repetitions of a training and seeds of a test: the same numbers on every machine.

A team that learned differs from repetition to repetition, and a run from seed to seed. Both are drawn anew in every
resample of the bootstrap, repetitions and seeds apart from each other, because all repetitions have the same seeds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache, reduce
from operator import add
from typing import Final

import numpy as np

from fireworld.draws import below
from fireworld.kernels.arrays import Array

N_RESAMPLES: Final = 2000
_TAIL: Final = N_RESAMPLES // 40  # 2.5 % of the resamples lie below the interval, and as many above
_RESAMPLE: Final = 1000
"""Purpose of the draws of this module; a run's own are numbered in fireworld.draws."""
_REPETITIONS: Final = 0
_SEEDS: Final = 1


@dataclass(frozen=True)
class Interval:
    """A mean, and how sure it is."""

    mean: float
    low: float  # lower end of the 95 % interval
    high: float  # upper end of the 95 % interval

    @property
    def above_zero(self) -> bool:
        """Whether the whole interval lies above zero."""
        return self.low > 0.0

    @property
    def below_zero(self) -> bool:
        """Whether the whole interval lies below zero."""
        return self.high < 0.0


@dataclass(frozen=True)
class Estimate(Interval):
    """A mean over repetitions and seeds, and how sure it is."""

    interquartile_mean: float  # mean of the middle half of all values: what a typical run comes to
    n_repetitions: int
    n_seeds: int

    def text(self, *, digits: int = 2, sign: bool = False) -> str:
        """Return the mean and its interval for people: "0.52 [0.41, 0.63]"."""
        form = f"{'+' if sign else ''}.{digits}f"
        return f"{self.mean:{form}} [{self.low:{form}}, {self.high:{form}}]"

    def ends(self) -> dict[str, float]:
        """Return the mean and the ends of its interval by name."""
        return {"mean": self.mean, "low": self.low, "high": self.high}


def estimate(values: Array) -> Estimate:
    """Estimate a mean and its 95 % interval by a two-level bootstrap.

    Values are (repetitions, seeds), a column for the runs of one seed; (1, seeds) for what does not learn.
    """
    return estimate_over([values])


def estimate_over(tables: Sequence[Array]) -> Estimate:
    """Estimate the mean of the means of tables, each of which counts the same, as `estimate` does of one.

    Tables of one shape are resampled alike: what is in one row, or under one seed, stays together.
    """
    found = [np.asarray(values, dtype=np.float64) for values in tables]
    means = np.sort(reduce(add, map(_resampled_means, found)) / len(found))
    middle = math.fsum(map(mean, found)) / len(found)
    return Estimate(
        mean=middle,
        low=min(float(means[_TAIL]), middle),  # equal values have an interval of no width: rounding must not shift it
        high=max(float(means[-1 - _TAIL]), middle),
        interquartile_mean=interquartile_mean(np.concatenate([table.ravel() for table in found])),
        n_repetitions=max(table.shape[0] for table in found),
        n_seeds=min(table.shape[1] for table in found),
    )


def _resampled_means(table: Array) -> Array:
    """Return the mean of every resample of (repetitions, seeds): (N_RESAMPLES,)."""
    n_repetitions, n_seeds = table.shape
    rows, columns = _resampled(n_repetitions, _REPETITIONS), _resampled(n_seeds, _SEEDS)
    total = np.zeros(N_RESAMPLES)
    for row in rows:  # one after another, so that every machine adds in the same order
        for column in columns:
            total += table[row, column]
    return total / table.size


def mean(values: Array) -> float:
    """Return the mean of all values, rounded once."""
    return math.fsum(values.ravel().tolist()) / values.size


def interquartile_mean(values: Array) -> float:
    """Return the mean of all values but the lowest and the highest quarter (rounded down)."""
    ordered = np.sort(values, axis=None)
    cut = len(ordered) // 4
    return mean(ordered[cut : len(ordered) - cut])


def paired_difference(values: Array, others: Array) -> Estimate:
    """Estimate the mean of values - others, (repetitions, seeds) each or (1, seeds), run by run on the same seeds."""
    return estimate(np.asarray(values, dtype=np.float64) - np.asarray(others, dtype=np.float64))


def probability_of_improvement(values: Array, others: Array) -> Estimate:
    """Estimate how probable it is that a run is better than its pair; a tie counts as half. Shapes as above."""
    better, equal = np.greater(values, others), np.equal(values, others)
    return estimate(np.where(better, 1.0, np.where(equal, 0.5, 0.0)))


@lru_cache(maxsize=64)
def _resampled(n: int, level: int) -> Array:
    """Draw n of n with replacement for every resample: (n, N_RESAMPLES)."""
    drawn = [
        [below(n, _RESAMPLE, level, place * N_RESAMPLES + k, bound=n) for k in range(N_RESAMPLES)] for place in range(n)
    ]
    return np.array(drawn, dtype=np.intp)
