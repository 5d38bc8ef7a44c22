"""What a step is worth: the reward by terms, its change, and both scores against libraries' exp and sqrt."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fireworld.kernels.outcome import exp_of_minus
from tests.kernels.small import make_city, make_world, square

SIDE_BY_SIDE = [square(100.0 * k, 0.0) for k in range(9)]


def assess(world, codes, hp=None):
    """Set the codes and the civilians' health, assess, and return the reward's terms, total and sum."""
    world.state.fire.fieryness[:] = codes
    if hp is not None:
        world.state.civilians.hp[:] = hp
    world._assess()
    return world.state.outcome.reward.tolist()


def people(n):
    return [(8, 0.0, 0.0)] * n


def test_the_reward_is_a_sum_of_four_terms():
    """Codes 4 to 7 cost 1 each, 1 to 3 cost 2, 8 costs 3; a civilian of 1000 HP costs what it has lost."""
    world = make_world(make_city(*SIDE_BY_SIDE), civilians=people(3))
    assert assess(world, range(9), [1000, 400, 0]) == [-4, -6, -3, -1600, -1613, -1613]
    assert world.state.outcome.counts.tolist() == [3, 4, 1, 2]
    assert assess(world, [0] * 9, [1000, 400, 0]) == [0, 0, 0, -1600, -1600, -3213], "it is a stock: it comes again"


def test_the_reward_may_be_the_change_of_the_stock():
    world = make_world(make_city(*SIDE_BY_SIDE), civilians=people(2), ignited=[0, 1], reward_change=True)
    assert world.state.outcome.reward.tolist() == [0.0] * 6, "nothing for the start"
    assert assess(world, [1, 1, 1, 1, 0, 0, 0, 0, 0], [1000, 990]) == [0, -4, 0, -10, -14, -14]
    assert assess(world, [5, 8, 1, 1, 0, 0, 0, 0, 0], [1000, 0]) == [-1, 4, -3, -990, -990, -1004]
    assert assess(world, [5, 8, 1, 1, 0, 0, 0, 0, 0]) == [0, 0, 0, 0, 0, -1004]


def test_the_changes_add_up_to_the_last_stock():
    random = np.random.default_rng(5)
    stock, change = (
        make_world(make_city(*SIDE_BY_SIDE), civilians=people(2), ignited=[0], reward_change=flag)
        for flag in (False, True)
    )
    at_start = stock.state.outcome.stock.sum()
    for _ in range(20):
        codes, hp = random.integers(0, 9, 9), random.integers(0, 1001, 2)
        last = assess(stock, codes, hp)[4]
        total = assess(change, codes, hp)[5]
    assert total == last - at_start


def test_the_score_of_the_papers_time():
    """(alive + HP share) * sqrt(floor area saved / floor area); areas 100, 200 and 300 m2 by their floors."""
    city = make_city(*SIDE_BY_SIDE[:3], floors=[1, 2, 3])
    world = make_world(city, civilians=[(2, 0, 0), (2, 0, 0)])
    factors = [1, 0.66, 0.33, 0, 0.9, 0.75, 0.5, 0.25, 0]
    for codes in ([0, 0, 0], [1, 2, 3], [4, 5, 6], [7, 8, 0], [8, 8, 8], [3, 3, 0]):
        assess(world, codes, [1000, 0])
        saved = sum(factors[code] * area for code, area in zip(codes, (100, 200, 300), strict=True))
        score, score_max, _ = world.state.outcome.score
        assert score == pytest.approx((1 + 0.5) * math.sqrt(saved / 600), rel=1e-15)
        assert score_max == 3.0


def test_the_score_is_full_at_the_start_and_nothing_at_the_end():
    world = make_world(make_city(*SIDE_BY_SIDE), civilians=people(4))
    assert world.state.outcome.score.tolist() == [5.0, 5.0, 4.0]
    assess(world, [8] * 9, 0)
    assert world.state.outcome.score[[0, 2]].tolist() == [0.0, 0.0]


def test_without_civilians_only_the_buildings_count():
    world = make_world(make_city(*SIDE_BY_SIDE))
    assess(world, [8] * 3 + [0] * 6)
    assert world.state.outcome.score.tolist() == [math.sqrt(6 / 9), 1.0, 0.0]


@pytest.mark.parametrize("hp", [(1000, 1000, 1000), (1000, 999, 1), (1, 1, 1), (0, 0, 1000), (0, 0, 0), (640, 333, 0)])
def test_the_score_of_today(hp):
    world = make_world(make_city(*SIDE_BY_SIDE), civilians=people(3))
    assess(world, [0] * 9, hp)
    alive = sum(points > 0 for points in hp)
    expected = alive * math.exp(-5 * (1 - sum(hp) / 3000))
    assert world.state.outcome.score[2] == pytest.approx(expected, rel=1e-14)


@given(st.floats(0.0, 8.0))
def test_the_exponential_is_that_of_the_library(x):
    assert exp_of_minus(x) == pytest.approx(math.exp(-x), rel=3e-14)


def test_the_exponential_at_its_ends():
    assert exp_of_minus(0.0) == 1.0
    assert all(exp_of_minus(k / 64) > exp_of_minus((k + 1) / 64) for k in range(512))


def test_a_world_ends_when_nothing_burns_or_after_its_last_step():
    world = make_world(make_city(*SIDE_BY_SIDE), ignited=[0], n_steps_max=3)
    assert (world.terminated, world.truncated) == (False, False)
    world.step_number = 3
    assert (world.terminated, world.truncated) == (False, True)
    assess(world, [5] + [0] * 8)
    assert (world.terminated, world.truncated) == (True, False), "out at the last step is a success"
    world.step_number = 2
    assert (world.terminated, world.truncated) == (True, False)


def test_what_does_not_burn_is_no_episode():
    world = make_world(make_city(*SIDE_BY_SIDE), ignited=[])
    assert world.terminated
