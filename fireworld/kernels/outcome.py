"""What a step was worth: the team's reward by terms and both scores."""

from __future__ import annotations

import numpy as np

from fireworld import rewards
from fireworld.kernels.arrays import SUM_SO_FAR, TOTAL, CivilianState, FireState, GeometryArrays, Outcome
from fireworld.kernels.jit import inner, kernel
from fireworld.rewards import Reward, Tally

amounts, rewarded = inner(rewards.amounts), inner(rewards.rewarded)

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
    fire: FireState, civilians: CivilianState, geometry: GeometryArrays, reward: Reward, outcome: Outcome
) -> None:
    """Write the counts, the scores and the reward of the moment; MODEL 6.

    score: (alive + HP / full HP) * sqrt(floor area saved / floor area). reward: see `fireworld.rewards`.
    """
    n_burning, n_water_damaged, n_burnt_out = 0, 0, 0
    saved, area = 0.0, 0.0
    for b in range(len(fire.fieryness)):
        code = fire.fieryness[b]
        if 1 <= code <= 3:
            n_burning += 1
        elif code == 8:
            n_burnt_out += 1
        elif code >= 4:
            n_water_damaged += 1
        saved += geometry.floor_area[b] * SAVED[code]
        area += geometry.floor_area[b]
    n_alive, hp, full_hp = 0, 0, 0
    for civilian in range(len(civilians.hp)):
        hp += civilians.hp[civilian]
        full_hp += civilians.full_hp[civilian]
        if civilians.hp[civilian] > 0:
            n_alive += 1
    counts, score = outcome.counts, outcome.score
    counts[0], counts[1], counts[2], counts[3] = n_burning, n_water_damaged, n_burnt_out, n_alive
    healthy = hp / full_hp if full_hp > 0 else 1.0
    score[0] = (n_alive + healthy) * np.sqrt(saved / area)
    score[1] = len(civilians.hp) + 1.0
    score[2] = n_alive * exp_of_minus(5.0 * (1.0 - healthy))
    amount = amounts(Tally(n_burning, n_water_damaged, n_burnt_out, n_alive, hp, full_hp))
    total = 0.0
    for term in range(TOTAL):
        stock = reward.weights[term] * amount[term]
        outcome.reward[term] = rewarded(reward.kind, stock, outcome.stock[term])
        outcome.stock[term] = stock
        total += outcome.reward[term]
    outcome.reward[TOTAL] = total
    outcome.reward[SUM_SO_FAR] += total
