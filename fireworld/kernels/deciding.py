"""How the brigades of a team decide, one after another, in a step that has begun."""

from __future__ import annotations

import numpy as np

from fireworld.kernels.allocation import join_site, named_range, stays
from fireworld.kernels.arrays import BY_RANK, BY_TABLE, Array, Seen
from fireworld.kernels.assignment import assign_target
from fireworld.kernels.choice import (
    ALLOCATE,
    ASSIGN,
    GIVEN,
    RANK_ALL,
    RANK_NAMED,
    TABLE,
    choose,
    explores,
    keeps_choice,
    table_state,
)
from fireworld.kernels.episode_arrays import LAST_STEP, SEED, STEP, Episode
from fireworld.kernels.jit import inner, kernel
from fireworld.kernels.learning import (
    EXPLORED,
    GREEDY,
    KEPT,
    NO_CHOICE,
    choose_and_learn,
    go_on_and_learn,
    note_choice,
)
from fireworld.kernels.observation import BY_ACTION, EASIEST, N_ACTIONS, can_choose, find_named, flag_targets, observe
from fireworld.kernels.ranking import OWN_TARGET, Sight
from fireworld.kernels.ranks import hear, line_up, line_up_before, rank_targets
from fireworld.kernels.sharing import allocate
from fireworld.kernels.step import opened_episode, sight_of
from fireworld.kernels.target_learning import compare_targets, explored_place, go_for_and_learn, keeps_target


@kernel
def decide_by_policy(row: Array, chosen: Array, before: Array, target_before: Array) -> None:
    """Let some brigades decide, one after another; somebody else decides for the rest, in their turns.

    Args:
        row: (k,) int64, the address row of an `Episode`.
        chosen: (m,) int64, their numbers.
        before: (b,) int32, what all brigades did in the last step.
        target_before: (b,) int32, what they went for.
    """
    episode = opened_episode(row)
    in_turn, brigades = episode.constants.observation.in_turn, episode.world.brigades
    for brigade in range(len(target_before)):
        episode.scratch.target_before[brigade] = target_before[brigade]
    shown, known = (brigades.action, brigades.target) if in_turn else (before, target_before)
    for k in range(len(chosen)):
        if len(episode.scratch.ranks.value) > 0:
            line_up_before(chosen[k], known, episode.city.geometry, episode.world.sites, episode.scratch.ranks)
        decide(chosen[k], episode.clock[STEP] + 1, before, shown, known, episode)


@inner
def decide_all(step: int, episode: Episode) -> None:
    """Let all brigades decide."""
    brigades, sites, scratch, seen = episode.world.brigades, episode.world.sites, episode.scratch, episode.seen
    before, target_before, ranks = scratch.action_before, scratch.target_before, scratch.ranks
    for brigade in range(len(brigades.action)):
        before[brigade] = brigades.action[brigade]
        target_before[brigade] = brigades.target[brigade]
    if len(seen.state) > 0:
        seen.valued[:] = 0
    in_turn, ranking = episode.constants.observation.in_turn, len(ranks.value) > 0
    shown, known = (brigades.action, brigades.target) if in_turn else (before, target_before)
    if ranking:
        line_up(known, episode.city.geometry, sites, ranks)
    for brigade in range(len(brigades.action)):
        decide(brigade, step, before, shown, known, episode)
        if ranking:
            hear(brigade, target_before[brigade], known[brigade], episode.city.geometry, sites, ranks)


