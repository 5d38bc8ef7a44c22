"""The rule `chief`: one brigade between the fire and the civilians, the others at the nearest front."""

from __future__ import annotations

from typing import Final

import numpy as np

from fireworld.kernels.arrays import Array
from fireworld.policy.kernel import KernelPolicy, from_tables
from fireworld.policy.protocol import Action
from fireworld.policy.words import N_STATES, features_of
from fireworld.records import ACTIONS

HIGH: Final = 2


def chief_table() -> Array:
    """Return the rule as a table of action values, (4320, 4): 1 for the action it names, 0 for the others.

    A brigade protects civilians near the fire, unless another one does; else it fights the front.
    """
    table = np.zeros((N_STATES, len(ACTIONS)))
    for state in range(N_STATES):
        _, _, distance_from_civilian, _, _, others_protect, *_ = features_of(state)
        protects = distance_from_civilian < HIGH and not others_protect
        table[state, Action.NEAREST_TO_CIVILIAN if protects else Action.NEAREST_TO_ME] = 1.0
    return table


def chief() -> KernelPolicy:
    """Return the chief's policy; all brigades follow the same rule."""
    return from_tables(chief_table()[np.newaxis])
