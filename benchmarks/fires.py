"""Cities and fires of the benchmarks, ready for both engines: the compiled one and the one in plain numpy."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import Final, Literal

import numpy as np

from fireworld.city.build import build_city
from fireworld.city.city import Array, City, Plan
from fireworld.city.generator import generate_plan
from fireworld.kernels import fire as kernels
from fireworld.kernels.arrays import CityTables, Constants, FireState, PolicyTables, WorldArrays
from fireworld.parameters import PAPER
from fireworld.world.state import copy_world, fresh_world
from fireworld.world.tables import city_tables, world_constants
from tests.reference import fire as plain

Kind = Literal["small", "hot"]

LOTS: Final = {100: (10, 10), 250: (16, 16), 1000: (32, 32), 4000: (64, 63)}
"""Columns and rows of lots, by about the number of buildings."""
CITY_SEED: Final = 1
BURN_RATE: Final = PAPER.fire.burn_rate_mean
PARAMETERS: Final = replace(PAPER, fire=replace(PAPER.fire, burn_rate_sd=0.0))
"""The paper's parameters; every building burns at the mean rate, so that both engines compute the same fire."""
STEPS_BEFORE: Final = {"small": 20, "hot": 60}
NOBODY: Final = np.zeros(0, dtype=np.int64)


@cache
def plan_of(size: int) -> Plan:
    """Draw the city of about `size` buildings."""
    columns, rows = LOTS[size]
    return generate_plan(columns=columns, rows=rows, seed=CITY_SEED)


@cache
def city_of(size: int) -> City:
    """Build the city of about `size` buildings."""
    return build_city(plan_of(size), PARAMETERS.fire, seed=CITY_SEED)


def ignited(city: City, kind: Kind) -> Array:
    """Choose the buildings on fire: the one nearest to the middle, or every eighth; (k,) indices."""
    inflammable = np.flatnonzero(city.footprints.inflammable)
    if kind == "hot":
        return inflammable[::8]
    offset = city.footprints.centroid_mm[inflammable] - np.array(city.middle_mm)
    return inflammable[[int(np.argmin((offset * offset).sum(axis=1)))]]


@dataclass(frozen=True)
class Blaze:
    """One fire in one city for both engines."""

    plain_tables: plain.FireTables
    plain_fire: plain.FireState
    tables: CityTables
    constants: Constants
    world: WorldArrays
    rate: Array  # (n,)

    def plain_copy(self) -> plain.FireState:
        """Copy the numpy engine's state."""
        return self.plain_fire.copy()

    def fire_copy(self) -> FireState:
        """Copy the compiled engine's state."""
        return FireState(*(array.copy() for array in self.world.fire))

    def world_copy(self) -> WorldArrays:
        """Copy the whole world of the compiled engine."""
        return copy_world(self.world)

    def step_plain(self, fire: plain.FireState) -> None:
        """Advance the numpy engine by a step."""
        plain.advance_fire(self.plain_tables, fire, self.rate)

    def step_compiled(self, fire: FireState) -> None:
        """Advance the compiled engine by a step."""
        kernels.advance_fire(self.tables.buildings, self.tables.cover, self.tables.links, fire, self.constants.fire)

    def n_burning(self) -> int:
        """Count the burning buildings."""
        return int(np.count_nonzero(plain.is_burning(self.plain_tables, self.plain_fire)))

    def assert_agreement(self, fire: plain.FireState, compiled: FireState) -> None:
        """Make sure that both engines have computed the same fire."""
        np.testing.assert_array_equal(compiled.fieryness, fire.fieryness)
        np.testing.assert_allclose(compiled.energy, fire.energy, rtol=1e-9, atol=1e-6)


def no_policy() -> PolicyTables:
    """Return the policy of a team without brigades."""
    none = np.zeros(0, dtype=np.int32)
    return PolicyTables(kind=none, action=none, table_of=none, tables=np.zeros((1, 270, 4)), epsilon=np.zeros(1))


def blaze(size: int, kind: Kind, *, steps_before: int | None = None) -> Blaze:
    """Set a city on fire and let both engines burn it for the usual number of steps, or for `steps_before`."""
    city = city_of(size)
    plain_tables = plain.FireTables.of_city(city, PARAMETERS.fire)
    world = fresh_world(city, PARAMETERS, civilian_building=NOBODY, civilian_mm=np.zeros((0, 2)), brigade_refuge=NOBODY)
    world.fire.rate[:] = BURN_RATE
    rate = np.full(city.n_buildings, BURN_RATE)
    state = plain.FireState.cold(plain_tables)
    constants = world_constants(city, PARAMETERS)
    made = Blaze(plain_tables, state, city_tables(city, PARAMETERS.fire), constants, world, rate)
    chosen = ignited(city, kind)
    plain.ignite(plain_tables, state, chosen)
    for building in chosen:
        kernels.ignite(int(building), made.tables.buildings, world.fire)
    for _ in range(STEPS_BEFORE[kind] if steps_before is None else steps_before):
        made.step_plain(state)
        made.step_compiled(world.fire)
    made.assert_agreement(state, world.fire)
    return made
