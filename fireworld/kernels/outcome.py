"""What a step was worth: the team's reward by terms and both scores."""

from __future__ import annotations

import numpy as np

from fireworld import rewards, scores
from fireworld.kernels.arrays import SUM_SO_FAR, TOTAL, CivilianState, FireState, GeometryArrays, Outcome
from fireworld.kernels.jit import inner, kernel
from fireworld.rewards import Reward, Tally

amounts, rewarded = inner(rewards.amounts), inner(rewards.rewarded)

exp_of_minus, unhealth, paper_score = inner(scores.exp_of_minus), inner(scores.unhealth), inner(scores.paper_score)

SAVED = np.array(scores.SAVED)
"""Part of a building that counts as saved, by fieryness code."""


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
    score[0] = paper_score(n_alive, healthy, saved, area)
    score[1] = len(civilians.hp) + 1.0
    score[2] = n_alive * exp_of_minus(unhealth(healthy))
    amount = amounts(Tally(n_burning, n_water_damaged, n_burnt_out, n_alive, hp, full_hp))
    total = 0.0
    for term in range(TOTAL):
        stock = reward.weights[term] * amount[term]
        outcome.reward[term] = rewarded(reward.kind, stock, outcome.stock[term])
        outcome.stock[term] = stock
        total += outcome.reward[term]
    outcome.reward[TOTAL] = total
    outcome.reward[SUM_SO_FAR] += total
