"""Rows of the fire model: the compiled kernels against plain numpy, a step and whole episodes."""

from __future__ import annotations

from collections.abc import Iterator

from benchmarks.fires import LOTS, Blaze, Kind, blaze, no_policy
from benchmarks.timing import Contender, Row, compare
from fireworld.kernels.arrays import WorldArrays
from fireworld.kernels.episode import run_episode
from tests.reference import fire as plain

EPISODE_STEPS = 300
KINDS: tuple[Kind, ...] = ("small", "hot")


def label(burning: Blaze) -> str:
    """Say how large the city is and how much of it burns."""
    return f"{len(burning.rate)} buildings, {burning.n_burning()} burning"


def step_row(size: int, kind: Kind, *, seconds: float) -> Row:
    """Time one step of a fire that has burnt for a while."""
    start = blaze(size, kind)
    ours = Contender("compiled", start.step_compiled, start.fire_copy)
    baseline = Contender("numpy", start.step_plain, start.plain_copy)
    return compare("fire", f"one step, {kind} fire", label(start), ours, baseline, seconds=seconds)


def episode_row(size: int, kind: Kind, *, seconds: float) -> Row:
    """Time a whole episode without brigades: one compiled call against a loop over numpy steps, from the ignition."""
    start = blaze(size, kind, steps_before=0)
    policy = no_policy()

    def compiled(world: WorldArrays) -> int:
        return int(run_episode(start.tables, world, start.constants, policy, 1, 1, EPISODE_STEPS))

    def in_numpy(fire: plain.FireState) -> int:
        for step in range(1, EPISODE_STEPS + 1):
            start.step_plain(fire)
            if not ((fire.fieryness >= 1) & (fire.fieryness <= 3)).any():
                return step
        return EPISODE_STEPS

    world, fire = start.world_copy(), start.plain_copy()
    assert compiled(world) == in_numpy(fire), "both engines stop in the same step"
    start.assert_agreement(fire, world.fire)
    ours = Contender("compiled", compiled, start.world_copy)
    baseline = Contender("numpy", in_numpy, start.plain_copy)
    return compare(
        "fire", f"episode of {EPISODE_STEPS} steps, {kind} fire", label(start), ours, baseline, seconds=seconds
    )


def rows(*, quick: bool) -> Iterator[Row]:
    """Yield the rows of the fire model."""
    seconds = 0.3 if quick else 2.0
    for size in list(LOTS)[:2] if quick else LOTS:
        for kind in KINDS:
            yield step_row(size, kind, seconds=seconds)
    for size in list(LOTS)[:2] if quick else LOTS:
        for kind in KINDS:
            yield episode_row(size, kind, seconds=seconds)
