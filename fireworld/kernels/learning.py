"""Temporal-difference learning of the brigades' tables: SARSA as in the paper, and its declared variants."""

from __future__ import annotations

from fireworld.kernels.arrays import Array, Learner
from fireworld.kernels.jit import inner
from fireworld.kernels.observation import N_ACTIONS

SARSA, EXPECTED_SARSA, Q_LEARNING = 0, 1, 2


@inner
def value_of(rule: int, values: Array, action: int, epsilon: float) -> float:
    """Return what the next state, of (4,) values, is worth to the rule of learning.

    SARSA: the value of the action taken; expected SARSA: the mean over the epsilon-greedy choice; Q-learning: the
    highest.
    """
    if rule == SARSA:
        return values[action]
    best, total = values[0], 0.0
    for k in range(N_ACTIONS):
        best = max(best, values[k])
        total += values[k]
    return best if rule == Q_LEARNING else (1.0 - epsilon) * best + epsilon * total / N_ACTIONS


@inner
def update(brigade: int, table: int, next_value: float, learner: Learner) -> None:
    """Move the value of a brigade's last choice towards what came of it.

    Q(s, a) += alpha * (R + D * next_value - Q(s, a)), where R is the discounted reward since that choice and D the
    discount over the steps since: gamma for a choice in the step before, as in the paper; a brigade that was refilling
    in between has had no choice, and its rewards add up (a semi-Markov step).
    """
    state, action = learner.state[brigade], learner.action[brigade]
    if state < 0:
        return
    error = learner.reward[brigade] + learner.discount[brigade] * next_value - learner.tables[table, state, action]
    visits = learner.visits[table, state, action]
    learner.visits[table, state, action] = visits + 1
    learner.tables[table, state, action] += learner.alpha[0] / (1.0 + learner.alpha_decay[0] * visits) * error
    learner.td_error[brigade] = error


@inner
def choose_and_learn(brigade: int, table: int, state: int, action: int, epsilon: float, learner: Learner) -> None:
    """Learn from the choice before, now that the next is known, and remember this one. `state`: a row of the table."""
    value = value_of(learner.rule[0], learner.tables[table, state], action, epsilon)
    update(brigade, table, value, learner)
    learner.state[brigade], learner.action[brigade] = state, action
    learner.reward[brigade], learner.discount[brigade] = 0.0, 1.0


@inner
def go_on_and_learn(brigade: int, table: int, state: int, action: int, learner: Learner) -> None:
    """Learn from the choice that a brigade is bound to when its episode is truncated.

    It would repeat that action, so what comes next is worth the action's value where the brigade is by now: by any
    rule, for there is nothing to choose.
    """
    update(brigade, table, learner.tables[table, state, action], learner)


@inner
def take_reward(reward: float, learner: Learner) -> None:
    """Give the step's reward to every brigade that waits for what comes of its choice."""
    for brigade in range(len(learner.state)):
        if learner.state[brigade] >= 0:
            learner.reward[brigade] += learner.discount[brigade] * reward
            learner.discount[brigade] *= learner.gamma[0]


@inner
def forget(learner: Learner) -> None:
    """Forget the choices of an episode, before its first step."""
    for brigade in range(len(learner.state)):
        learner.state[brigade] = -1
        learner.td_error[brigade] = 0.0
