"""Health of civilians and brigades in plain numpy: MODEL 3."""

from __future__ import annotations

import numpy as np

from fireworld.city.city import Array, Float64Array
from fireworld.parameters import HealthParameters


def expose(uniform: Float64Array, parameters: HealthParameters, *, share: float = 1.0) -> Float64Array:
    """Draw the damage of a step inside a burning building.

    The three damages exclude each other: slight below its probability, serious in the interval after it, critical in
    the next. In the official data 30.4 % of the people exposed once go unhurt: one less the sum of the three.

    Args:
        uniform: (n,) in [0, 1).
        parameters: damages and their probabilities.
        share: part of the damage that counts; less than 1 for brigades.
    """
    slight = parameters.slight_probability
    serious = slight + parameters.serious_probability
    critical = serious + parameters.critical_probability
    damages = (parameters.slight_damage, parameters.serious_damage, parameters.critical_damage)
    return share * np.select([uniform < slight, uniform < serious, uniform < critical], damages, 0.0)


def suffer(hp: Array, damage: Float64Array, exposure: Float64Array, noise: Float64Array, p: HealthParameters) -> None:
    """Advance everybody's health by a step; the dead stay as they are.

    With d > 0 after the exposure: d += growth * d^2 + constant + noise; then hp -= d rounded half up, not below 0.

    Args:
        hp: (n,) health points, whole numbers; changed.
        damage: (n,) health points lost per step; changed.
        exposure: (n,) damage of this step, 0 for people outside fire.
        noise: (n,) draws of N(noise_mean, noise_sd).
        p: the parameters.
    """
    alive = hp > 0
    damage += np.where(alive, exposure, 0.0)
    hurt = alive & (damage > 0)
    damage += np.where(hurt, p.growth * damage * damage + p.constant + noise, 0.0)
    rounded = np.floor(damage[hurt] + 0.5)
    hp[hurt] = np.maximum(hp[hurt] - np.minimum(rounded, hp[hurt]).astype(hp.dtype), 0)
