"""Whole episodes in compiled code: the phases in their order, the same functions that single steps call."""

from __future__ import annotations

import numpy as np

from fireworld.kernels.arrays import CityTables, Constants, PolicyTables, WorldArrays
from fireworld.kernels.brigades import act
from fireworld.kernels.choice import choose
from fireworld.kernels.fire import advance_fire, draw_burn_rates
from fireworld.kernels.health import harm_brigades, harm_civilians
from fireworld.kernels.jit import kernel
from fireworld.kernels.observation import can_choose, find_target, observe
from fireworld.kernels.outcome import assess
from fireworld.kernels.sites import find_sites


@kernel
def run_episode(
    city: CityTables,
    world: WorldArrays,
    constants: Constants,
    policy: PolicyTables,
    seed: int,
    first_step: int,
    last_step: int,
) -> int:
    """Run steps first_step..last_step, or until nothing burns; return the last step run.

    The phases of `World.step`, without a word to Python in between: for training, comparison and planning.
    """
    brigades, fire, people, sites, outcome = world.brigades, world.fire, world.civilians, world.sites, world.outcome
    health, buildings, geometry, streets = constants.health, city.buildings, city.geometry, city.streets
    features = np.zeros(8, dtype=np.int64)
    n_brigades = len(brigades.action)
    for step in range(first_step, last_step + 1):
        find_sites(buildings, city.links, city.near, geometry, fire, people, brigades, sites)
        for brigade in range(n_brigades):
            action, target = -1, -1
            if can_choose(brigade, brigades, sites):
                state = observe(brigade, brigades, sites, constants.observation, features)
                action = choose(brigade, state, policy, seed, step)
                target = find_target(brigade, action, brigades, buildings, fire, geometry, sites)
            brigades.action[brigade] = action
            brigades.target[brigade] = target
        outcome.water[0] += act(brigades, fire, streets, geometry, constants.brigades)
        outcome.draws[0] = draw_burn_rates(buildings, fire, constants.fire, seed, step)
        advance_fire(buildings, city.cover, city.links, fire, constants.fire)
        outcome.draws[1] = harm_civilians(people, fire, health, seed, step)
        outcome.draws[1] += harm_brigades(brigades, fire, health, seed, step, len(people.hp))
        assess(fire, people, geometry, constants.reward_change, outcome)
        if outcome.counts[0] == 0:
            return step
    return last_step