@inner
def decide(brigade: int, step: int, before: Array, shown: Array, known: Array, episode: Episode) -> None:
    """Let a brigade decide; after the last step, it only learns from that.

    Args:
        brigade: its number.
        step: the one that has begun.
        before: (b,) int32, what all brigades did in the last step.
        shown: (b,) int32, what they do as far as this one knows, -1 nothing.
        known: (b,) int32, what they go for as far as this one knows, -1 nothing.
        episode: the world, the team, and where it is noted.
    """
    city, world, learner, seen = episode.city, episode.world, episode.learner, episode.seen
    brigades, sites = world.brigades, world.sites
    action, target, choice = -1, -1, NO_CHOICE
    if len(seen.state) > 0:
        seen.state[brigade] = state_of(brigade, shown, episode, seen.features[brigade])
        seen.site[brigade] = brigades.site[brigade]
        seen.action_values[brigade] = 0.0
        seen.target_value[brigade] = 0.0
    if learner.learning[0] != 0:
        note_choice(brigade, step - 1, -1, 0, NO_CHOICE, learner)
    if can_choose(brigade, brigades.hp, brigades.refilling, sites.counts):
        by_targets = len(learner.of_targets.trace) > 0
        learns_the_end = by_targets and step > episode.clock[LAST_STEP]
        if stays(brigade, brigades, sites, episode.constants.brigades) and not learns_the_end:
            action, target, choice = brigades.action[brigade], brigades.target[brigade], KEPT
            if learner.learning[0] != 0 and not by_targets:
                learn_from_kept(brigade, action, step, shown, episode)
        else:
            action, target, choice = decide_by_kind(brigade, step, before, shown, known, episode)
            observation = episode.constants.observation
            if target < 0 or (action == EASIEST and observation.heated):
                where = city.buildings, city.links, world.fire, city.geometry, sites
                target = find_named(brigade, action, brigades, *where, observation)
    brigades.action[brigade], brigades.target[brigade] = action, target
    join_site(brigade, target, brigades.site, sites, episode.constants.brigades.free)
    if len(seen.state) > 0:
        seen.choice[brigade], seen.explored[brigade] = choice, choice == EXPLORED


@inner
def decide_by_kind(
    brigade: int, step: int, before: Array, shown: Array, known: Array, episode: Episode
) -> tuple[int, int, int]:
    """Return the action of a brigade that can choose, its target if it names one, else -1, and how it came to it."""
    policy = episode.policy
    kind, target = policy.kind[brigade], -1
    if keeps_choice(brigade, before[brigade], policy.commit[0], step):
        action, choice = before[brigade], KEPT
        if episode.learner.learning[0] != 0:
            learn_from_kept(brigade, action, step, shown, episode)
    elif kind == GIVEN:
        action, choice = policy.action[brigade], GREEDY
        if action == OWN_TARGET:
            target = policy.table_of[brigade]
    elif kind == ALLOCATE:
        free, city, fire, sites = episode.constants.brigades.free, episode.city, episode.world.fire, episode.world.sites
        where = episode.world.brigades, city.buildings, fire, city.geometry, sites
        action, choice = OWN_TARGET, GREEDY
        target = allocate(brigade, known, free, *where, episode.scratch.shares)
    elif kind == ASSIGN:
        action, target = decide_by_assignment(brigade, step, known, episode)
        choice = GREEDY
    elif kind in (RANK_NAMED, RANK_ALL):
        action, target, choice = decide_by_worth(brigade, step, known, episode)
    else:
        action, choice = decide_by_state(brigade, step, shown, episode)
    return action, target, choice


@inner
def state_of(brigade: int, shown: Array, episode: Episode, features: Array) -> int:
    """Return the state that a brigade sees, and write the (8,) features that it stands for."""
    world, constants = episode.world, episode.constants.observation
    brigades, sites, city = world.brigades, world.sites, episode.city
    state = observe(brigade, shown, brigades.site, sites, constants, features)
    if constants.flags == BY_ACTION:
        return state
    known = brigades.target if constants.in_turn else episode.scratch.target_before
    where = city.buildings, city.links, world.fire, city.geometry, sites
    return flag_targets(brigade, known, brigades, *where, constants, features)


@inner
def decide_by_state(brigade: int, step: int, shown: Array, episode: Episode) -> tuple[int, int]:
    """Return the action of a brigade that decides by the state it sees, and how it came to it; it learns if it may."""
    policy, learner, seen, seed = episode.policy, episode.learner, episode.seen, episode.clock[SEED]
    state = state_of(brigade, shown, episode, episode.scratch.features)
    action = choose(brigade, state, policy, seed, step)
    choice = EXPLORED if explores(brigade, policy, seed, step) else GREEDY
    row, table = table_state(state, policy.tables.shape[1]), policy.table_of[brigade]
    if len(seen.state) > 0 and policy.kind[brigade] == TABLE:
        note_values(brigade, policy.tables[table, row], BY_TABLE, seen)
    if learner.learning[0] != 0:
        choose_and_learn(brigade, table, row, action, policy.epsilon[0], learner)
        note_choice(brigade, step - 1, state, action, choice, learner)
    return action, choice


