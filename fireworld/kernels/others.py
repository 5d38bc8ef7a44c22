"""Brigades of a world that others step: they decide by a policy, while somebody else decides for the rest."""

from __future__ import annotations

from fireworld.kernels.arrays import SEED, STEP, Array, Episode
from fireworld.kernels.choice import RANK_ALL, RANK_NAMED, choose, keeps_choice
from fireworld.kernels.jit import inlined, kernel
from fireworld.kernels.observation import can_choose, find_target, observe
from fireworld.kernels.ranks import rank
from fireworld.kernels.step import opened_episode, sight_of


@kernel
def decide_by_policy(row: Array, chosen: Array, before: Array, target_before: Array) -> None:
    """Let some brigades decide, one after another, as `run_episode` does, in a step that has begun.

    Args:
        row: (k,) int64, the address row of an `Episode`.
        chosen: (m,) int64, their numbers.
        before: (b,) int32, what all brigades did in the last step.
        target_before: (b,) int32, what they went for.
    """
    episode = opened_episode(row)
    for k in range(len(chosen)):
        decide(chosen[k], before, target_before, episode)


@inlined
def decide(brigade: int, before: Array, target_before: Array, episode: Episode) -> None:
    """Let a brigade decide; arguments as above."""
    city, world, constants, policy = episode.city, episode.world, episode.constants, episode.policy
    brigades, sites, scratch = world.brigades, world.sites, episode.scratch
    step = episode.clock[STEP] + 1
    shown, known = (brigades.action, brigades.target) if constants.observation.in_turn else (before, target_before)
    action, target = -1, -1
    if can_choose(brigade, brigades.hp, brigades.refilling, sites.counts):
        kind = policy.kind[brigade]
        if keeps_choice(brigade, before[brigade], policy.commit[0], step):
            action = before[brigade]
        elif kind in (RANK_NAMED, RANK_ALL):
            action, target = rank(
                brigade,
                kind == RANK_ALL,
                step,
                known,
                policy.rankings[policy.table_of[brigade]],
                policy.network,
                sight_of(city, world, constants, scratch),
                scratch.ranks,
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
