"""Temporal-difference learning of the brigades' tables: SARSA as in the paper, and its declared variants."""

from __future__ import annotations

import numpy as np

from fireworld.kernels.arrays import TOTAL, Array, Learner
from fireworld.kernels.choice import table_state
from fireworld.kernels.jit import inner, kernel
from fireworld.kernels.observation import N_ACTIONS

SARSA, EXPECTED_SARSA, Q_LEARNING = 0, 1, 2
NO_CHOICE, GREEDY, EXPLORED, KEPT = 0, 1, 2, 3
"""Positions in fireworld.records.CHOICES."""
UNTRIED = -1e300
"""The value of what was never tried, where the greedy choice leaves that out: its first visit sets it."""


@inner
def known(value: float) -> float:
    """Return what is known of a value: nothing, 0, of what was never tried."""
    return 0.0 if value == UNTRIED else value


@inner
def value_of(rule: int, values: Array, action: int, epsilon: float) -> float:
    """Return what the next state, of (4,) values, is worth to the rule of learning.

    SARSA: the value of the action taken; expected SARSA: the mean over the epsilon-greedy choice; Q-learning: the
    highest.
    """
    if rule == SARSA:
        return known(values[action])
    best, total = values[0], 0.0
    for k in range(N_ACTIONS):
        best = max(best, values[k])
        total += known(values[k])
    best = known(best)
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
    before = learner.tables[table, state, action]
    error = learner.reward[brigade] + learner.discount[brigade] * next_value - known(before)
    visits = learner.visits[table, state, action]
    learner.visits[table, state, action] = visits + 1
    if before == UNTRIED:
        learner.tables[table, state, action] = error
    else:
        learner.tables[table, state, action] += learner.alpha[0] / (1.0 + learner.alpha_decay[0] * visits) * error
    learner.td_error[brigade] = error


@kernel
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
    update(brigade, table, known(learner.tables[table, state, action]), learner)


@kernel
def take_reward(reward: float, learner: Learner) -> None:
    """Give the step's reward, or each its own, to every brigade that waits for what comes of its choice."""
    for brigade in range(len(learner.state)):
        if learner.state[brigade] >= 0:
            its = learner.own[brigade] if len(learner.own) > 0 else reward
            learner.reward[brigade] += learner.discount[brigade] * its
            learner.discount[brigade] *= learner.gamma[0]


@inner
def forget(learner: Learner) -> None:
    """Forget the choices of an episode, before its first step."""
    for brigade in range(len(learner.state)):
        learner.state[brigade] = -1
        learner.td_error[brigade] = 0.0


@inner
def note_choice(brigade: int, row: int, state: int, action: int, choice: int, learner: Learner) -> None:
    """Write a choice into the trace, if there is one; row: the step, from 0."""
    trace = learner.trace
    if row < trace.state.shape[1]:
        trace.state[brigade, row], trace.action[brigade, row], trace.choice[brigade, row] = state, action, choice


@inner
def note_reward(row: int, reward: Array, learner: Learner) -> None:
    """Write the terms of a step's reward into the trace, if there is one."""
    trace = learner.trace
    if row < trace.reward.shape[1]:
        for term in range(TOTAL):
            trace.reward[term, row] = reward[term]
        for brigade in range(len(learner.own)):
            trace.reward[TOTAL + brigade, row] = learner.own[brigade]


@inner
def read_own(row: int, learner: Learner) -> None:
    """Read what brigades got for their own doing out of the trace, where they learn from that."""
    for brigade in range(len(learner.own)):
        learner.own[brigade] = learner.trace.reward[TOTAL + brigade, row]


@kernel
def learn_again(
    table_of: Array, epsilon: float, learner: Learner, n_steps: int, terminated: bool, updates: Array
) -> None:
    """Learn an episode from its trace, without a world: the same updates in the same order.

    Args:
        table_of: (b,) the table of each brigade.
        epsilon: probability of a random action.
        learner: tables as they were before, memory, and the trace; tables, visits and memory change.
        n_steps: steps of the episode.
        terminated: it ended because nothing burned any more.
        updates: (3, b, n_steps + 1), becomes the value that was updated in each step, which is that of the choice
            before; the error; and the value after. nan where there was no update. The last column has the updates that
            end an episode.
    """
    forget(learner)
    trace, n_states = learner.trace, learner.tables.shape[1]
    updates[:] = np.nan
    for row in range(n_steps + 1):
        over = row == n_steps
        for brigade in range(len(table_of)):
            table, choice = table_of[brigade], trace.choice[brigade, row]
            row_before, action_before = learner.state[brigade], learner.action[brigade]
            value = learner.tables[table, row_before, action_before] if row_before >= 0 else np.nan
            if over and terminated:
                update(brigade, table, 0.0, learner)
            elif choice == NO_CHOICE or (choice == KEPT and not over):
                continue
            else:
                state, action = table_state(trace.state[brigade, row], n_states), trace.action[brigade, row]
                if choice == KEPT:
                    go_on_and_learn(brigade, table, state, action, learner)
                else:
                    choose_and_learn(brigade, table, state, action, epsilon, learner)
            if row_before >= 0:
                updates[0, brigade, row], updates[1, brigade, row] = value, learner.td_error[brigade]
                updates[2, brigade, row] = learner.tables[table, row_before, action_before]
        if not over:
            read_own(row, learner)
            total = 0.0
            for term in range(TOTAL):
                total += trace.reward[term, row]
            take_reward(total, learner)
