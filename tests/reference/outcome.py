"""What a step was worth, in plain numpy: reward, scores and counts; MODEL 6."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from fireworld.city.city import Array, Float64Array

SAVED: Final = np.array([1.0, 0.66, 0.33, 0.0, 0.9, 0.75, 0.5, 0.25, 0.0])
"""Part of a building that counts as saved, by fieryness code."""


@dataclass(frozen=True)
class Reward:
    """Weights of the terms; the reward is their weighted sum, or how that changed."""

    water_damaged: float = -1.0
    burning: float = -2.0
    burnt_out: float = -3.0
    civilians: float = 1.0
    change: bool = False


@dataclass
class Outcome:
    """The outcome as it stands after a step."""

    n_burning: int = 0
    n_water_damaged: int = 0
    n_burnt_out: int = 0
    n_civilians_alive: int = 0
    stock: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)  # water-damaged, burning, burnt out, civilians
    reward: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)  # the same terms, or their change
    reward_so_far: float = 0.0
    score: float = 0.0
    score_now: float = 0.0
    water_litres: int = 0


def assess(
    outcome: Outcome, *, fieryness: Array, floor_area: Float64Array, hp: Array, full_hp: int, reward: Reward
) -> None:
    """Write the counts, the reward and both scores of the moment.

    Args:
        outcome: changed.
        fieryness: (n,) codes.
        floor_area: (n,) ground area times floors, m2.
        hp: (c,) health points of the civilians.
        full_hp: health points of a healthy one.
        reward: what the step is worth.
    """
    of_code = np.bincount(fieryness, minlength=9).tolist()
    outcome.n_burning, outcome.n_water_damaged, outcome.n_burnt_out = sum(of_code[1:4]), sum(of_code[4:8]), of_code[8]
    points = hp.tolist()
    outcome.n_civilians_alive = sum(one > 0 for one in points)
    full = full_hp * len(points)
    stock = (
        reward.water_damaged * outcome.n_water_damaged,
        reward.burning * outcome.n_burning,
        reward.burnt_out * outcome.n_burnt_out,
        reward.civilians * (sum(points) - full),
    )
    change = tuple(new - old for new, old in zip(stock, outcome.stock, strict=True))
    outcome.reward, outcome.stock = change if reward.change else stock, stock
    outcome.reward_so_far += sum(outcome.reward)
    healthy = sum(points) / full if full else 1.0
    saved = float(SAVED[fieryness] @ floor_area)
    outcome.score = (outcome.n_civilians_alive + healthy) * math.sqrt(saved / float(floor_area.sum()))
    outcome.score_now = outcome.n_civilians_alive * math.exp(-5.0 * (1.0 - healthy))
