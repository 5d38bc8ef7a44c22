"""Seeds and exploration of fireworld's own tables, for learners that play the same episodes and explore alike."""

from __future__ import annotations

from fireworld.draws import ACTION, EXPLORE, below, uniform
from fireworld.kernels.observation import N_ACTIONS
from fireworld.training.seeds import episode_seed

__all__ = ["episode_seed", "explored"]


def explored(seed: int, brigade: int, step: int, *, epsilon: float) -> int | None:
    """Return the action that a brigade tries at random in a step, or None if it does what it values most.

    The draws are keyed: they depend on nothing else, and are those of a team that `fireworld train` lets explore.

    Args:
        seed: of the world.
        brigade: its number.
        step: the step it chooses for, the first one is 1.
        epsilon: the probability of exploring, 0 to 1.
    """
    if uniform(seed, EXPLORE, brigade, step) >= epsilon:
        return None
    return below(seed, ACTION, brigade, step, bound=N_ACTIONS)
