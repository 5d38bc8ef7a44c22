"""What a step was worth: the team's reward by terms and both scores."""

from __future__ import annotations

import numpy as np

from fireworld.kernels.arrays import CivilianState, FireState, GeometryArrays, Outcome
from fireworld.kernels.jit import inner, kernel

SAVED = np.array([1.0, 0.66, 0.33, 0.0, 0.9, 0.75, 0.5, 0.25, 0.0])
"""Part of a building that counts as saved, by fieryness code."""


@inner
def exp_of_minus(x: float) -> float:
    """Return exp(-x) for 0 <= x <= 8, to 3e-14 of it, from + - * / alone: libraries' exp differ between processors.

    exp(-x) = (exp(-x/64))^64, the inner one as its power series.
    """
    small = x / 64.0
    term, total = 1.0, 1.0
    for k in range(1, 14):
        term = -term * small / k
        total += term
    for _ in range(6):
        total *= total
    return total


@kernel
def assess(
    fire: FireState, civilians: CivilianState, geometry: GeometryArrays, reward_change: bool, outcome: Outcome
) -> None:
    """Write the reward and the scores of the moment; MODEL 6.

    reward: -1 a building with codes 4-7, -2 a burning one, -3 a burnt-out one, HP - full HP of every civilian.
    score: (alive + HP / full HP) * sqrt(floor area saved / floor area).
    """
    counts = outcome.counts
    for k in range(4):
        counts[k] = 0
    saved, area = 0.0, 0.0
    for b in range(len(fire.fieryness)):
        code = fire.fieryness[b]
        if 1 <= code <= 3:
            counts[0] += 1
        elif code == 8:
            counts[2] += 1
        elif code >= 4:
            counts[1] += 1
        saved += geometry.floor_area[b] * SAVED[code]
        area += geometry.floor_area[b]
    hp, full = 0, 0
    for civilian in range(len(civilians.hp)):
        hp += civilians.hp[civilian]
        full += civilians.full_hp[civilian]
        if civilians.hp[civilian] > 0:
            counts[3] += 1
    healthy = hp / full if full > 0 else 1.0
    outcome.score[0] = (counts[3] + healthy) * np.sqrt(saved / area)
    outcome.score[1] = len(civilians.hp) + 1.0
    outcome.score[2] = counts[3] * exp_of_minus(5.0 * (1.0 - healthy))
    stock = (-1.0 * counts[1], -2.0 * counts[0], -3.0 * counts[2], float(hp - full))
    total = 0.0
    for term in range(4):
        outcome.reward[term] = stock[term] - outcome.stock[term] if reward_change else stock[term]
        outcome.stock[term] = stock[term]
        total += outcome.reward[term]
    outcome.reward[4] = total
    outcome.reward[5] += total
