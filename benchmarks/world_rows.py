"""Rows of the whole world: episodes with a team, in one compiled call, step by step from Python, and in plain numpy."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import cache, partial

import numpy as np

from benchmarks.fires import KINDS, LOTS, Kind, city_of, every_eighth, from_the_middle
from benchmarks.large import five_fires
from benchmarks.runs import SEED, new_world, placement_of, run_silently, world_of
from benchmarks.timing import Contender, Row, compare
from fireworld.parameters import PAPER, Parameters
from fireworld.policy.kernel import KernelPolicy, always
from fireworld.records import ACTIONS
from fireworld.scenario import parse_scenario
from fireworld.simulation.built import build_scenario
from fireworld.simulation.state import copy_into, copy_world
from fireworld.simulation.world import World
from tests.reference import episode

N_STEPS = 100
POLICY = always(ACTIONS.index("nearest-to-me"))
N_CANDIDATES = 30


def parameters_of(kind: Kind) -> Parameters:
    """Return the paper's parameters; a small fire gets a tenth of the water, or it would be out in a few steps."""
    brigades = PAPER.brigades
    if kind == "hot":
        return PAPER
    return replace(
        PAPER,
        brigades=replace(
            brigades,
            tank_litres=brigades.tank_litres // 10,
            power_litres=brigades.power_litres // 10,
            refuge_refill_litres=brigades.refuge_refill_litres // 10,
        ),
    )


@cache
def smallest_fire(size: int) -> int:
    """Return the building whose fire stays smallest while it outlasts the episode.

    Of the thirty wooden buildings nearest to the middle, that with the fewest burning buildings at every tenth step.
    """
    best, fewest = -1, math.inf
    for building, _ in zip(from_the_middle(city_of(size)), range(N_CANDIDATES), strict=False):
        world, total = world_of(size, np.array([building]), N_STEPS, parameters=parameters_of("small")), 0
        ready = POLICY.for_brigades(world.n_brigades)
        for last in range(10, N_STEPS + 1, 10):
            world.n_steps_max = last
            world.run(ready)
            total += world.outcome.n_burning
        if not world.terminated and total < fewest:
            best, fewest = building, total
    assert best >= 0, "some fire outlasts the episode"
    return best


def episode_row(size: int, kind: Kind, *, seconds: float) -> Row:
    """Time an episode with four brigades: one compiled call against plain numpy; both end alike."""
    city = city_of(size)
    ignited = every_eighth(city) if kind == "hot" else np.array([smallest_fire(size)])
    tables = episode.Tables.of_city(city, parameters_of(kind))
    begin = episode.World.at_start(tables, **vars(placement_of(size, ignited)))
    world = world_of(size, ignited, N_STEPS, parameters=parameters_of(kind))
    ours = Contender("compiled", partial(run_compiled, policy=POLICY), again(world))

    def in_numpy(fresh: episode.World) -> int:
        return episode.run_episode(tables, fresh, POLICY, seed=SEED, first_step=1, last_step=N_STEPS)

    end = begin.copy()
    n_steps = in_numpy(end)
    assert n_steps == run_compiled(again(world)(), policy=POLICY) == N_STEPS
    assert_same_end(end, world)
    label = f"{city.n_buildings} buildings, {len(ignited)} ignited, {end.outcome.n_burning} burning at the end"
    baseline = Contender("numpy", in_numpy, begin.copy)
    return compare("world", f"episode of {N_STEPS} steps, {kind} fire", label, ours, baseline, seconds=seconds)


def again(world: World) -> partial[World]:
    """Return what sets a world back to where it is now."""
    start, step = copy_world(world.state), world.step_number

    def reset() -> World:
        copy_into(world.state, start)
        world.step_number = step
        return world

    return partial(reset)


def run_compiled(world: World, *, policy: KernelPolicy) -> int:
    """Run a world to its end in one compiled call."""
    return world.run(policy.for_brigades(world.n_brigades))


def assert_same_end(plain: episode.World, compiled: World) -> None:
    """Make sure that both engines have come to the same end."""
    arrays, outcome = compiled.state, plain.outcome
    np.testing.assert_array_equal(arrays.fire.fieryness, plain.fire.fieryness)
    np.testing.assert_array_equal(arrays.fire.water, plain.fire.water)
    np.testing.assert_allclose(arrays.fire.energy, plain.fire.energy, rtol=1e-9, atol=1e-6)
    assert arrays.brigades.tank.tolist() == [brigade.tank_litres for brigade in plain.team]
    assert compiled.outcome.n_civilians_alive == outcome.n_civilians_alive
    assert compiled.outcome.water_used_litres == outcome.water_litres


def stepping_row(size: int, n_steps: int, *, seconds: float) -> Row:
    """Time what it costs to go step by step from Python, as a recorded run does."""
    world = new_world(size, n_steps)
    fresh = again(world)
    ours = Contender("World.run", partial(run_compiled, policy=POLICY), fresh)
    baseline = Contender("World.step", partial(run_silently, policy=POLICY), fresh)
    label = f"{city_of(size).n_buildings} buildings, {world.n_brigades} brigades"
    return compare("world", f"episode of {n_steps} steps, spreading fire", label, ours, baseline, seconds=seconds)


def scale_row(columns: int, depth: int, *, seconds: float) -> Row:
    """Time a step of five fires, for each building: in a large city against the same in one of 1000 buildings."""

    def contender(columns: int, depth: int) -> Contender:
        built = build_scenario(parse_scenario(five_fires(columns, depth, steps=N_STEPS), source="five fires"))
        world = built.world(seed=SEED)
        n = world.city.n_buildings
        return Contender(f"{n} buildings", partial(run_compiled, policy=POLICY), again(world), parts=N_STEPS * n)

    ours, baseline = contender(columns, depth), contender(40, 25)
    return compare("world", "a step, for each building", "five spreading fires", ours, baseline, seconds=seconds)


def rows(*, quick: bool) -> Iterator[Row]:
    """Yield the rows of the world."""
    seconds = 0.3 if quick else 2.0
    for size in list(LOTS)[:2] if quick else LOTS:
        for kind in KINDS:
            yield episode_row(size, kind, seconds=seconds)
    yield scale_row(*((60, 40) if quick else (400, 250)), seconds=seconds)
    yield stepping_row(100 if quick else 1000, N_STEPS, seconds=seconds)
