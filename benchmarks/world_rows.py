"""Rows of the whole world: episodes with a team, in one compiled call and step by step from Python."""

from __future__ import annotations

from collections.abc import Iterator

from benchmarks.fires import LOTS, city_of
from benchmarks.runs import new_world, run_silently
from benchmarks.timing import Contender, Row, compare
from fireworld.policy.kernel import each_another
from fireworld.world.state import copy_into, copy_world
from fireworld.world.world import World


def episode_row(size: int, n_steps: int, *, seconds: float) -> Row:
    """Time an episode with four brigades: `World.run` against `World.step`; the outcome is the same."""
    world = new_world(size, n_steps)
    start = copy_world(world.arrays)

    def again() -> World:
        copy_into(world.arrays, start)
        world.step_number = 0
        return world

    def compiled(fresh: World) -> object:
        return fresh.run(each_another().for_brigades(fresh.n_brigades))

    ours, baseline = Contender("World.run", compiled, again), Contender("World.step", run_silently, again)
    label = f"{city_of(size).n_buildings} buildings, {world.n_brigades} brigades"
    return compare("world", f"episode of {n_steps} steps", label, ours, baseline, seconds=seconds)


def rows(*, quick: bool) -> Iterator[Row]:
    """Yield the rows of the world."""
    for size in list(LOTS)[:2] if quick else LOTS:
        yield episode_row(size, 100 if quick else 300, seconds=0.3 if quick else 2.0)
