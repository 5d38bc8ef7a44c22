"""The phases of a step but for the decisions: the one list of them, for single steps and whole episodes."""

from __future__ import annotations

import numpy as np

from fireworld.kernels.addresses import opener
from fireworld.kernels.arrays import (
    SEED,
    STEP,
    Array,
    BrigadeState,
    CityArrays,
    CivilianState,
    Constants,
    Episode,
    FireState,
    HealthConstants,
    WorldState,
)
from fireworld.kernels.brigades import act, shelter
from fireworld.kernels.fire import advance_fire, draw_burn_rates, light
from fireworld.kernels.health import harm
from fireworld.kernels.jit import inlined, inner, kernel
from fireworld.kernels.outcome import assess
from fireworld.kernels.ranking import Sight
from fireworld.kernels.sites import find_sites

FIRST_CIVILIAN = np.int64(0)
"""Entity number of the first civilian, for the draws; the brigades' follow."""
UNPROTECTED = 1.0


opened_episode = opener(Episode)


@kernel
def look(row: Array) -> None:
    """Begin the step after the last one done: light what is lit in it, and find the fire sites.

    Args:
        row: (k,) int64, the address row of an `Episode`, here and below.
    """
    episode = opened_episode(row)
    begin_step(episode.city, episode.world, episode.clock[STEP] + 1)


@kernel
def finish(row: Array) -> None:
    """Carry out what the brigades decided in the step of the clock."""
    episode = opened_episode(row)
    finish_step(episode.city, episode.world, episode.constants, episode.clock[SEED], episode.clock[STEP])


@inlined
def sight_of(episode: Episode) -> Sight:
    """Return what the brigades of an episode look at when they value targets."""
    city, world, constants, scratch = episode.city, episode.world, episode.constants, episode.scratch
    return Sight(
        city.buildings,
        city.links,
        city.geometry,
        world.fire,
        world.brigades,
        world.sites,
        constants.fire,
        constants.brigades,
        scratch.described,
        scratch.described_at,
    )


@inlined
def begin_step(city: CityArrays, world: WorldState, step: int) -> None:
    """Light what is lit in a step, and find the fire sites."""
    buildings = city.buildings
    light(buildings, world.fire, step)
    find_sites(
        buildings, city.links, city.near, city.geometry, world.fire, world.civilians, world.brigades, world.sites
    )


@inlined
def finish_step(city: CityArrays, world: WorldState, constants: Constants, seed: int, step: int) -> None:
    """Act, burn, hurt, assess: carry out what the brigades decided, and compute what the step is worth."""
    fire, people, brigades, outcome = world.fire, world.civilians, world.brigades, world.outcome
    outcome.water[0] += act(brigades, fire, city.streets, world.ways, city.geometry, constants.brigades)
    outcome.draws[0] = draw_burn_rates(city.buildings, fire, constants.fire, seed, step)
    advance_fire(city.buildings, city.cover, city.links, fire, constants.fire)
    outcome.draws[1] = hurt(fire, people, brigades, constants.health, seed, step)
    assess(fire, people, city.geometry, constants.reward, outcome)


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
