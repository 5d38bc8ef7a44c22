"""A brigade whose decisions are given, among others that follow a policy: a step of their world in one call."""

from __future__ import annotations

from fireworld.kernels.addresses import opener
from fireworld.kernels.arrays import SEED, STEP, Array, Episode
from fireworld.kernels.batch import Batch, follow, note_decisions, show, show_brigade
from fireworld.kernels.choice import RANK_ALL, RANK_NAMED, choose, keeps_choice
from fireworld.kernels.jit import inlined, kernel
from fireworld.kernels.observation import can_choose, find_target, observe
from fireworld.kernels.ranking import rank
from fireworld.kernels.step import begin_step, finish_step, opened_episode

opened_batch = opener(Batch)


@kernel
def begin_among_others(row: Array, batch_row: Array, i: int, brigade: int) -> None:
    """Let the brigades before this one decide, if they take turns, and this one see it; `row`: of world i."""
    others_before(brigade, i, opened_episode(row), opened_batch(batch_row))


@kernel
def step_among_others(row: Array, batch_row: Array, i: int, brigade: int) -> None:
    """Let a brigade do its part of `Batch.actions`, and the others what the policy says; arguments as above."""
    batch, episode = opened_batch(batch_row), opened_episode(row)
    brigades, scratch, clock = episode.world.brigades, episode.scratch, episode.clock
    in_turn = episode.constants.observation.in_turn
    for other in range(len(brigades.action)):
        scratch.action_before[other], scratch.target_before[other] = brigades.action[other], brigades.target[other]
    follow(brigade, batch.actions[i, brigade], i, episode, batch)
    for other in range(brigade + 1 if in_turn else 0, len(brigades.action)):
        if other != brigade:
            decide(other, episode)
    clock[STEP] += 1
    finish_step(episode.city, episode.world, episode.constants, clock[SEED], clock[STEP])
    note_decisions(i, brigades, batch.result)
    begin_step(episode.city, episode.world, clock[STEP] + 1)
    show(i, episode, batch)
    if not (batch.result.terminated[i] or batch.result.truncated[i]):
        others_before(brigade, i, episode, batch)


@inlined
def others_before(brigade: int, i: int, episode: Episode, batch: Batch) -> None:
    """Do what `begin_among_others` says."""
    if not episode.constants.observation.in_turn:
        return  # nobody sees what others decide in this step: they decide when it runs
    for other in range(brigade):
        decide(other, episode)
    show_brigade(brigade, i, episode, batch)


@inlined
def decide(brigade: int, episode: Episode) -> None:
    """Let a brigade do what the policy says, as `run_episode` does.

    Where choices are simultaneous, what all did in the last step is in `Scratch.action_before` and `target_before`.
    """
    city, world, constants, policy = episode.city, episode.world, episode.constants, episode.policy
    brigades, sites, scratch = world.brigades, world.sites, episode.scratch
    in_turn, step = constants.observation.in_turn, episode.clock[STEP] + 1
    shown, known = brigades.action, brigades.target
    if not in_turn:
        shown, known = scratch.action_before, scratch.target_before
    action, target = -1, -1
    if can_choose(brigade, brigades.hp, brigades.refilling, sites.counts):
        kind = policy.kind[brigade]
        if keeps_choice(brigade, brigades.action[brigade], policy.commit[0], step):
            action = brigades.action[brigade]
        elif kind in (RANK_NAMED, RANK_ALL):
            action, target = rank(
                brigade,
                kind == RANK_ALL,
                step,
                known,
                policy.rankings[policy.table_of[brigade]],
                policy.network,
                scratch.described,
                scratch.described_at,
                brigades,
                city.buildings,
                city.links,
                city.geometry,
                world.fire,
                sites,
                constants.fire,
                constants.brigades,
                scratch.seen,
                scratch.work,
                scratch.values,
            )
        else:
            state = observe(brigade, shown, brigades.site, sites, constants.observation, scratch.features)
            action = choose(brigade, state, policy, episode.clock[SEED], step)
        if target < 0:
            target = find_target(brigade, action, brigades, city.buildings, world.fire, city.geometry, sites)
    brigades.action[brigade], brigades.target[brigade] = action, target
