"""Health of people: the damage model of the official "misc" simulator."""

from __future__ import annotations

from fireworld.draws import DAMAGE, DAMAGE_NOISE
from fireworld.kernels.arrays import Array, HealthConstants
from fireworld.kernels.draws import normal, uniform
from fireworld.kernels.jit import inner


@inner
def expose(uniform_draw: float, constants: HealthConstants) -> float:
    """Return the damage that one step in a burning building adds: slight, serious, critical or none."""
    if uniform_draw < constants.slight_below:
        return constants.slight_damage
    if uniform_draw < constants.serious_below:
        return constants.serious_damage
    return constants.critical_damage if uniform_draw < constants.critical_below else 0.0


@inner
def worsen(damage: float, noise: float, constants: HealthConstants) -> float:
    """Let damage grow by one step: d + 0.00025 d^2 + 0.03 + noise; none stays none."""
    return damage + constants.growth * damage * damage + constants.constant + noise if damage > 0.0 else 0.0


@inner
def harm(
    building: Array,
    hp: Array,
    damage: Array,
    fieryness: Array,
    constants: HealthConstants,
    share: float,
    seed: int,
    step: int,
    first: int,
) -> float:
    """Hurt the people inside burning buildings and let all hurt people lose health; MODEL 3.

    Per person, (p,): int32 building, -1 outdoors; int32 health points and float64 points lost per step, both changed.
    `share` is the part of the damage that they take (brigades are protected), `first` the entity of the first, for the
    draws. Returns the sum of the damage draws and noise, by which runs with different draws differ.
    """
    total = 0.0
    for person in range(len(hp)):
        if hp[person] <= 0:
            continue
        inside = building[person]
        if inside >= 0 and 1 <= fieryness[inside] <= 3:
            added = expose(uniform(seed, DAMAGE, first + person, step), constants) * share
            damage[person] += added
            total += added
        if damage[person] > 0.0:
            noise = constants.noise_mean + constants.noise_sd * normal(seed, DAMAGE_NOISE, first + person, step)
            damage[person] = worsen(damage[person], noise, constants)
            total += noise
            hp[person] -= int(min(max(damage[person] + 0.5, 0.0), hp[person]))  # bounds first: damage may be immense
    return total
