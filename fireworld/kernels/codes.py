"""Whether a building burns, and its official code; MODEL 2."""

from __future__ import annotations

from fireworld.kernels.arrays import BuildingArrays, FireState
from fireworld.kernels.jit import inner


@inner
def is_burning(b: int, buildings: BuildingArrays, fire: FireState) -> bool:
    """Return whether a building burns: hot enough, fuel left, inflammable (codes 1 to 3).

    All three are looked at: which of them fails can hardly be foretold, and a wrong guess costs more than all.
    """
    hot = fire.energy[b] >= buildings.ignition_energy[b]
    return hot & (fire.fuel[b] > 0.0) & (buildings.inflammable[b] != 0)


@inner
def fieryness_of(burning: bool, fuel: float, full: float, inflammable: int, watered: int) -> int:
    """Return the official code 0 to 8 of a building. fuel, full: energy left and at the start."""
    if inflammable == 0:
        return 0
    third = 1 if fuel >= full * 0.66 else 2 if fuel >= full * 0.33 else 3
    if burning:
        return third
    if fuel == full:
        return 4 if watered != 0 else 0
    return 4 + third if fuel > 0.0 else 8


@inner
def is_alight(code: int) -> bool:
    """Return whether a code is one of what burns."""
    return (code >= 1) & (code <= 3)


@inner
def can_catch(code: int) -> bool:
    """Return whether a code is one of what has never burned; what of it is inflammable can catch fire."""
    return (code == 0) | (code == 4)
