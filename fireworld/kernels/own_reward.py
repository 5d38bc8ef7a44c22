"""What each brigade gets for its own doing: how the part of the reward that the building it sprayed is has changed.

Where all get the team's reward, `own` has no rows.
"""

from __future__ import annotations

from fireworld import rewards
from fireworld.kernels.arrays import Array, BrigadeState
from fireworld.kernels.jit import inner, kernel

Weights = tuple[float, float, float, float]
worth_of_building = inner(rewards.worth_of_building)


@kernel
def note_worth(brigades: BrigadeState, fieryness: Array, weights: Weights, own: Array) -> None:
    """Write what the targets of the brigades are worth before they are sprayed into `own`, (b,); 0 without one."""
    for brigade in range(len(own)):
        target = brigades.target[brigade]
        own[brigade] = worth_of_building(fieryness[target], weights) if target >= 0 else 0.0


@kernel
def own_rewards(brigades: BrigadeState, fieryness: Array, weights: Weights, own: Array) -> None:
    """Write the rewards of a step that is done into `own`, (b,), as `note_worth` left it; 0 where none was sprayed."""
    for brigade in range(len(own)):
        target, before = brigades.target[brigade], own[brigade]
        own[brigade] = 0.0
        if target >= 0 and brigades.sprayed[brigade] > 0:
            own[brigade] = worth_of_building(fieryness[target], weights) - before
