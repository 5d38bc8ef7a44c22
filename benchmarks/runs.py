"""Worlds with a team, and recordings of them, for the benchmarks."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

import numpy as np
from fireworld_recorder.writer import LogWriter

from benchmarks.fires import city_of, tables_of
from fireworld.city.city import Array, City
from fireworld.parameters import PAPER, Parameters
from fireworld.policy.kernel import KernelPolicy, each_another
from fireworld.records import CityRecord, RunHeader, StepRecord
from fireworld.simulation.observer import Observer, city_record
from fireworld.simulation.placement import Placement
from fireworld.simulation.world import World, prepare_start

N_BRIGADES: Final = 4
N_CIVILIANS: Final = 10
N_CORNER: Final = 40
SEED: Final = 1


def placement_of(size: int, ignited: Array) -> Placement:
    """Place ten civilians all over a city, and four brigades at its refuges in turn; (k,) buildings burn."""
    city = city_of(size)
    inflammable = np.flatnonzero(city.footprints.inflammable)
    civilians = inflammable[:: len(inflammable) // N_CIVILIANS][:N_CIVILIANS]
    refuges = np.flatnonzero(city.footprints.refuge)
    return Placement(
        ignited=ignited,
        civilian_building=civilians,
        civilian_mm=city.footprints.centroid_mm[civilians],
        brigade_refuge=refuges[np.arange(N_BRIGADES) % len(refuges)],
    )


def world_of(size: int, ignited: Array, n_steps: int, *, parameters: Parameters = PAPER) -> World:
    """Set up a world with a team in a city, in which these buildings burn."""
    start = prepare_start(city_of(size), parameters, placement_of(size, ignited), arrays=tables_of(size))
    return World(start, seed=SEED, n_steps_max=n_steps)


def from_the_corner(city: City) -> Array:
    """Return the forty inflammable buildings nearest to the south-west corner: a fire that lasts hundreds of steps."""
    inflammable = np.flatnonzero(city.footprints.inflammable)
    distance = city.footprints.centroid_mm[inflammable].astype(np.int64).sum(axis=1)
    return np.sort(inflammable[np.argsort(distance, kind="stable")[:N_CORNER]])


def new_world(size: int, n_steps: int) -> World:
    """Set up a world with a team and a fire that spreads from a corner."""
    return world_of(size, from_the_corner(city_of(size)), n_steps)


def run_silently(world: World, policy: KernelPolicy) -> None:
    """Run a world step by step without looking at it."""
    policy.begin(world.city_arrays, world.n_brigades, world.seed)
    while not (world.terminated or world.truncated):
        world.step(policy)


def records(world: World) -> Iterator[StepRecord]:
    """Run a world step by step and tell of every step."""
    policy, observer = each_another(), Observer(world)
    policy.begin(world.city_arrays, world.n_brigades, world.seed)
    yield observer.record()
    while not (world.terminated or world.truncated):
        yield observer.record(world.step(policy))


def header(n_steps: int) -> RunHeader:
    """Make a header for a benchmark's log."""
    return RunHeader(
        scenario="benchmark",
        scenario_digest="",
        seed=SEED,
        policy="each-another",
        policy_digest="",
        fireworld_version="0",
        n_steps_max=n_steps,
    )


def record_of(world: World) -> CityRecord:
    """Make the city record of a world."""
    people, nobody = world.state.civilians, np.zeros(0, dtype=np.int32)
    brigades = np.zeros(world.n_brigades, dtype=np.int32)
    start = Placement(nobody, people.building, np.stack([people.x, people.y], axis=1), brigades)
    return city_record(world.city, start, PAPER)


def write_log(path: Path, world: World) -> None:
    """Run a world and record it."""
    with LogWriter(path, header(world.n_steps_max), record_of(world), force=True) as log:
        for record in records(world):
            log.write(record)
