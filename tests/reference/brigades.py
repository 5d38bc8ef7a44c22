"""Tanks and requests for water in plain Python and numpy: MODEL 2.1 and 2.2, with the official result codes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Self

import numpy as np

from fireworld.city.city import Array
from fireworld.parameters import BrigadeParameters

ACCEPTED: Final = 1
UNKNOWN_BRIGADE: Final = -1
OVER_POWER: Final = -2
TANK_TOO_LOW: Final = -3
OUT_OF_RANGE: Final = -4
NEGATIVE: Final = -5
NOWHERE: Final = -1


@dataclass
class Brigades:
    """The team; k brigades in rising order of id."""

    brigade_id: Array  # (k,) int64
    position_mm: Array  # (k, 2) int64
    at_refuge: Array  # (k,) bool
    hydrant: Array  # (k,) int64, the hydrant a brigade stands at, or NOWHERE
    tank_litres: Array  # (k,) int64
    accepted_litres: Array  # (k,) int64, in the step under way

    @classmethod
    def with_tanks(cls, brigade_id: Array, tank_litres: Array) -> Self:
        """Make a team that stands at the origin, far from water."""
        k = len(brigade_id)
        order = np.argsort(brigade_id)
        return cls(
            brigade_id=brigade_id[order].astype(np.int64),
            position_mm=np.zeros((k, 2), dtype=np.int64),
            at_refuge=np.zeros(k, dtype=np.bool_),
            hydrant=np.full(k, NOWHERE, dtype=np.int64),
            tank_litres=tank_litres[order].astype(np.int64),
            accepted_litres=np.zeros(k, dtype=np.int64),
        )

    def place(self, brigade_id: int, position_mm: tuple[int, int], *, at_refuge: bool, hydrant: int) -> None:
        """Put a brigade somewhere."""
        row = int(np.searchsorted(self.brigade_id, brigade_id))
        self.position_mm[row] = position_mm
        self.at_refuge[row] = at_refuge
        self.hydrant[row] = hydrant


def refill(team: Brigades, parameters: BrigadeParameters) -> None:
    """Begin a step: fill the tanks of those at a refuge and of the lowest id at each hydrant."""
    team.accepted_litres[:] = 0
    _, first = np.unique(team.hydrant, return_index=True)
    drawing = np.zeros(len(team.hydrant), dtype=np.bool_)
    drawing[first] = True
    drawing &= team.hydrant != NOWHERE
    gain = team.at_refuge * parameters.refuge_refill_litres + drawing * parameters.hydrant_refill_litres
    np.minimum(team.tank_litres + gain, parameters.tank_litres, out=team.tank_litres)


def request(
    team: Brigades, parameters: BrigadeParameters, *, brigade_id: int, target_mm: tuple[int, int], litres: int
) -> int:
    """Answer a brigade's request to spray a building, and take the litres from its tank if it is accepted.

    Args:
        team: changed if the request is accepted.
        parameters: tank, power and range.
        brigade_id: who asks.
        target_mm: centroid of the building.
        litres: how much.

    Returns:
        The official result code; the first test that fails decides.
    """
    if brigade_id not in team.brigade_id:
        return UNKNOWN_BRIGADE
    row = int(np.searchsorted(team.brigade_id, brigade_id))
    if litres + team.accepted_litres[row] > parameters.power_litres:
        return OVER_POWER
    if litres > team.tank_litres[row]:
        return TANK_TOO_LOW
    dx, dy = (int(target_mm[axis]) - int(team.position_mm[row, axis]) for axis in (0, 1))
    range_mm = round(parameters.range_m * 1000)
    if dx * dx + dy * dy > range_mm * range_mm:
        return OUT_OF_RANGE
    if litres < 0:
        return NEGATIVE
    team.tank_litres[row] -= litres
    team.accepted_litres[row] += litres
    return ACCEPTED
