"""Compiled loops that the benchmarks time: steps inside the kernels, and the bare call of a kernel from Python."""

from __future__ import annotations

from fireworld.kernels.arrays import BuildingArrays, CoverArrays, FireConstants, FireState, LinkArrays
from fireworld.kernels.fire import advance_fire
from fireworld.kernels.jit import kernel


@kernel
def advance_steps(
    buildings: BuildingArrays,
    cover: CoverArrays,
    links: LinkArrays,
    fire: FireState,
    constants: FireConstants,
    n_steps: int,
) -> None:
    """Advance the fire by some steps; `fire.rate` is that of all of them."""
    for _ in range(n_steps):
        advance_fire(buildings, cover, links, fire, constants)


@kernel
def do_nothing(
    buildings: BuildingArrays, cover: CoverArrays, links: LinkArrays, fire: FireState, constants: FireConstants
) -> None:
    """Take what a step of the fire takes, and return."""
