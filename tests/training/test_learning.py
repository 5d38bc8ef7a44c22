"""The rule of learning: updates worked by hand, how episodes end, and a textbook's SARSA beside the compiled one."""

from __future__ import annotations

import numpy as np
import pytest

from fireworld.kernels import learning
from fireworld.kernels.learning import choose_and_learn, forget, go_on_and_learn, take_reward, update, value_of
from fireworld.policy.asking import complete
from fireworld.policy.kernel import from_tables
from fireworld.policy.protocol import Policy
from fireworld.scenario import load_scenario
from fireworld.simulation.built import build_scenario
from fireworld.simulation.choices import Made
from fireworld.simulation.state import fresh_learner
from fireworld.training.methods.sarsa import RULES

ALPHA, GAMMA = 0.5, 0.5


def make_learner(*, rule=0, alpha_decay=0.0, next_values=(0.0, 0.0, 4.0, 0.0)):
    """Return a learner of one brigade that has chosen action 1 in state 0; state 1 is where it gets to."""
    tables = np.zeros((1, 3, 4))
    tables[0, 1] = next_values
    learner = fresh_learner(tables, 1, rule=rule, alpha=ALPHA, alpha_decay=alpha_decay, gamma=GAMMA)
    forget(learner)
    choose_and_learn(0, 0, 0, 1, 0.0, learner)
    return learner


def test_a_first_choice_teaches_nothing():
    learner = make_learner()
    assert not learner.visits.any()
    assert (learner.state[0], learner.action[0]) == (0, 1)


def test_sarsa_by_hand():
    learner = make_learner()
    take_reward(-10.0, learner)
    choose_and_learn(0, 0, 1, 2, 0.0, learner)
    assert learner.tables[0, 0].tolist() == [0.0, ALPHA * (-10.0 + GAMMA * 4.0 - 0.0), 0.0, 0.0]
    assert learner.td_error[0] == -8.0
    assert learner.visits[0, 0].tolist() == [0, 1, 0, 0]
    assert (learner.state[0], learner.action[0]) == (1, 2)


def test_rewards_add_up_while_a_brigade_refills():
    learner = make_learner()
    take_reward(-10.0, learner)
    take_reward(-20.0, learner)
    take_reward(-40.0, learner)
    choose_and_learn(0, 0, 1, 2, 0.0, learner)
    discounted = -10.0 + GAMMA * -20.0 + GAMMA**2 * -40.0
    assert learner.tables[0, 0, 1] == ALPHA * (discounted + GAMMA**3 * 4.0)


def test_the_end_of_an_episode_is_worth_nothing():
    learner = make_learner()
    take_reward(-10.0, learner)
    update(0, 0, 0.0, learner)
    assert learner.tables[0, 0, 1] == ALPHA * -10.0


@pytest.mark.parametrize("rule", range(len(RULES)))
def test_who_is_bound_counts_on_the_action_it_goes_on_with(rule):
    learner = make_learner(rule=rule, next_values=(9.0, -6.0, 4.0, 0.0))
    take_reward(-10.0, learner)
    take_reward(-20.0, learner)
    go_on_and_learn(0, 0, 1, 1, learner)
    assert learner.tables[0, 0, 1] == ALPHA * (-10.0 + GAMMA * -20.0 + GAMMA**2 * -6.0)


def test_who_has_not_chosen_learns_nothing():
    learner = make_learner()
    forget(learner)
    take_reward(-10.0, learner)
    update(0, 0, 0.0, learner)
    assert not learner.visits.any()
    assert learner.reward[0] == 0.0


def test_the_rate_decays_with_visits():
    learner = make_learner(alpha_decay=1.0, next_values=(0.0,) * 4)
    expected = 0.0
    for rate in (ALPHA, ALPHA / 2, ALPHA / 3):
        take_reward(-12.0, learner)
        update(0, 0, 0.0, learner)
        expected += rate * (-12.0 - expected)
        assert learner.tables[0, 0, 1] == expected
        choose_and_learn(0, 0, 0, 1, 0.0, _forgotten(learner))


def _forgotten(learner):
    forget(learner)
    return learner


@pytest.mark.parametrize(
    ("rule", "worth"),
    [("sarsa", -4.0), ("expected-sarsa", 0.8 * 6.0 + 0.2 * (6.0 + 2.0 - 4.0) / 4), ("q-learning", 6.0)],
)
def test_what_the_next_state_is_worth(rule, worth):
    values = np.array([0.0, 6.0, 2.0, -4.0])
    assert value_of(RULES.index(rule), values, 3, 0.2) == worth


