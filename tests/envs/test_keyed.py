"""Seeds and exploration of fireworld's own tables: those of its trainings, and of the kernels."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import fireworld as fw
from fireworld import envs
from fireworld.arguments import RUN_SEED_MAX, ArgumentError
from fireworld.kernels.choice import choose, explores
from fireworld.policy.kernel import from_tables
from tests.envs.towns import SMALL


@given(
    seed=st.integers(0, RUN_SEED_MAX),
    brigade=st.integers(0, 3),
    step=st.integers(1, 1000),
    epsilon=st.sampled_from([0.0, 0.1, 0.5, 0.9, 1.0]),
)
def test_what_is_explored_is_what_the_kernels_try(seed, brigade, step, epsilon):
    table = np.zeros((1, 4320, 4))
    policy = from_tables(table, epsilon=epsilon).for_brigades(4)
    found = envs.explored(seed, brigade, step, epsilon=epsilon)
    assert (found is not None) == explores(brigade, policy, seed, step)
    if found is not None:
        assert found == choose(brigade, 0, policy, seed, step)


def test_episodes_have_the_seeds_of_trainings(here):
    fw.train("quick", seed=7, set={"n_episodes_max": 3}, record="training.mcap")
    recorded = [line.seed for line in fw.open_training("training.mcap").lines]
    assert recorded == [envs.episode_seed(7, 0, episode) for episode in range(3)]
    assert max(recorded) > 2**32


def test_worlds_take_such_seeds_and_keep_them(here):
    seed = envs.episode_seed(7, 0, 1)
    worlds = envs.worlds(SMALL, 2, record="own.mcap")
    worlds.reset(world_seeds=[seed, RUN_SEED_MAX])
    saved = worlds.snapshot()
    for _ in range(25):
        worlds.step([[1, 2, 3]] * 2)
    after = worlds.digest()
    worlds.restore(saved)
    assert worlds.info()["seed"].tolist() == [seed, RUN_SEED_MAX]
    for _ in range(25):
        worlds.step([[1, 2, 3]] * 2)
    assert worlds.digest() == after
    worlds.close()
    assert fw.verify("own.mcap").same
    with pytest.raises(ArgumentError, match=f"world_seeds: expected a whole number from 0 to {RUN_SEED_MAX}, got "):
        worlds.reset(world_seeds=[0, RUN_SEED_MAX + 1])
