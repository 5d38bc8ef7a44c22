"""Worlds in a batch do bit for bit what a world does alone, however many they are and whoever steps them."""

from __future__ import annotations

import numpy as np
import pytest

from fireworld import envs
from fireworld.kernels.ranking import OWN_TARGET
from fireworld.policy.protocol import Decision, Policy
from tests.envs.towns import HOT, LATER, SMALL, built, by_table, deadly, looked, reference, table_policy

CURRICULA = {
    "small": [SMALL],
    "later": [LATER],
    "several": [SMALL, LATER, HOT],  # teams of 3, 5 and 2 brigades in three cities
}


def play(worlds, n_episodes):
    """Let the tables play some episodes of each world; yield (world, its seed, its reward) whenever one ends."""
    seen, n = worlds.reset(), np.zeros(worlds.n, dtype=int)
    returns = np.zeros(worlds.n)
    while n.min() < n_episodes:
        done = worlds.step(by_table(seen["features"], seen["alive"]))
        seen, returns = done.observation, returns + done.reward
        for index in np.flatnonzero(done.terminated | done.truncated).tolist():
            yield index, int(done.info["seed"][index]), int(n[index]), float(returns[index]), done
            n[index], returns[index] = n[index] + 1, 0.0


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("n", [1, 7])
@pytest.mark.parametrize("name", CURRICULA)
def test_a_batch_is_as_many_worlds_alone(name, n, threads):
    scenarios = CURRICULA[name]
    worlds = envs.worlds(scenarios, n, threads=threads, reward="stock", seeds=5)
    ends = set()
    for index, seed, episode, total, done in play(worlds, 3):
        alone = reference(scenarios[(index + episode) % len(scenarios)], seed)
        assert worlds.world(index).digest() == looked(alone).digest()
        assert done.info["step"][index] == alone.step_number
        assert done.info["score"][index] == alone.outcome.score
        assert done.terminated[index] == alone.terminated
        assert done.truncated[index] == alone.truncated
        assert total == pytest.approx(alone.outcome.total_reward, abs=1e-9)
        ends.add((alone.terminated, alone.truncated))
    worlds.close()
    assert n == 1 or name == "later" or ends == {(True, False), (False, True)}


@pytest.mark.parametrize("observation", ["targets", "graph"])
def test_what_is_seen_changes_nothing(observation):
    worlds, others = envs.worlds(SMALL, 3, seeds=5), envs.worlds(SMALL, 3, seeds=5, observation=observation)
    seen = worlds.reset()
    others.reset()
    for _ in range(40):
        actions = by_table(seen["features"], seen["alive"])
        seen = worlds.step(actions).observation
        others.step(actions)
        assert worlds.digest() == others.digest()


class Own(Policy):
    """Names the last burning building of its site, and the second in every third step."""

    def decide(self, observation):
        burning = observation.burning
        place = min(1, len(burning) - 1) if observation.step % 3 == 0 else len(burning) - 1
        return Decision(OWN_TARGET, target=int(burning[place]))


def test_own_targets_are_the_buildings_that_are_shown():
    worlds = envs.worlds(SMALL, 1, own_targets=12, observation="graph", seeds=9, autoreset="disabled")
    seen = worlds.reset()
    alone = built(SMALL).world(seed=int(worlds.info()["seed"][0]))
    while not worlds.ended()[0]:
        mask, own, burning = seen["action_mask"][0], seen["own"][0], seen["burning"][0]
        choosing = mask[:, 1]
        assert (mask[:, 4:] == (own >= 0)).all()
        assert set(own[own >= 0].tolist()) <= set(burning.tolist())
        counts = mask[:, 4:].sum(axis=1)
        place = np.minimum(1, counts - 1) if (alone.step_number + 1) % 3 == 0 else counts - 1
        seen = worlds.step(np.where(choosing, 4 + place, 0)[None]).observation
        alone.step(Own())
        assert worlds.world(0).digest() == looked(alone).digest()
        action, target = worlds.decisions()
        assert (action[0] == np.where(choosing, OWN_TARGET, -1)).all()
        assert (target[0] == alone.state.brigades.target).all()
    assert alone.terminated or alone.truncated


def test_a_world_taken_out_goes_the_same_way():
    """Its coming step has begun; to begin it again changes nothing."""
    worlds = envs.worlds([LATER, SMALL], 4, seeds=2)
    seen = worlds.reset()
    for step in range(1, 21):
        seen = worlds.step(by_table(seen["features"], seen["alive"])).observation
        taken = worlds.world(0)
        assert (taken.step_number, taken.n_steps_max) == (step, 30)
        assert looked(taken).digest() == taken.digest()
        alone = reference(LATER, taken.seed)
        assert (taken.terminated, taken.step_number) == (
            alone.terminated,
            step,
        ) or taken.step_number < alone.step_number
        if step in {1, 11, 12, 20}:  # a fire is lit in step 12
            taken.run(table_policy(5).for_brigades(5))
            assert looked(taken).digest() == looked(alone).digest()


def test_brigades_that_die(tmp_path):
    scenario = deadly(tmp_path)
    worlds = envs.worlds([scenario, HOT], 4, seeds=1, observation="graph")
    seen, dead = worlds.reset(), 0
    features = envs.worlds([scenario, HOT], 4, seeds=1)
    flags = features.reset()
    for _ in range(60):
        actions = by_table(flags["features"], flags["alive"])
        done = worlds.step(actions)
        flags, seen = features.step(actions).observation, done.observation
        assert worlds.digest() == features.digest()
        fallen = ~seen["alive"]
        dead += int(fallen[:, :2].sum())
        assert seen["action_mask"][fallen][:, 0].all()
        assert not seen["action_mask"][fallen][:, 1:].any()
        assert (seen["brigades"][fallen][:, 4] == 0.0).all()
        for index in np.flatnonzero(done.terminated | done.truncated).tolist():
            episode = int(done.info["episode_number"][index])
            alone = reference([scenario, HOT][(index + episode) % 2], int(done.info["seed"][index]))
            assert worlds.world(index).digest() == looked(alone).digest()
    assert dead > 0
