"""Rows of environments: steps of many worlds in one call, and of every form, against steps of a world from Python."""

from __future__ import annotations

import itertools
import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, Final

import numpy as np

from benchmarks.timing import Contender, Row, compare
from fireworld import envs
from fireworld.policy.kernel import always
from fireworld.scenario import load_scenario
from fireworld.simulation.built import BuiltScenario, build_scenario
from fireworld.simulation.world import World

SCENARIO: Final = "test-1"
ACTION: Final = 3
N_STEPS: Final = 40
"""The fire burns as long, whatever the random draws are."""
SIZES: Final = (1, 16, 64, 256)
N_RECORDED: Final = 64


def from_python(built: BuiltScenario) -> Contender:
    """Return steps of a world with a policy that kernels know."""
    policy = always(ACTION)

    def run(world: World) -> None:
        for _ in range(N_STEPS):
            world.step(policy)

    return Contender("World.step", run, partial(built.world, seed=1), parts=N_STEPS)


def in_batch(n: int, kind: str) -> Contender:
    """Return steps of n worlds; the time is that of a step of one of them."""
    worlds = envs.worlds(SCENARIO, n, observation=kind)
    actions = np.full((n, worlds.n_brigades), ACTION)

    def run(_: None) -> None:
        for _ in range(N_STEPS):
            worlds.step(actions)

    return Contender(f"{n} in one call", run, lambda: worlds.reset() and None, parts=N_STEPS * n)


def at_random(name: str, worlds: envs.Worlds) -> Contender:
    """Return steps of many worlds at random, episode after episode."""
    worlds.reset()
    chosen = np.random.default_rng(0).integers(0, 4, size=(500, N_RECORDED, worlds.n_brigades))
    steps = itertools.cycle(chosen)

    def run(_: None) -> None:
        for _ in range(N_STEPS):
            worlds.step(next(steps))

    return Contender(name, run, lambda: None, parts=N_STEPS * N_RECORDED)


def team_steps(env: Any) -> None:
    """Run the steps of a ParallelEnv."""
    for _ in range(N_STEPS):
        env.step(dict.fromkeys(env.agents, ACTION))


def turns_steps(env: Any) -> None:
    """Run the steps of an AECEnv, looking at what every agent sees."""
    for _ in range(N_STEPS * env.worlds.n_brigades):
        env.last()
        env.step(ACTION)


def gymnasium_steps(action: Any, env: Any) -> None:
    """Run the steps of an environment of Gymnasium."""
    for _ in range(N_STEPS):
        env.step(action)


def form(name: str, env: Any, run: Callable[[Any], None]) -> Contender:
    """Return the steps of a form."""

    def prepare() -> Any:
        env.reset()
        return env

    return Contender(name, run, prepare, parts=N_STEPS)


def rows(*, quick: bool) -> Iterator[Row]:
    """Yield the rows of environments."""
    built, seconds = build_scenario(load_scenario(SCENARIO)), 1.0 if quick else 10.0
    size, python = f"{built.city.n_buildings} buildings", from_python(built)
    for n in SIZES[:2] if quick else SIZES:
        yield compare("envs", "a step of a world, features", size, in_batch(n, "features"), python, seconds=seconds)
    for kind in ("targets", "graph"):
        yield compare("envs", f"a step of a world, {kind}", size, in_batch(64, kind), python, seconds=seconds)
    with tempfile.TemporaryDirectory() as folder:
        worlds = {"recorded": envs.worlds(SCENARIO, N_RECORDED, record=folder)}
        worlds["not recorded"] = envs.worlds(SCENARIO, N_RECORDED)
        pair = [at_random(*one) for one in worlds.items()]
        yield compare("envs", "a step of one of 64 worlds, episodes recorded", size, *pair, seconds=seconds)
        for one in worlds.values():
            one.close()
    forms = (
        form("envs.team", envs.team(SCENARIO), team_steps),
        form("envs.turns", envs.turns(SCENARIO), turns_steps),
        form("envs.brigade", envs.brigade(SCENARIO, others="nearest-to-me"), partial(gymnasium_steps, ACTION)),
    )
    for contender in forms:
        yield compare("envs", "a step of a form", size, contender, python, seconds=seconds)
