"""Rewards: the paper's terms and others of one's own by hand, and that all engines agree on them."""

from __future__ import annotations

from dataclasses import fields
from typing import get_args

import numpy as np
import pytest

from fireworld.records import Rewards
from fireworld.rewards import CHANGE, KINDS, STOCK, TERMS, Kind, Tally, amounts, paper_weights, reward_of, rewarded
from fireworld.simulation.observer import Observer
from fireworld.simulation.state import rewards_of
from tests.kernels.small import SIDE_BY_SIDE, make_city, make_world, people, put
from tests.simulation.town import begin, play, policy_named, town_world

WEIGHTS = {"burning": -1.0, "civilians": 0.01}
OTHERS = [
    reward_of("change"),
    reward_of("stock", WEIGHTS),
    reward_of("change", {"water_damaged": 2.5, "burnt_out": -7.0}),
]


def test_what_there_is_fits_together():
    """A term needs a weight, an amount and a recorded field; a kind needs its name in the type."""
    assert [item.name for item in fields(Rewards)] == [*(term.name for term in TERMS), "total", "sum_so_far"]
    assert len(amounts(Tally(0, 0, 0, 0, 0, 0))) == len(TERMS)
    assert get_args(Kind) == tuple(KINDS)
    assert [list(KINDS)[STOCK], list(KINDS)[CHANGE]] == ["stock", "change"]


def test_the_papers_weights():
    assert reward_of("stock") == reward_of("stock", paper_weights()) == (STOCK, (-1.0, -2.0, -3.0, 1.0))
    assert reward_of("change", {"burnt_out": -0.5}) == (CHANGE, (0.0, 0.0, -0.5, 0.0)), "what is left out counts 0"


def test_the_amounts():
    tally = Tally(n_burning=3, n_water_damaged=4, n_burnt_out=1, n_civilians_alive=2, hp=1400, full_hp=3000)
    assert amounts(tally) == (4.0, 3.0, 1.0, -1600.0)


def test_the_kinds():
    assert [rewarded(list(KINDS).index(kind), -5.0, -7.0) for kind in ("stock", "change")] == [-5.0, 2.0]


def test_the_reward_is_a_sum_of_four_terms():
    """Codes 4 to 7 cost 1 each, 1 to 3 cost 2, 8 costs 3; a civilian of 1000 HP costs what it has lost."""
    world = make_world(make_city(*SIDE_BY_SIDE), civilians=people(3))
    assert put(world, range(9), [1000, 400, 0]) == [-4, -6, -3, -1600, -1613, -1613]
    assert put(world, [0] * 9, [1000, 400, 0]) == [0, 0, 0, -1600, -1600, -3213], "it is a stock: it comes again"


def test_the_reward_may_be_the_change_of_the_stock():
    world = make_world(make_city(*SIDE_BY_SIDE), civilians=people(2), ignited=[0, 1], reward=reward_of("change"))
    assert world.state.outcome.reward.tolist() == [0.0] * 6, "nothing for the start"
    assert put(world, [1, 1, 1, 1, 0, 0, 0, 0, 0], [1000, 990]) == [0, -4, 0, -10, -14, -14]
    assert put(world, [5, 8, 1, 1, 0, 0, 0, 0, 0], [1000, 0]) == [-1, 4, -3, -990, -990, -1004]
    assert put(world, [5, 8, 1, 1, 0, 0, 0, 0, 0]) == [0, 0, 0, 0, 0, -1004]


def test_weights_of_ones_own():
    """Three burning buildings at -1, and 1600 HP lost at 0.01; what is watered or burnt out counts 0."""
    world = make_world(make_city(*SIDE_BY_SIDE), civilians=people(3), reward=reward_of("stock", WEIGHTS))
    assert put(world, range(9), [1000, 400, 0]) == [0, -3, 0, -16, -19, -19]
    assert put(world, [0] * 9, [1000, 400, 0]) == [0, 0, 0, -16, -16, -35]


def test_the_change_of_a_weighted_stock():
    """From two burning buildings to four, and 10 HP; then two of them go out, and one civilian dies of 990 HP."""
    reward = reward_of("change", WEIGHTS)
    world = make_world(make_city(*SIDE_BY_SIDE), civilians=people(2), ignited=[0, 1], reward=reward)
    assert put(world, [1, 1, 1, 1, 0, 0, 0, 0, 0], [1000, 990]) == pytest.approx([0, -2, 0, -0.1, -2.1, -2.1])
    assert put(world, [5, 8, 1, 1, 0, 0, 0, 0, 0], [1000, 0]) == pytest.approx([0, 2, 0, -9.9, -7.9, -10.0])


def test_the_changes_add_up_to_the_last_stock():
    random = np.random.default_rng(5)
    stock, change = (
        make_world(make_city(*SIDE_BY_SIDE), civilians=people(2), ignited=[0], reward=reward_of(kind))
        for kind in ("stock", "change")
    )
    at_start = stock.state.outcome.stock.sum()
    for _ in range(20):
        codes, hp = random.integers(0, 9, 9), random.integers(0, 1001, 2)
        last = put(stock, codes, hp)[4]
        total = put(change, codes, hp)[5]
    assert total == last - at_start


@pytest.mark.parametrize("reward", OTHERS)
def test_step_by_step_and_in_one_call_are_worth_the_same(reward):
    for seed in (1, 2):
        stepped, run, again = (town_world(seed=seed, n_fires=4, reward=reward) for _ in range(3))
        last = play(stepped, policy_named("each-another"))
        for world in (run, again):
            world.run(policy_named("each-another").for_brigades(world.n_brigades))
        assert run.step_number == last
        for name in ("reward", "stock"):
            ends = {getattr(world.state.outcome, name).tobytes() for world in (stepped, run, again)}
            assert len(ends) == 1, name
        assert run.outcome.total_reward != town_run(seed).total_reward, "the paper's is another one"


def town_run(seed):
    """The outcome of the same run with the paper's reward."""
    world = town_world(seed=seed, n_fires=4)
    world.run(policy_named("each-another").for_brigades(world.n_brigades))
    return world.outcome


@pytest.mark.parametrize("reward", OTHERS)
def test_what_is_recorded_adds_up(reward):
    world = town_world(seed=3, reward=reward)
    policy, observer = begin(policy_named("each-another"), world), Observer(world)
    so_far = 0.0
    assert observer.record().rewards == Rewards(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    while not (world.terminated or world.truncated):
        recorded = observer.record(world.step(policy)).rewards
        terms = [getattr(recorded, term.name) for term in TERMS]
        so_far += recorded.total
        assert (recorded.total, recorded.sum_so_far) == (sum(terms), so_far)
        unweighted = [weight == 0.0 for weight in reward.weights]
        assert not np.any(np.array(terms)[unweighted])
    assert rewards_of(world.state).sum_so_far == world.outcome.total_reward


def test_the_reward_changes_nothing_else():
    one, other = (town_world(seed=2, reward=reward) for reward in (None, OTHERS[1]))
    for world in (one, other):
        world.run(policy_named("table").for_brigades(world.n_brigades))
    assert one.outcome.score == other.outcome.score
    assert one.state.fire.energy.tobytes() == other.state.fire.energy.tobytes()
    assert one.state.brigades.x.tobytes() == other.state.brigades.x.tobytes()
