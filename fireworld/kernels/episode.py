"""Whole episodes in compiled code: the phases in their order, the same functions that single steps call."""

from __future__ import annotations

from fireworld.kernels.arrays import BURNING, TOTAL, Array
from fireworld.kernels.deciding import decide_all
from fireworld.kernels.episode_arrays import LAST_STEP, SEED, STEP, Episode
from fireworld.kernels.fire import is_over
from fireworld.kernels.jit import inner, kernel
from fireworld.kernels.learning import forget, note_reward, take_reward, update
from fireworld.kernels.outcome import score
from fireworld.kernels.own_reward import note_worth, own_rewards
from fireworld.kernels.step import begin_step, finish_step, opened_episode
from fireworld.kernels.target_learning import learn_target
from fireworld.kernels.warmth import begin

PERCENT = 100.0
NO_STEP = 0
"""A step in which no fire is lit."""


@kernel
def run_episode(row: Array) -> None:
    """Run steps until nothing burns, or the last one of the clock is done; the clock has the last step run.

    The phases of a step, without a word to Python in between, one step or many. A team that learns ends its episode by
    learning from its last choices: an episode that terminated is worth nothing more, one that was truncated as much as
    the choices that would have come next.

    Args:
        row: (k,) int64, the address row of an `Episode`.
    """
    episode = opened_episode(row)
    city, world, constants, clock = episode.city, episode.world, episode.constants, episode.clock
    learner, warmth, outcome = episode.learner, episode.scratch.warmth, episode.world.outcome
    learning, last_step = learner.learning[0] != 0, clock[LAST_STEP]
    episode.scratch.described_at[:] = -1
    by_score = len(learner.of_targets.trace) > 0
    doing = world.brigades, world.fire.fieryness, constants.reward.weights
    if learning:
        forget(learner)
    if by_score:
        score(world.fire, world.civilians, city.geometry, outcome)
    begin(city.cover, world.fire, warmth)
    for step in range(clock[STEP] + 1, last_step + 2):
        if step > last_step and not learning:
            break
        begin_step(city, world, constants, warmth, step if step <= last_step else NO_STEP)
        decide_all(step, episode)
        if step > last_step:
            break
        clock[STEP] = step
        note_worth(*doing, learner.own)
        finish_step(city, world, constants, warmth, clock[SEED], step)
        if learning:
            own_rewards(*doing, learner.own)
            take_reward(change_of_score(episode) if by_score else outcome.reward[TOTAL], learner)
            note_reward(step - 1, outcome.reward, learner)
        if is_over(outcome.counts[BURNING], city.buildings.later_step, step):
            if learning:
                learn_the_end(episode)
            break
    score(world.fire, world.civilians, city.geometry, outcome)


@inner
def change_of_score(episode: Episode) -> float:
    """Return how the score has changed in a step, in percent of the maximum, and write it anew."""
    world, outcome = episode.world, episode.world.outcome
    before = outcome.score[0]
    score(world.fire, world.civilians, episode.city.geometry, outcome)
    return PERCENT * (outcome.score[0] - before) / outcome.score[1]


@inner
def learn_the_end(episode: Episode) -> None:
    """Let all brigades learn from their last choices, after which nothing comes."""
    policy, learner = episode.policy, episode.learner
    for brigade in range(len(learner.state)):
        if len(learner.of_targets.trace) > 0:
            learn_target(brigade, 0.0, policy.network, learner)
        else:
            update(brigade, policy.table_of[brigade], 0.0, learner)
