"""The scores and the counts of a step, the scores against libraries' exp and sqrt."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fireworld.kernels.outcome import exp_of_minus
from tests.kernels.small import SIDE_BY_SIDE, make_city, make_world, people, put


def test_the_score_of_the_papers_time():
    """(alive + HP share) * sqrt(floor area saved / floor area); areas 100, 200 and 300 m2 by their floors."""
    city = make_city(*SIDE_BY_SIDE[:3], floors=[1, 2, 3])
    world = make_world(city, civilians=[(2, 0, 0), (2, 0, 0)])
    factors = [1, 0.66, 0.33, 0, 0.9, 0.75, 0.5, 0.25, 0]
    for codes in ([0, 0, 0], [1, 2, 3], [4, 5, 6], [7, 8, 0], [8, 8, 8], [3, 3, 0]):
        put(world, codes, [1000, 0])
        saved = sum(factors[code] * area for code, area in zip(codes, (100, 200, 300), strict=True))
        score, score_max, _ = world.state.outcome.score
        assert score == pytest.approx((1 + 0.5) * math.sqrt(saved / 600), rel=1e-15)
        assert score_max == 3.0


def test_the_counts():
    world = make_world(make_city(*SIDE_BY_SIDE), civilians=people(3))
    put(world, range(9), [1000, 400, 0])
    assert world.state.outcome.counts.tolist() == [3, 4, 1, 2]
    outcome = world.outcome
    assert (outcome.n_burning, outcome.n_water_damaged, outcome.n_burnt_out) == (3, 4, 1)
    assert (outcome.n_civilians_alive, outcome.n_civilians, outcome.n_buildings) == (2, 3, 9)
    assert (outcome.steps, outcome.completed, outcome.score_max) == (0, False, 4.0)


def test_the_score_is_full_at_the_start_and_nothing_at_the_end():
    world = make_world(make_city(*SIDE_BY_SIDE), civilians=people(4))
    assert world.state.outcome.score.tolist() == [5.0, 5.0, 4.0]
    put(world, [8] * 9, 0)
    assert world.state.outcome.score[[0, 2]].tolist() == [0.0, 0.0]


def test_without_civilians_only_the_buildings_count():
    world = make_world(make_city(*SIDE_BY_SIDE))
    put(world, [8] * 3 + [0] * 6)
    assert world.state.outcome.score.tolist() == [math.sqrt(6 / 9), 1.0, 0.0]


@pytest.mark.parametrize("hp", [(1000, 1000, 1000), (1000, 999, 1), (1, 1, 1), (0, 0, 1000), (0, 0, 0), (640, 333, 0)])
def test_the_score_of_today(hp):
    world = make_world(make_city(*SIDE_BY_SIDE), civilians=people(3))
    put(world, [0] * 9, hp)
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
    put(world, [5] + [0] * 8)
    assert (world.terminated, world.truncated) == (True, False), "out at the last step is a success"
    world.step_number = 2
    assert (world.terminated, world.truncated) == (True, False)


def test_what_does_not_burn_is_no_episode():
    world = make_world(make_city(*SIDE_BY_SIDE), ignited=[])
    assert world.terminated
