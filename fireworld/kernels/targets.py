"""What a brigade sees of the four targets that the actions name: for learners, the features that rankings weigh."""

from __future__ import annotations

from fireworld.kernels.arrays import Array
from fireworld.kernels.jit import kernel
from fireworld.kernels.observation import N_ACTIONS, find_target, site_place
from fireworld.kernels.ranking import Sight, see_target


@kernel
def describe_targets(brigade: int, step: int, known: Array, sight: Sight, out: Array) -> bool:
    """Write the features of a brigade's four targets, (4, 13) float64 in the order of the actions; MODEL 7.

    They have the bits that `rank` weighs, whose arguments have the same names. Returns whether the brigade has a site;
    without one, nothing is written.
    """
    if site_place(brigade, sight.brigades.site, sight.sites) < 0:
        return False
    for action in range(N_ACTIONS):
        b = find_target(brigade, action, sight.brigades, sight.buildings, sight.fire, sight.geometry, sight.sites)
        see_target(brigade, b, step, known, sight, out[action])
    return True
