"""What a step was worth: the team's reward by terms and both scores."""

from __future__ import annotations

import numpy as np

from fireworld import rewards, scores
from fireworld.kernels.arrays import SUM_SO_FAR, TOTAL, Array, CivilianState, FireState, GeometryArrays, Outcome
from fireworld.kernels.jit import inner, kernel
from fireworld.kernels.warmth import count_codes
from fireworld.rewards import Reward, Tally

amounts, rewarded = inner(rewards.amounts), inner(rewards.rewarded)

exp_of_minus, unhealth, paper_score = inner(scores.exp_of_minus), inner(scores.unhealth), inner(scores.paper_score)

SAVED = np.array(scores.SAVED)
"""Part of a building that counts as saved, by fieryness code."""


@inner
def count_living(hp: Array) -> int:
    """Return how many people are alive; (p,) health points."""
    n_alive = 0
    for person in range(len(hp)):
        n_alive += hp[person] > 0
    return n_alive


@inner
def sum_health(hp: Array) -> int:
    """Return the sum of health points, (p,) int32."""
    total = 0
    for person in range(len(hp)):
        total += hp[person]
    return total


@inner
def reward_step(n_of_code: Array, civilians: CivilianState, reward: Reward, outcome: Outcome) -> None:
    """Write the counts and the reward of the moment; MODEL 6. `n_of_code`: (9,) int64, buildings of each code."""
    n_burning = n_of_code[1] + n_of_code[2] + n_of_code[3]
    n_water_damaged = n_of_code[4] + n_of_code[5] + n_of_code[6] + n_of_code[7]
    n_burnt_out, n_alive = n_of_code[8], count_living(civilians.hp)
    counts = outcome.counts
    counts[0], counts[1], counts[2], counts[3] = n_burning, n_water_damaged, n_burnt_out, n_alive
    hp, full_hp = sum_health(civilians.hp), sum_health(civilians.full_hp)
    amount = amounts(Tally(n_burning, n_water_damaged, n_burnt_out, n_alive, hp, full_hp))
    total = 0.0
    for term in range(TOTAL):
        stock = reward.weights[term] * amount[term]
        outcome.reward[term] = rewarded(reward.kind, stock, outcome.stock[term])
        outcome.stock[term] = stock
        total += outcome.reward[term]
    outcome.reward[TOTAL] = total
    outcome.reward[SUM_SO_FAR] += total


@inner
def score(fire: FireState, civilians: CivilianState, geometry: GeometryArrays, outcome: Outcome) -> None:
    """Write the scores of the moment; MODEL 6.

    score: (alive + HP / full HP) * sqrt(floor area saved / floor area). The areas are added up in the order of the
    buildings, so all of them: after the last step of a call, since no step looks at the scores.
    """
    saved, area = 0.0, 0.0
    for b in range(len(fire.fieryness)):
        saved += geometry.floor_area[b] * SAVED[fire.fieryness[b]]
        area += geometry.floor_area[b]
    n_alive, hp, full_hp = count_living(civilians.hp), sum_health(civilians.hp), sum_health(civilians.full_hp)
    healthy = hp / full_hp if full_hp > 0 else 1.0
    outcome.score[0] = paper_score(n_alive, healthy, saved, area)
    outcome.score[1] = len(civilians.hp) + 1.0
    outcome.score[2] = n_alive * exp_of_minus(unhealth(healthy))


@kernel
def assess(
    fire: FireState,
    civilians: CivilianState,
    geometry: GeometryArrays,
    reward: Reward,
    outcome: Outcome,
    n_of_code: Array,
) -> None:
    """Write the counts, the reward and the scores of the moment, whatever it is; `n_of_code` as above is written."""
    count_codes(fire.fieryness, n_of_code)
    reward_step(n_of_code, civilians, reward, outcome)
    score(fire, civilians, geometry, outcome)
