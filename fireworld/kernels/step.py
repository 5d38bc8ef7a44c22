"""The phases of a step but for the decisions: the one list of them, for single steps and whole episodes."""

from __future__ import annotations

import numpy as np

from fireworld.kernels.addresses import opener
from fireworld.kernels.arrays import (
    Array,
    BrigadeState,
    CityArrays,
    CivilianState,
    Constants,
    FireState,
    HealthConstants,
    WorldState,
)
from fireworld.kernels.brigades import act, shelter
from fireworld.kernels.episode_arrays import SEED, SITES_CHANGED, STEP, Episode, Scratch, Warmth
from fireworld.kernels.fire import burn_on, draw_burn_rates, light
from fireworld.kernels.health import harm
from fireworld.kernels.jit import inner, kernel
from fireworld.kernels.outcome import count_living, reward_step, score
from fireworld.kernels.ranking import Sight
from fireworld.kernels.sites import find_sites
from fireworld.kernels.warmth import begin, doubt, refresh

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
    city, world, warmth = episode.city, episode.world, episode.scratch.warmth
    begin(city.cover, world.fire, warmth)
    begin_step(city, world, episode.constants, warmth, episode.clock[STEP] + 1)


@kernel
def finish(row: Array) -> None:
    """Carry out what the brigades decided in the step of the clock."""
    episode = opened_episode(row)
    city, world, warmth = episode.city, episode.world, episode.scratch.warmth
    begin(city.cover, world.fire, warmth)
    finish_step(city, world, episode.constants, warmth, episode.clock[SEED], episode.clock[STEP])
    score(world.fire, world.civilians, city.geometry, world.outcome)


@inner
def sight_of(city: CityArrays, world: WorldState, constants: Constants, scratch: Scratch) -> Sight:
    """Return what the brigades look at when they value targets."""
    return Sight(
        city.buildings,
        city.links,
        city.geometry,
        city.streets,
        world.fire,
        world.brigades,
        world.sites,
        constants.fire,
        constants.brigades,
        scratch.described,
        scratch.described_at,
    )


@inner
def begin_step(city: CityArrays, world: WorldState, constants: Constants, warmth: Warmth, step: int) -> None:
    """Light what is lit in a step, and find the fire sites if they can be others than before.

    Before the first step of a call, the lists of what is warm `begin`; after the last one it has its `score`.
    """
    if light(city.buildings, world.fire, step) > 0:
        begin(city.cover, world.fire, warmth)
    if warmth.number[SITES_CHANGED] != 0:
        find_sites(
            city.buildings,
            city.links,
            city.near,
            city.geometry,
            world.fire,
            world.civilians,
            world.brigades,
            world.sites,
            warmth,
            constants.observation.jump,
        )


@inner
def finish_step(
    city: CityArrays, world: WorldState, constants: Constants, warmth: Warmth, seed: int, step: int
) -> None:
    """Act, burn, hurt, reward: carry out what the brigades decided, and compute what the step is worth."""
    fire, people, brigades, outcome = world.fire, world.civilians, world.brigades, world.outcome
    outcome.water[0] += act(brigades, fire, city.streets, world.ways, city.geometry, constants.brigades)
    for brigade in range(len(brigades.sprayed)):
        if brigades.sprayed[brigade] > 0:
            doubt(brigades.target[brigade], warmth)
    refresh(city.cover, warmth)
    outcome.draws[0] = draw_burn_rates(city.buildings, fire, constants.fire, seed, step, warmth)
    burn_on(city.buildings, city.cover, city.links, fire, constants.fire, warmth)
    n_alive = count_living(people.hp)
    outcome.draws[1] = hurt(fire, people, brigades, constants.health, seed, step)
    if count_living(people.hp) != n_alive:  # sites are measured by the living
        warmth.number[SITES_CHANGED] = 1
    reward_step(warmth.n_of_code, people, constants.reward, outcome)


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
