"""The official scores: how much counts as saved, and the two rules, for kernels and for imported logs."""

from __future__ import annotations

import math
from typing import Final

SAVED: Final = (1.0, 0.66, 0.33, 0.0, 0.9, 0.75, 0.5, 0.25, 0.0)
"""Part of a building that counts as saved, by fieryness code."""


def paper_score(n_alive: int, healthy: float, saved: float, area: float) -> float:
    """Return the official score of the paper's time; compiled by `fireworld.kernels.outcome`.

    Args:
        n_alive: living civilians.
        healthy: HP by full HP of all civilians together, 1 without civilians.
        saved: floor area that counts as saved.
        area: all floor area.
    """
    return (n_alive + healthy) * math.sqrt(saved / area)


def exp_of_minus(x: float) -> float:
    """Return exp(-x) for 0 <= x <= 8, to 3e-14 of it, from + - * / alone: libraries' exp differ between processors.

    exp(-x) = (exp(-x/64))^64, the inner one as its power series. Compiled by `fireworld.kernels.outcome`.
    """
    small = x / 64.0
    term, total = 1.0, 1.0
    for k in range(1, 14):
        term = -term * small / k
        total += term
    for _ in range(6):
        total *= total
    return total


def unhealth(healthy: float) -> float:
    """Return what today's score takes exp of, negative: living civilians x exp(-unhealth) is that score."""
    return 5.0 * (1.0 - healthy)
