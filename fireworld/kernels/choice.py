"""How the kernels choose in a state: a fixed action, a random one, or epsilon-greedy in a table."""

from __future__ import annotations

from fireworld.draws import ACTION, EXPLORE
from fireworld.kernels.arrays import Array, PolicyArrays
from fireworld.kernels.draws import below, uniform
from fireworld.kernels.jit import inner, kernel
from fireworld.kernels.observation import N_ACTIONS

FIXED, RANDOM, TABLE, RANK_NAMED, RANK_ALL, GIVEN, ALLOCATE, ASSIGN = 0, 1, 2, 3, 4, 5, 6, 7
"""Kinds of policies: always one action, a random one, greedy in a table; four that do not choose in a state but among
targets, `fireworld.kernels.ranks`, `sharing` and `assignment`; of GIVEN, whoever runs the step says what it does."""


@inner
def greedy(values: Array) -> int:
    """Return the action with the highest value (ties: lowest action). values: (4,) float64."""
    best = 0
    for action in range(1, N_ACTIONS):
        if values[action] > values[best]:
            best = action
    return best


@inner
def tries_another(brigade: int, epsilon: float, seed: int, step: int) -> bool:
    """Return whether a brigade that explores with probability epsilon does so in this step."""
    return epsilon > 0.0 and uniform(seed, EXPLORE, brigade, step) < epsilon


@kernel
def explores(brigade: int, policy: PolicyArrays, seed: int, step: int) -> bool:
    """Return whether a brigade takes a random action in this step instead of the one its table prefers."""
    return policy.kind[brigade] == TABLE and tries_another(brigade, policy.epsilon[0], seed, step)


@kernel
def choose(brigade: int, state: int, policy: PolicyArrays, seed: int, step: int) -> int:
    """Return the action a brigade picks in a state 0..4319, or 0..269 where the tables leave the flags out."""
    kind = policy.kind[brigade]
    if kind == FIXED:
        return policy.action[brigade]
    if kind == RANDOM or explores(brigade, policy, seed, step):
        return below(seed, ACTION, brigade, step, N_ACTIONS)
    return greedy(policy.tables[policy.table_of[brigade], table_state(state, policy.tables.shape[1])])


@kernel
def keeps_choice(brigade: int, last_action: int, commit: int, step: int) -> bool:
    """Return whether a brigade repeats what it chose before.

    Choices are kept for `commit` steps by a clock that all share, brigade after brigade; a brigade that did nothing
    chooses at once.
    """
    return commit > 1 and last_action >= 0 and (step + brigade) % commit != 0


@kernel
def table_state(state: int, n_states: int) -> int:
    """Return the row of a table for a state of 4320: tables of 270 rows leave out the four flags."""
    return state if n_states == 4320 else state // 16
