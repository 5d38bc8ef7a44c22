"""Cities and fires of the benchmarks, ready for both engines: the compiled one and the one in plain numpy."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Final, Literal

import numpy as np

from benchmarks.loops import advance_steps
from fireworld.city.build import build_city
from fireworld.city.city import Array, City, Plan
from fireworld.city.generator import generate_plan
from fireworld.kernels import fire as kernels
from fireworld.kernels.arrays import CityArrays, FireConstants, FireState
from fireworld.kernels.episode_arrays import Warmth
from fireworld.kernels.warmth import fresh_warmth
from fireworld.parameters import PAPER
from fireworld.records import MATERIALS
from fireworld.simulation.city_arrays import air_shape, city_arrays, fire_constants
from fireworld.simulation.state import fresh_fire
from tests.reference import fire as plain

Kind = Literal["small", "hot"]

KINDS: Final[tuple[Kind, ...]] = ("small", "hot")
LOTS: Final = {100: (10, 10), 250: (16, 16), 1000: (32, 32), 4000: (64, 63)}
"""Columns and rows of lots, by about the number of buildings."""
CITY_SEED: Final = 1
BURN_RATE: Final = PAPER.fire.burn_rate_mean
STEPS_BEFORE: Final[dict[Kind, int]] = {"small": 20, "hot": 60}
STEPS_TIMED: Final = 10


@cache
def plan_of(size: int) -> Plan:
    """Draw the city of about `size` buildings."""
    columns, rows = LOTS[size]
    return generate_plan(columns=columns, rows=rows, seed=CITY_SEED)


@cache
def city_of(size: int) -> City:
    """Build the city of about `size` buildings."""
    return build_city(plan_of(size), PAPER.fire, seed=CITY_SEED)


@cache
def tables_of(size: int) -> CityArrays:
    """Build the kernels' tables of a city once."""
    return city_arrays(city_of(size), PAPER.fire)


def every_eighth(city: City) -> Array:
    """Return every eighth inflammable building, (k,) indices: a hot fire's start."""
    return np.flatnonzero(city.footprints.inflammable)[::8]


def from_the_middle(city: City) -> Iterator[int]:
    """Yield the wooden buildings, from the middle of the city outwards: where a small fire may start."""
    wood = np.flatnonzero((city.footprints.inflammable != 0) & (city.footprints.material == MATERIALS.index("wood")))
    offset = city.footprints.centroid_mm[wood] - np.array(city.middle_mm)
    yield from wood[np.argsort((offset * offset).sum(axis=1), kind="stable")].tolist()


@dataclass(frozen=True)
class Blaze:
    """One fire in one city for both engines, at the start of the steps that are timed. All burn at the mean rate."""

    plain_tables: plain.FireTables
    plain_fire: plain.FireState
    tables: CityArrays
    constants: FireConstants
    compiled_fire: FireState
    warmth: Warmth
    rate: Array  # (n,)

    def plain_copy(self) -> plain.FireState:
        """Copy the numpy engine's state."""
        return self.plain_fire.copy()

    def compiled_copy(self) -> FireState:
        """Copy the compiled engine's state."""
        return FireState(*(array.copy() for array in self.compiled_fire))

    def advance_plain(self, fire: plain.FireState, n_steps: int = STEPS_TIMED) -> None:
        """Advance the numpy engine."""
        for _ in range(n_steps):
            plain.advance_fire(self.plain_tables, fire, self.rate)

    def advance_compiled(self, fire: FireState, n_steps: int = STEPS_TIMED) -> None:
        """Advance the compiled engine in one call."""
        tables = self.tables
        advance_steps(tables.buildings, tables.cover, tables.links, fire, self.constants, self.warmth, n_steps)


def n_burning(fieryness: Array) -> int:
    """Count the burning buildings."""
    return int(np.count_nonzero((fieryness >= 1) & (fieryness <= 3)))


def kindle(size: int, chosen: Array, n_steps: int) -> Blaze:
    """Set buildings on fire and let both engines burn for some steps."""
    city, tables = city_of(size), tables_of(size)
    plain_tables = plain.FireTables.of_city(city, PAPER.fire)
    made = Blaze(
        plain_tables=plain_tables,
        plain_fire=plain.FireState.cold(plain_tables),
        tables=tables,
        constants=fire_constants(PAPER.fire),
        compiled_fire=fresh_fire(city),
        warmth=fresh_warmth(city.n_buildings, air_shape(city)),
        rate=np.full(city.n_buildings, BURN_RATE),
    )
    made.compiled_fire.rate[:] = BURN_RATE
    plain.ignite(plain_tables, made.plain_fire, chosen)
    for building in chosen:
        kernels.ignite(int(building), tables.buildings, made.compiled_fire)
    made.advance_plain(made.plain_fire, n_steps)
    made.advance_compiled(made.compiled_fire, n_steps)
    return made


@cache
def blaze(size: int, kind: Kind) -> Blaze:
    """Return the fire of the step rows.

    hot: every eighth building, after 60 steps. small: one building, after 20 steps: of the wooden ones that nearest to
    the middle of the city whose fire still burns when the timed steps are over.
    """
    if kind == "hot":
        made = kindle(size, every_eighth(city_of(size)), STEPS_BEFORE[kind])
    else:
        fires = (kindle(size, np.array([b]), STEPS_BEFORE[kind]) for b in from_the_middle(city_of(size)))
        made = next(fire for fire in fires if n_burning(after_timed_steps(fire)))
    assert n_burning(after_timed_steps(made)), "it burns until the end"
    return made


def after_timed_steps(start: Blaze) -> Array:
    """(n,) fieryness codes when the timed steps are over; both engines must compute the same fire."""
    fire, compiled = start.plain_copy(), start.compiled_copy()
    start.advance_plain(fire)
    start.advance_compiled(compiled)
    np.testing.assert_array_equal(compiled.fieryness, fire.fieryness)
    np.testing.assert_allclose(compiled.energy, fire.energy, rtol=1e-9, atol=1e-6)
    return fire.fieryness
