"""Compiled loops that the benchmarks time: steps inside the kernels, and the bare call of a kernel from Python."""

from __future__ import annotations

from fireworld.kernels.arrays import BuildingArrays, CoverArrays, FireConstants, FireState, LinkArrays
from fireworld.kernels.episode_arrays import Warmth
from fireworld.kernels.fire import burn_on
from fireworld.kernels.jit import kernel
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
