"""What a brigade sees of all targets that it may name, for those who ask why it chose one of them."""

from __future__ import annotations

import numpy as np

from fireworld.kernels.allocation import named_range
from fireworld.kernels.arrays import Array
from fireworld.kernels.episode_arrays import Ranks
from fireworld.kernels.jit import kernel
from fireworld.kernels.ranking import Sight, know_building
from fireworld.kernels.ranks import add_up_others, count_in, line_up_before, see_row
from fireworld.kernels.situation import place_others, sum_up


@kernel
def see_targets(brigade: int, step: int, known: Array, sight: Sight, ranks: Ranks, out: Array) -> None:
    """Write what a brigade that is about to decide sees of each building of `named_range`, (k, 30); MODEL 7 and 7.1.

    `known` (b,) is what the brigades go for, as far as this one knows, -1 nothing. The places of the actions stay 0.
    """
    line_up_before(brigade, known, sight.geometry, sight.sites, ranks)
    first, end = named_range(brigade, sight.brigades.site, sight.sites, sight.brigade_constants.free)
    for k in range(first, end):
        know_building(np.int64(sight.sites.member[k]), step, sight)
    add_up_others(brigade, len(known), first, end, ranks)
    sum_up(step, len(known), sight, ranks)
    place_others(brigade, known, sight, ranks)
    count_in(known[brigade], -1.0, sight.sites, ranks)
    see_row(brigade, first, end, True, sight, ranks, out)
    count_in(known[brigade], 1.0, sight.sites, ranks)
