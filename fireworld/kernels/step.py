"""The phases of a step once the brigades have decided: the one list of them, for single steps and whole episodes."""

from __future__ import annotations

import numpy as np

from fireworld.kernels.arrays import (
    BrigadeState,
    CityArrays,
    CivilianState,
    Constants,
    FireState,
    HealthConstants,
    Outcome,
    WayState,
)
from fireworld.kernels.brigades import act, shelter
from fireworld.kernels.fire import advance_fire, draw_burn_rates
from fireworld.kernels.health import harm
from fireworld.kernels.jit import inner, kernel
from fireworld.kernels.outcome import assess

FIRST_CIVILIAN = np.int64(0)
"""Entity number of the first civilian, for the draws; the brigades' follow."""
UNPROTECTED = 1.0


@kernel
def finish_step(
    city: CityArrays,
    fire: FireState,
    civilians: CivilianState,
    brigades: BrigadeState,
    ways: WayState,
    outcome: Outcome,
    constants: Constants,
    seed: int,
    step: int,
) -> None:
    """Act, burn, hurt, assess: carry out what the brigades decided, and compute what the step is worth.

    Takes what it needs of the world, group by group: every array that Python hands over costs time.
    """
    outcome.water[0] += act(brigades, fire, city.streets, ways, city.geometry, constants.brigades)
    outcome.draws[0] = draw_burn_rates(city.buildings, fire, constants.fire, seed, step)
    advance_fire(city.buildings, city.cover, city.links, fire, constants.fire)
    outcome.draws[1] = hurt(fire, civilians, brigades, constants.health, seed, step)
    assess(fire, civilians, city.geometry, constants.reward, outcome)


@inner
def hurt(
    fire: FireState, civilians: CivilianState, brigades: BrigadeState, constants: HealthConstants, seed: int, step: int
) -> float:
    """Hurt the civilians and the brigades in burning buildings; return the sum of the draws, as `harm` does."""
    people, codes = civilians, fire.fieryness
    total = harm(people.building, people.hp, people.damage, codes, constants, UNPROTECTED, seed, step, FIRST_CIVILIAN)
    shelter(brigades)
    share, first = constants.brigade_share, len(people.hp)
    total += harm(brigades.inside, brigades.hp, brigades.damage, codes, constants, share, seed, step, first)
    return total
