"""Whole episodes in compiled code: the phases in their order, the same functions that single steps call."""

from __future__ import annotations

from fireworld.kernels.arrays import (
    BURNING,
    BY_RANK,
    BY_TABLE,
    LAST_STEP,
    SEED,
    STEP,
    TOTAL,
    Array,
    Episode,
    Seen,
)
from fireworld.kernels.choice import GIVEN, RANK_ALL, RANK_NAMED, TABLE, choose, explores, keeps_choice, table_state
from fireworld.kernels.fire import is_over
from fireworld.kernels.jit import inlined, inner, kernel
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
from fireworld.kernels.observation import N_ACTIONS, can_choose, find_target, observe
from fireworld.kernels.outcome import score
from fireworld.kernels.ranking import OWN_TARGET
from fireworld.kernels.ranks import hear, line_up, rank_targets
from fireworld.kernels.step import begin_step, finish_step, opened_episode, sight_of
from fireworld.kernels.warmth import begin

NO_STEP = 0
"""A step in which no fire is lit."""


@inner
def note_values(brigade: int, values: Array, source: int, seen: Seen) -> None:
    """Note the values of the actions, (4,), by which a brigade chose; `source`: BY_TABLE or BY_RANK."""
    seen.valued[source] = 1
    for action in range(N_ACTIONS):
        seen.action_values[brigade, action] = values[action]


@inlined
def run_steps(episode: Episode) -> None:  # noqa: C901, PLR0912, PLR0915 - to hand all arrays on costs more than the loop
    """Run the steps of `run_episode`."""
    city, world, constants, policy, learner = (
        episode.city,
        episode.world,
        episode.constants,
        episode.policy,
        episode.learner,
    )
    seen, scratch, clock = episode.seen, episode.scratch, episode.clock
    seed, last_step = clock[SEED], clock[LAST_STEP]
    brigades, fire, sites, outcome = world.brigades, world.fire, world.sites, world.outcome
    buildings, geometry = city.buildings, city.geometry
    n_brigades = len(brigades.action)
    features, before, known_before = scratch.features, scratch.action_before, scratch.target_before
    values, ranks = scratch.values, scratch.ranks
    learning, noting, ranking = learner.learning[0] != 0, len(seen.state) > 0, len(ranks.value) > 0
    sight = sight_of(city, world, constants, scratch)
    scratch.described_at[:] = -1
    if learning:
        forget(learner)
    begin(city.cover, fire, scratch.warmth)
    for step in range(clock[STEP] + 1, last_step + 2):
        if step > last_step and not learning:
            break
        begin_step(city, world, scratch.warmth, step if step <= last_step else NO_STEP)
        for brigade in range(n_brigades):
            before[brigade] = brigades.action[brigade]
            known_before[brigade] = brigades.target[brigade]
        in_turn = constants.observation.in_turn
        shown, known = (brigades.action, brigades.target) if in_turn else (before, known_before)
        if noting:
            seen.valued[:] = 0
        if ranking:
            line_up(known, geometry, sites, ranks)
        for brigade in range(n_brigades):
            action, target, choice = -1, -1, NO_CHOICE
            if noting:
                seen.state[brigade] = observe(
                    brigade, shown, brigades.site, sites, constants.observation, seen.features[brigade]
                )
                seen.action_values[brigade] = 0.0
                seen.target_value[brigade] = 0.0
            if learning:
                note_choice(brigade, step - 1, -1, 0, NO_CHOICE, learner)
            if can_choose(brigade, brigades.hp, brigades.refilling, sites.counts):
                if keeps_choice(brigade, before[brigade], policy.commit[0], step):
                    action, choice = before[brigade], KEPT
                    if learning:
                        state = -1
                        if step > last_step:
                            state = observe(brigade, shown, brigades.site, sites, constants.observation, features)
                            row = table_state(state, policy.tables.shape[1])
                            go_on_and_learn(brigade, policy.table_of[brigade], row, action, learner)
                        note_choice(brigade, step - 1, state, action, choice, learner)
                elif policy.kind[brigade] == GIVEN:
                    action, choice = policy.action[brigade], GREEDY
                    if action == OWN_TARGET:
                        target = policy.table_of[brigade]
                elif policy.kind[brigade] in (RANK_NAMED, RANK_ALL):
                    own, choice = policy.kind[brigade] == RANK_ALL, GREEDY
                    weights = policy.rankings[policy.table_of[brigade]]
                    action, target = rank_targets(
                        brigade,
                        own,
                        noting,
                        policy.table_of[brigade],
                        step,
                        known,
                        weights,
                        policy.network,
                        sight,
                        ranks,
                        scratch.seen,
                        scratch.work,
                        values,
                    )
                    if noting:
                        note_values(brigade, values, BY_RANK, seen)
                        seen.target_value[brigade] = values[N_ACTIONS]
                else:
                    state = observe(brigade, shown, brigades.site, sites, constants.observation, features)
                    action = choose(brigade, state, policy, seed, step)
                    choice = EXPLORED if explores(brigade, policy, seed, step) else GREEDY
                    if noting and policy.kind[brigade] == TABLE:
                        row = table_state(state, policy.tables.shape[1])
                        note_values(brigade, policy.tables[policy.table_of[brigade], row], BY_TABLE, seen)
                    if learning:
                        row = table_state(state, policy.tables.shape[1])
                        choose_and_learn(brigade, policy.table_of[brigade], row, action, policy.epsilon[0], learner)
                        note_choice(brigade, step - 1, state, action, choice, learner)
                if target < 0:
                    target = find_target(brigade, action, brigades, buildings, fire, geometry, sites)
            brigades.action[brigade] = action
            brigades.target[brigade] = target
            if ranking:
                hear(brigade, known_before[brigade], known[brigade], geometry, sites, ranks)
            if noting:
                seen.choice[brigade], seen.explored[brigade] = choice, choice == EXPLORED
        if step > last_step:
            break
        clock[STEP] = step
        finish_step(city, world, constants, scratch.warmth, seed, step)
        if learning:
            take_reward(outcome.reward[TOTAL], learner)
            note_reward(step - 1, outcome.reward, learner)
        if is_over(outcome.counts[BURNING], buildings.later_step, step):
            if learning:
                for brigade in range(n_brigades):
                    update(brigade, policy.table_of[brigade], 0.0, learner)
            break
    score(fire, world.civilians, geometry, outcome)


@kernel
def run_episode(row: Array) -> None:
    """Run steps until nothing burns, or the last one of the clock is done; the clock has the last step run.

    The phases of a step, without a word to Python in between, one step or many. A team that learns ends its episode by
    learning from its last choices: an episode that terminated is worth nothing more, one that was truncated as much as
    the choices that would have come next.

    Args:
        row: (k,) int64, the address row of an `Episode`.
    """
    run_steps(opened_episode(row))
