"""Compiled loops that the benchmarks time: steps inside the kernels, and the bare call of a kernel from Python."""

from __future__ import annotations

from fireworld.kernels.arrays import Array, BuildingArrays, CoverArrays, FireConstants, FireState, LinkArrays
from fireworld.kernels.deciding import decide_all
from fireworld.kernels.episode_arrays import Warmth
from fireworld.kernels.fire import burn_on
from fireworld.kernels.jit import kernel
from fireworld.kernels.step import opened_episode
from fireworld.kernels.warmth import begin


@kernel
def advance_steps(
    buildings: BuildingArrays,
    cover: CoverArrays,
    links: LinkArrays,
    fire: FireState,
    constants: FireConstants,
    warmth: Warmth,
    n_steps: int,
) -> None:
    """Advance the fire by some steps; `fire.rate` is that of all of them."""
    begin(cover, fire, warmth)
    for _ in range(n_steps):
        burn_on(buildings, cover, links, fire, constants, warmth)


@kernel
def do_nothing(
    buildings: BuildingArrays, cover: CoverArrays, links: LinkArrays, fire: FireState, constants: FireConstants
) -> None:
    """Take what a step of the fire takes, and return."""


@kernel
def decide_again(row: Array, step: int, n_times: int) -> int:
    """Let all brigades of a bound world decide so often after a step, as if each time were one; return how many did.

    `row` (k,) int64 is that of an `Episode` whose sites are those of its fire. What is worked out once a step is anew.
    """
    episode, n_decisions = opened_episode(row), 0
    for k in range(n_times):
        decide_all(step + 1 + k, episode)
        for target in episode.world.brigades.target:
            n_decisions += 1 if target >= 0 else 0
    return n_decisions
