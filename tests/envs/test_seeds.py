"""Seeds: no two episodes have the same, whoever plays them, and none of a test is one to learn with."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fireworld import envs
from fireworld.arguments import SEED_MAX, ArgumentError
from fireworld.training.seeds import EPISODES_MAX, TEST_BIT, WORKERS_MAX, Seeds
from tests.envs.towns import SMALL

BASES = st.integers(0, SEED_MAX)
EPISODES = st.tuples(st.integers(0, WORKERS_MAX - 1), st.integers(0, EPISODES_MAX - 1))


@given(base=BASES, played=st.sets(EPISODES, min_size=2, max_size=40), test=st.booleans())
def test_no_two_episodes_have_the_same_seed(base, played, test):
    seeds = Seeds(base, test=test)
    found = {seeds.seed(worker, episode) for worker, episode in played}
    assert len(found) == len(played)
    assert all(0 <= seed <= SEED_MAX for seed in found)


@given(one=BASES, other=BASES, played=EPISODES, tested=EPISODES)
def test_a_seed_of_a_test_is_never_one_to_learn_with(one, other, played, tested):
    assert Seeds(one).seed(*played) < TEST_BIT <= Seeds(other, test=True).seed(*tested)


@settings(max_examples=5)
@given(base=BASES)
def test_many_in_a_row_are_all_different(base):
    found = [Seeds(base).seed(worker, episode) for worker in range(0, 2048, 16) for episode in range(20)]
    assert len(set(found)) == len(found)
    halves = np.array(found) < TEST_BIT // 2
    assert 0.4 < halves.mean() < 0.6


def test_bases_that_are_near_share_nothing_systematic():
    one, other = (
        [Seeds(base).seed(worker, episode) for worker in range(32) for episode in range(32)] for base in (1, 2)
    )
    assert len(set(one) & set(other)) <= 2


def test_seeds_are_the_same_everywhere():
    assert [Seeds(0).seed(0, 0), Seeds(7).seed(3, 11), Seeds(7, test=True).seed(3, 11)] == [
        1095874845,
        1174353564,
        3321837212,
    ]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Seeds(-1), "base: expected a whole number"),
        (lambda: Seeds(2**32), "base: expected a whole number"),
        (lambda: Seeds(0).seed(2048, 0), "worker: expected a whole number from 0 to 2047, got 2048"),
        (lambda: Seeds(0).seed(0, 2**20), "episode: expected a whole number from 0 to 1048575, got 1048576"),
        (lambda: Seeds(0).seed(0, -1), "episode: expected a whole number"),
    ],
)
def test_numbers_out_of_bounds(call, message):
    with pytest.raises(ArgumentError, match=message):
        call()


def test_processes_that_share_a_base_share_no_seed():
    """Two processes with four worlds each are one with eight."""
    parts = [envs.worlds(SMALL, 4, seeds=3, first_worker=first) for first in (0, 4)]
    whole = envs.worlds(SMALL, 8, seeds=3)
    seen = []
    for _ in range(5):
        for one in (*parts, whole):
            one.reset()
        found = np.concatenate([one.info()["seed"] for one in parts])
        assert found.tolist() == whole.info()["seed"].tolist()
        seen += found.tolist()
    assert len(set(seen)) == len(seen) == 40


def test_bases_of_numpy():
    worlds = envs.worlds(SMALL, seeds=Seeds(np.int64(3)))
    worlds.reset(seed=np.uint32(4))
    assert worlds.seeds == Seeds(4)
    assert worlds.snapshot()
    other = envs.worlds(SMALL, seeds=Seeds(np.int64(3)))
    other.restore(worlds.snapshot())
    assert other.seeds == Seeds(4)


def test_worlds_to_test_with():
    worlds = envs.worlds(SMALL, 3, seeds=Seeds(3, test=True))
    worlds.reset()
    assert (worlds.info()["seed"] >= TEST_BIT).all()
    worlds.reset(seed=4)
    assert worlds.seeds == Seeds(4, test=True)
    assert (worlds.info()["seed"] >= TEST_BIT).all()
