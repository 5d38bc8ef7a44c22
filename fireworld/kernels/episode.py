"""Whole episodes in compiled code: the phases in their order, the same functions that single steps call."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fireworld.kernels.arrays import (
    BURNING,
    TOTAL,
    Array,
    CityArrays,
    Constants,
    Learner,
    PolicyArrays,
    WorldState,
)
from fireworld.kernels.choice import RANK_ALL, RANK_NAMED, choose, explores, keeps_choice, table_state
from fireworld.kernels.fire import is_over, light
from fireworld.kernels.jit import inner, making_arrays
from fireworld.kernels.learning import (
    EXPLORED,
    GREEDY,
    KEPT,
    NO_CHOICE,
    choose_and_learn,
    forget,
    go_on_and_learn,
    note_choice,
    note_reward,
    take_reward,
    update,
)
from fireworld.kernels.network import widest
from fireworld.kernels.observation import can_choose, find_target, observe
from fireworld.kernels.ranking import N_OF_BUILDING, N_WEIGHTS, rank
from fireworld.kernels.sites import find_sites
from fireworld.kernels.step import finish_step


class EpisodeScratch(NamedTuple):
    """What the steps of an episode write on; b brigades."""

    features: Array  # (8,) int64
    action_before: Array  # (b,) int32
    target_before: Array  # (b,) int32
    values: Array  # (5,) float64
    described: Array  # (n, 7) float64; no rows where nobody ranks
    described_at: Array  # (n,) int64, -1 at first
    seen: Array  # (17,) float64
    work: Array  # (2, w) float64, w as `widest` says of the policy's network


@inner
def run_steps(  # noqa: C901, PLR0912, PLR0915 - handing all arrays to functions of its own costs more than the loop
    city: CityArrays,
    world: WorldState,
    constants: Constants,
    policy: PolicyArrays,
    learner: Learner,
    seed: int,
    first_step: int,
    last_step: int,
    scratch: EpisodeScratch,
) -> int:
    """Run the steps of `run_episode`."""
    brigades, fire, people, sites, outcome = world.brigades, world.fire, world.civilians, world.sites, world.outcome
    buildings, geometry = city.buildings, city.geometry
    n_brigades = len(brigades.action)
    features, before, known_before = scratch.features, scratch.action_before, scratch.target_before
    values, described, described_at = scratch.values, scratch.described, scratch.described_at
    learning = learner.learning[0] != 0
    if learning:
        forget(learner)
    for step in range(first_step, last_step + 2):
        if step > last_step and not learning:
            break
        if step <= last_step:
            light(buildings, fire, step)
        find_sites(buildings, city.links, city.near, geometry, fire, people, brigades, sites)
        for brigade in range(n_brigades):
            before[brigade] = brigades.action[brigade]
            known_before[brigade] = brigades.target[brigade]
        in_turn = constants.observation.in_turn
        shown, known = (brigades.action, brigades.target) if in_turn else (before, known_before)
        for brigade in range(n_brigades):
            action, target = -1, -1
            if learning:
                note_choice(brigade, step - 1, -1, 0, NO_CHOICE, learner)
            if can_choose(brigade, brigades.hp, brigades.refilling, sites.counts):
                if keeps_choice(brigade, before[brigade], policy.commit[0], step):
                    action = before[brigade]
                    if learning:
                        state = -1
                        if step > last_step:
                            state = observe(brigade, shown, brigades.site, sites, constants.observation, features)
                            row = table_state(state, policy.tables.shape[1])
                            go_on_and_learn(brigade, policy.table_of[brigade], row, action, learner)
                        note_choice(brigade, step - 1, state, action, KEPT, learner)
                elif policy.kind[brigade] >= RANK_NAMED:
                    own, weights = policy.kind[brigade] == RANK_ALL, policy.rankings[policy.table_of[brigade]]
                    action, target = rank(
                        brigade,
                        own,
                        step,
                        known,
                        weights,
                        policy.network,
                        described,
                        described_at,
                        brigades,
                        buildings,
                        city.links,
                        geometry,
                        fire,
                        sites,
                        constants.fire,
                        constants.brigades,
                        scratch.seen,
                        scratch.work,
                        values,
                    )
                else:
                    state = observe(brigade, shown, brigades.site, sites, constants.observation, features)
                    action = choose(brigade, state, policy, seed, step)
                    if learning:
                        row = table_state(state, policy.tables.shape[1])
                        choose_and_learn(brigade, policy.table_of[brigade], row, action, policy.epsilon[0], learner)
                        choice = EXPLORED if explores(brigade, policy, seed, step) else GREEDY
                        note_choice(brigade, step - 1, state, action, choice, learner)
                if target < 0:
                    target = find_target(brigade, action, brigades, buildings, fire, geometry, sites)
            brigades.action[brigade] = action
            brigades.target[brigade] = target
        if step > last_step:
            break
        finish_step(city, fire, people, brigades, world.ways, outcome, constants, seed, step)
        if learning:
            take_reward(outcome.reward[TOTAL], learner)
            note_reward(step - 1, outcome.reward, learner)
        if is_over(outcome.counts[BURNING], buildings.later_step, step):
            if learning:
                for brigade in range(n_brigades):
                    update(brigade, policy.table_of[brigade], 0.0, learner)
            return step
    return last_step


@making_arrays
def run_episode(
    city: CityArrays,
    world: WorldState,
    constants: Constants,
    policy: PolicyArrays,
    learner: Learner,
    seed: int,
    first_step: int,
    last_step: int,
) -> int:
    """Run steps first_step..last_step, or until nothing burns; return the last step run.

    The phases of `World.step`, without a word to Python in between: for training, comparison and planning. A team that
    learns ends its episode by learning from its last choices: an episode that terminated is worth nothing more, one
    that was truncated as much as the choices that would have come next.
    """
    n_brigades = len(world.brigades.action)
    n_described = len(world.fire.energy) if policy.kind.max() >= RANK_NAMED else 0
    scratch = EpisodeScratch(
        np.zeros(8, dtype=np.int64),
        np.zeros(n_brigades, dtype=np.int32),
        np.zeros(n_brigades, dtype=np.int32),
        np.zeros(5),
        np.zeros((n_described, N_OF_BUILDING)),
        np.full(n_described, -1),
        np.zeros(N_WEIGHTS),
        np.zeros((2, widest(policy.network))),
    )
    return run_steps(city, world, constants, policy, learner, seed, first_step, last_step, scratch)
