"""A rule of thumb that a sensible chief would give: first the people, then the edge of the fire, never all at one spot."""

from __future__ import annotations

import numpy as np

from fireworld.kernels.arrays import Array
from fireworld.policy.kernel import KernelPolicy, from_tables
from fireworld.policy.protocol import Action

RADIX = (5, 3, 3, 6, 2, 2, 2, 2)


def rank(free_edges: int, distance_from_center: int, distance_from_civilian: int, volume: int) -> list[Action]:
    """Rank the actions by what the fire asks for, whatever the others do."""
    del free_edges, distance_from_center
    if distance_from_civilian < 2 or volume <= 1:
        return [Action.NEAREST_TO_CIVILIAN, Action.NEAREST_TO_ME, Action.NEAREST_TO_CENTER, Action.EASIEST]
    return [Action.NEAREST_TO_ME, Action.NEAREST_TO_CIVILIAN, Action.NEAREST_TO_CENTER, Action.EASIEST]


def chief_table() -> Array:
    """Return the rule as a table, (4320, 4): the best free action first, an action another brigade does costs."""
    table = np.zeros((*RADIX, 4))
    for features in np.ndindex(*RADIX):
        ranked = rank(*features[:4])
        for place, action in enumerate(ranked):
            table[features][action] = -place
    return table.reshape(-1, 4)


def chief() -> KernelPolicy:
    """Return the chief's policy; all brigades follow the same rule."""
    return from_tables(chief_table()[np.newaxis])