def test_the_rules_are_numbered_alike():
    assert [RULES.index(name) for name in ("sarsa", "expected-sarsa", "q-learning")] == [
        learning.SARSA,
        learning.EXPECTED_SARSA,
        learning.Q_LEARNING,
    ]


def world_of(*, n_steps_max, seed=1, **settings):
    scenario = load_scenario("quick").with_settings({"brigades.n": "1", **settings})
    return build_scenario(scenario).world(seed=seed, n_steps_max=n_steps_max)


def learn(world, tables, *, alpha=ALPHA, commit=1):
    policy = from_tables(tables, commit=commit).for_brigades(world.n_brigades)
    learner = fresh_learner(policy.tables, world.n_brigades, alpha=alpha, gamma=GAMMA)
    world.run(policy, learner)
    return learner


def test_a_truncated_episode_counts_on_what_would_come_next():
    world = world_of(n_steps_max=1)
    learner = learn(world, np.full((1, 4320, 4), 8.0))
    assert world.truncated
    reward = world.state.outcome.reward[4]
    ((_, state, action),) = np.argwhere(learner.visits)
    assert learner.tables[0, state, action] == 8.0 + ALPHA * (reward + GAMMA * 8.0 - 8.0)


def test_a_truncated_episode_counts_on_the_choice_that_is_kept():
    """With commit 5, brigade 0 chooses in step 1, and would keep its choice in step 4, after the last."""
    world = world_of(n_steps_max=3)
    learner = learn(world, np.full((1, 4320, 4), 8.0), commit=5)
    assert world.truncated
    ((_, state, action),) = np.argwhere(learner.visits)
    assert learner.discount[0] == GAMMA**3
    error = learner.reward[0] + GAMMA**3 * 8.0 - 8.0
    assert learner.tables[0, state, action] == 8.0 + ALPHA * error


def test_a_terminated_episode_does_not():
    world = world_of(n_steps_max=100, **{"fires.0.n_buildings": "1"})
    learner = learn(world, np.full((1, 270, 4), 1000.0), alpha=1.0)
    assert world.terminated
    assert learner.discount[0] == GAMMA, "the last choice was made in the last step"
    assert learner.tables[0, learner.state[0], learner.action[0]] == world.state.outcome.reward[4]


class Textbook(Policy):
    """SARSA as a textbook has it, for brigades that are asked one after another."""

    def __init__(self, tables, n_brigades, epsilon):
        self.tables = tables
        self.chooser = from_tables(tables, epsilon=epsilon)
        self.chooser.begin(None, n_brigades, 0)
        self.last = {}  # brigade: [state, action, reward so far, discount]

    def decide(self, observation):
        decision = self.chooser.decide(observation)
        state, brigade = observation.state_index, observation.brigade
        self.learn(brigade, self.tables[brigade, state, decision.action])
        self.last[brigade] = [state, decision.action, 0.0, 1.0]
        return decision

    def learn(self, brigade, worth):
        if brigade in self.last:
            state, action, reward, discount = self.last[brigade]
            error = reward + discount * worth - self.tables[brigade, state, action]
            self.tables[brigade, state, action] += ALPHA * error

    def take(self, reward):
        for memory in self.last.values():
            memory[2] += memory[3] * reward
            memory[3] *= GAMMA


@pytest.mark.parametrize(("seed", "n_steps_max", "terminated"), [(1, 100, True), (2, 30, False)])
def test_the_compiled_episode_learns_as_the_textbook(seed, n_steps_max, terminated):
    settings = {"brigades.n": "3", "parameters.brigades.tank_litres": "6000"}
    worlds = [world_of(n_steps_max=n_steps_max, seed=seed, **settings) for _ in range(2)]
    start = np.random.default_rng(seed).normal(size=(3, 4320, 4))
    policy = from_tables(start.copy(), epsilon=0.3).for_brigades(3)
    learner = fresh_learner(policy.tables, 3, alpha=ALPHA, gamma=GAMMA)
    worlds[0].run(policy, learner)
    textbook, world = Textbook(start.copy(), 3, 0.3), worlds[1]
    n_refilling = 0
    while not (world.terminated or world.truncated):
        world.step(textbook)
        textbook.take(float(world.state.outcome.reward[4]))
        n_refilling += int(world.state.brigades.refilling.sum())
    assert world.terminated == terminated
    if terminated:
        for brigade in range(3):
            textbook.learn(brigade, 0.0)
    else:  # the choices that would come next
        world.look()
        world.step_number += 1
        world._decide(complete(textbook), Made.of(world.state.brigades))
    np.testing.assert_array_equal(learner.tables, textbook.tables)
    assert learner.visits.sum() > 40
    assert n_refilling > 5
