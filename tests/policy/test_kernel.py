"""Policies as data: what they choose, how they explore, and that decide() and the compiled episode choose alike."""

from __future__ import annotations

import numpy as np
import pytest

from fireworld.draws import ACTION, EXPLORE, below, uniform
from fireworld.kernels.choice import choose, greedy, table_state
from fireworld.policy.chief import chief_table
from fireworld.policy.kernel import always, at_random, each_another, from_tables
from fireworld.policy.names import find_policy
from fireworld.policy.protocol import Policy
from fireworld.scenario import load_scenario
from fireworld.simulation.built import build_scenario
from tests.simulation.town import begin, town_world


def choices(policy, states, *, n_brigades=3, seed=1, step=1):
    """What each brigade does in its state."""
    ready = policy.for_brigades(n_brigades)
    return [int(choose(brigade, state, ready, seed, step)) for brigade, state in enumerate(states)]


@pytest.mark.parametrize(
    ("values", "expected"), [((0, 0, 0, 0), 0), ((1, 3, 3, 2), 1), ((-5, -4, -3, -3), 2), ((0, 0, 0, 1e-300), 3)]
)
def test_greedy_ties_go_to_the_lowest_action(values, expected):
    assert greedy(np.array(values, dtype=np.float64)) == expected


@pytest.mark.parametrize("action", range(4))
def test_always_the_same(action):
    assert choices(always(action), [0, 17, 4319]) == [action] * 3


def test_each_another_takes_turns():
    assert choices(each_another(), [5] * 6, n_brigades=6) == [0, 1, 2, 3, 0, 1]


def test_random_is_the_keyed_draw():
    for step in range(1, 50):
        expected = [below(9, ACTION, brigade, step, bound=4) for brigade in range(3)]
        assert choices(at_random(), [0, 0, 0], seed=9, step=step) == expected


def test_random_takes_every_action_as_often():
    ready = at_random().for_brigades(1)
    counts = np.bincount([choose(0, 0, ready, 3, step) for step in range(4000)], minlength=4)
    assert (abs(counts - 1000) < 4 * np.sqrt(750)).all()


def test_tables_of_270_states_leave_out_the_flags():
    assert [table_state(state, 4320) for state in (0, 15, 16, 4319)] == [0, 15, 16, 4319]
    assert [table_state(state, 270) for state in (0, 15, 16, 4319)] == [0, 0, 1, 269]
    small = np.random.default_rng(3).normal(size=(1, 270, 4))
    large = np.repeat(small, 16, axis=1)
    for state in range(0, 4320, 7):
        assert choices(from_tables(small), [state]) == choices(from_tables(large), [state])


def test_every_brigade_follows_its_table():
    tables = np.zeros((2, 4320, 4))
    tables[0, :, 1] = tables[1, :, 3] = 1.0
    assert choices(from_tables(tables), [0] * 5, n_brigades=5) == [1, 3, 1, 3, 1], "more brigades than tables: in turn"


def test_exploring_is_the_keyed_draw():
    tables = np.zeros((1, 4320, 4))
    tables[:, :, 2] = 1.0
    policy = from_tables(tables, epsilon=0.3)
    world = town_world(seed=4)
    begin(policy, world)
    explored = []
    for step in range(1, 40):
        for brigade, decision in enumerate(world.step(policy).decisions):
            if decision.action < 0:
                continue
            assert decision.explored == (uniform(4, EXPLORE, brigade, step) < 0.3)
            expected = below(4, ACTION, brigade, step, bound=4) if decision.explored else 2
            assert (decision.action, decision.q_values, decision.epsilon) == (expected, (0, 0, 1, 0), 0.3)
            explored.append(decision.explored)
        if world.terminated:
            break
    assert 0.1 < np.mean(explored) < 0.5


def test_the_digest_tells_policies_apart():
    tables = np.zeros((2, 270, 4))
    other = tables.copy()
    other[1, 269, 3] = 1e-9
    policies = [always(0), always(1), at_random(), each_another(), from_tables(tables), from_tables(other)]
    policies += [from_tables(tables, epsilon=0.1), from_tables(tables[:1])]
    assert len({policy.digest for policy in policies}) == len(policies)
    assert from_tables(tables.copy()).digest == from_tables(tables).digest


def test_the_chief_has_an_opinion_of_every_state():
    table = chief_table()
    assert table.shape == (4320, 4)
    assert np.isfinite(table).all()
    assert len(set(table.argmax(axis=1))) > 1, "it does not always say the same"


@pytest.mark.parametrize("name", ["best", "best-2026", "paper-cooperative", "chief"])
def test_one_policy_in_two_runs_of_unequal_teams_at_a_time(name):
    """As environments have it that share a policy: each run is as if it were alone."""
    policy = find_policy(name).policy
    quick = load_scenario("quick").with_values({"fires.0.n_buildings": 6})
    built = [build_scenario(quick.with_values({"brigades.n": n})) for n in (1, 12)]

    class Asking(Policy):
        """Hands every question on: the kernels follow no class of a user."""

        def decide(self, observation):
            return policy.decide(observation)

    def digests(*groups):
        found = []
        for group in groups:
            worlds = [one.world(seed=3, n_steps_max=20) for one in group]
            for world in worlds:
                policy.begin(world.city_arrays, world.n_brigades, world.seed)
            for _ in range(20):
                for world in worlds:
                    if not (world.terminated or world.truncated):
                        world.step(Asking())
            found += [world.digest() for world in worlds]
        return found

    assert digests(built) == digests(built[::-1])[::-1] == digests(built[:1], built[1:])
