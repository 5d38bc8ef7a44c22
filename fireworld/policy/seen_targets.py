"""What a brigade sees of all the targets that it may name by itself."""

from __future__ import annotations

import numpy as np

from fireworld.kernels import seen_targets as kernels
from fireworld.kernels.arrays import Array
from fireworld.kernels.ranks import fresh_ranks
from fireworld.kernels.situation import N_SEEN
from fireworld.policy.protocol import Observation


def seen_targets(observation: Observation) -> tuple[list[int], Array]:
    """Return the burning buildings that a brigade may name, and what it sees of each, (k, 30) float64; MODEL 7 and 7.1.

    The places of the actions are 0.
    """
    burning, n_brigades = observation.burning.tolist(), len(observation.known_targets)
    seen = np.zeros((len(burning), N_SEEN))
    ranks = fresh_ranks(n_brigades, len(observation.world.fire.energy))
    where = observation.brigade, observation.step, observation.known_targets, observation.sight
    kernels.see_targets(*where, ranks, seen)
    return burning, seen
