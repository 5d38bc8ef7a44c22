"""What learners are shown of the four targets has the bits that rankings weigh."""

from __future__ import annotations

import numpy as np
import pytest

from fireworld.kernels.ranking import N_TARGET_FEATURES, N_WEIGHTS
from fireworld.kernels.targets import describe_targets
from fireworld.policy.kernel import from_rankings
from fireworld.policy.protocol import Policy
from tests.kernels.small import burn, make_city, make_world, sight_of, square
from tests.simulation.town import begin, play, town_world


class Watcher(Policy):
    """Notes what every brigade sees of its targets, and what single weights make of them."""

    def __init__(self):
        self.seen, self.weighed = [], []
        self.single = [from_rankings(np.eye(N_WEIGHTS)[k : k + 1], own_targets=True) for k in range(N_TARGET_FEATURES)]
        self.asked = None

    def begin(self, city, n_brigades, seed):
        self.asked = from_rankings(np.random.default_rng(5).normal(size=(2, N_WEIGHTS)), own_targets=False)
        for policy in (*self.single, self.asked):
            policy.begin(city, n_brigades, seed)

    def decide(self, observation):
        self.seen.append(observation.target_features)
        self.weighed.append(np.array([policy.decide(observation).q_values for policy in self.single]).T)
        return self.asked.decide(observation)


@pytest.mark.parametrize("seed", range(3))
def test_they_are_what_rankings_weigh(seed):
    watcher = Watcher()
    play(town_world(seed=seed, n_fires=6), watcher)
    seen, weighed = np.array(watcher.seen), np.array(watcher.weighed)
    assert seen.shape == weighed.shape
    assert seen.shape[1:] == (4, N_TARGET_FEATURES)
    assert seen.tobytes() == weighed.tobytes()
    assert (seen.reshape(-1, N_TARGET_FEATURES).std(axis=0) > 0).sum() >= 12, "nearly everything changes"


def test_without_a_site_nothing_is_written():
    world = make_world(make_city(square(0, 0), square(200, 0)), brigades=[0])
    burn(world, 1)
    for site, is_seen in ((0, False), (1, True)):
        world.state.brigades.site[0] = site
        out = np.full((4, N_TARGET_FEATURES), -7.0)
        assert is_seen == describe_targets(0, 1, np.full(1, -1, dtype=np.int32), sight_of(world), out)
        assert (out == -7.0).any() != is_seen


def test_observations_have_them_before_a_step():
    world = town_world(seed=1)
    begin(from_rankings(np.zeros((1, N_WEIGHTS)), own_targets=False), world)
    for seen in world.observe():
        assert seen.target_features.shape == (4, N_TARGET_FEATURES)
        hot = [seen.temperature[b] / 500.0 for b in seen.targets]
        assert seen.target_features[:, 0].tolist() == hot