@inner
def learn_from_kept(brigade: int, action: int, step: int, shown: Array, episode: Episode) -> None:
    """Note that a brigade keeps its choice; after the last step, learn from it."""
    policy, learner, state = episode.policy, episode.learner, -1
    if step > episode.clock[LAST_STEP]:
        state = state_of(brigade, shown, episode, episode.scratch.features)
        go_on_and_learn(brigade, policy.table_of[brigade], table_state(state, policy.tables.shape[1]), action, learner)
    note_choice(brigade, step - 1, state, action, KEPT, learner)


@inner
def decide_by_worth(brigade: int, step: int, known: Array, episode: Episode) -> tuple[int, int, int]:
    """Return the action, the target and how a brigade came to it that decides by what targets are worth to it."""
    policy, scratch, seen, of_targets = episode.policy, episode.scratch, episode.seen, episode.learner.of_targets
    sight = sight_of(episode.city, episode.world, episode.constants, scratch)
    choice, noting, ranking = GREEDY, len(seen.state) > 0, policy.table_of[brigade]
    learning, before = len(of_targets.trace) > 0, scratch.target_before[brigade]
    stays = learning and step <= episode.clock[LAST_STEP]
    if stays and keeps_target(brigade, before, step, episode.world.brigades.site, sight, of_targets):
        return OWN_TARGET, before, KEPT
    action, target = rank_targets(
        brigade,
        policy.kind[brigade] == RANK_ALL,
        noting,
        ranking,
        step,
        known,
        policy.rankings[ranking],
        policy.network,
        sight,
        scratch.ranks,
        scratch.seen,
        scratch.work,
        scratch.values,
    )
    if learning and action >= 0:
        target, choice = explore_and_learn(brigade, target, step, known, sight, episode)
    if noting:
        note_worth(brigade, scratch.values, seen)
    return action, target, choice


@inner
def decide_by_assignment(brigade: int, step: int, known: Array, episode: Episode) -> tuple[int, int]:
    """Return the action and the target of a brigade that is assigned to one together with others."""
    policy, scratch, seen = episode.policy, episode.scratch, episode.seen
    sight = sight_of(episode.city, episode.world, episode.constants, scratch)
    in_turn, weights = episode.constants.observation.in_turn, policy.rankings[policy.table_of[brigade]]
    team = known, policy.kind, weights
    action, target = assign_target(brigade, in_turn, step, *team, sight, scratch.assignment, scratch.values)
    if len(seen.state) > 0:
        note_worth(brigade, scratch.values, seen)
    return action, target


@inner
def explore_and_learn(
    brigade: int, target: int, step: int, known: Array, sight: Sight, episode: Episode
) -> tuple[int, int]:
    """Let a brigade that learns try another target now and then; learn from its choice before by the value of this one.

    All that it may name have been valued by it. Returns the target, and how it came to that.
    """
    policy, scratch, sites, learner = episode.policy, episode.scratch, episode.world.sites, episode.learner
    ranks, epsilon, choice = scratch.ranks, policy.epsilon[0], GREEDY
    first, end = named_range(brigade, episode.world.brigades.site, sites, episode.constants.brigades.free)
    greedy = np.int64(ranks.position[target])
    chosen = explored_place(brigade, first, end, epsilon, episode.clock[SEED], step)
    if chosen >= 0:
        target, choice = sites.member[chosen], EXPLORED
    else:
        chosen = greedy
    of_targets = learner.of_targets
    compare_targets(
        brigade, first, end, greedy, chosen, epsilon, known, policy.network, sight, ranks, scratch.seen, of_targets
    )
    go_for_and_learn(brigade, scratch.seen[0], policy.network, learner)
    return target, choice


@inner
def note_worth(brigade: int, values: Array, seen: Seen) -> None:
    """Note the values, (5,), by which a brigade chose a target: of those of the four actions, and of its own."""
    note_values(brigade, values, BY_RANK, seen)
    seen.target_value[brigade] = values[N_ACTIONS]


@inner
def note_values(brigade: int, values: Array, source: int, seen: Seen) -> None:
    """Note the values of the actions, (4,), by which a brigade chose; `source`: BY_TABLE or BY_RANK."""
    seen.valued[source] = 1
    for action in range(N_ACTIONS):
        seen.action_values[brigade, action] = values[action]
