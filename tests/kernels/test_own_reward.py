"""What a brigade gets for its own doing."""

from __future__ import annotations

import numpy as np
import pytest

import fireworld as fw
from fireworld.kernels.arrays import TOTAL
from fireworld.kernels.own_reward import note_worth, own_rewards
from fireworld.rewards import TERMS
from fireworld.training.log.reader import open_training
from tests.kernels.small import make_city, make_world, square

WEIGHTS = (-1.0, -2.0, -3.0, 1.0)
CURRICULUM = """
stages:
  - {name: together, cooperation: true, scenarios: [quick]}
"""


@pytest.mark.parametrize(
    ("before", "after", "litres", "own"),
    [(2, 5, 100, 1.0), (3, 8, 100, -1.0), (1, 3, 100, 0.0), (0, 4, 100, -1.0), (0, 0, 100, 0.0), (2, 5, 0, 0.0)],
    ids=["extinguished", "burnt out", "burns on", "wetted", "cold", "sprayed by another"],
)
def test_what_its_building_became(before, after, litres, own):
    world = make_world(make_city(square(0, 0), square(30, 0)), ignited=[0], brigades=[1, 1])
    brigades, codes, rewards = world.state.brigades, np.zeros(2, dtype=np.uint8), np.full(2, 9.0)
    brigades.target[:], brigades.sprayed[:] = [0, -1], [litres, 0]
    codes[0] = before
    note_worth(brigades, codes, WEIGHTS, rewards)
    codes[0] = after
    own_rewards(brigades, codes, WEIGHTS, rewards)
    assert rewards.tolist() == [own, 0.0]


@pytest.mark.slow
def test_brigades_learn_from_it_and_it_is_in_the_log(tmp_path):
    curriculum = tmp_path / "small.yaml"
    curriculum.write_text(CURRICULUM)
    settings = {"n_episodes_max": 4, "n_episodes_unchanged": 4, "reward": "own"}
    fw.train(curriculum, set=settings, record=tmp_path / "a.mcap")
    log = open_training(tmp_path / "a.mcap")
    found = log.episode("quick", 0)
    assert found.reward.shape == (len(TERMS), found.record.n_steps)
    assert found.own_reward.shape == (len(found.state), found.record.n_steps)
    assert set(np.unique(found.own_reward)) <= {-1.0, 0.0, 1.0}
    assert 0 < np.count_nonzero(found.own_reward) < found.own_reward.size
    assert len({tuple(row) for row in found.own_reward.tolist()}) > 1, "each its own"
    assert found.learned_reward(0, found.record.n_steps) == 0.0
    learned = [found.learned_reward(0, row) for row in range(found.record.n_steps)]
    assert learned == found.own_reward[0].tolist()
    first = int(np.flatnonzero(~np.isnan(found.td_error[0]))[0])
    value = found.value_before[0, first] + 0.7 * found.td_error[0, first]
    assert found.value_after[0, first] == pytest.approx(value)
    assert len(found.record.trace(len(found.state)).reward) == TOTAL + len(found.state)
