"""Rows of environments: steps of many worlds in one call, and of every form, against steps of a world from Python."""

from __future__ import annotations

import itertools
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any, Final

import numpy as np

from benchmarks.timing import Contender, Row, compare
from fireworld import envs
from fireworld.kernels.arrays import Array
from fireworld.kernels.choice import RANK_NAMED
from fireworld.policy.kernel import KernelPolicy, always
from fireworld.policy.names import find_policy
from fireworld.scenario import load_scenario
from fireworld.simulation.built import BuiltScenario, build_scenario
from fireworld.simulation.world import World

SCENARIO: Final = "test-1"
ACTION: Final = 3
N_STEPS: Final = 40
"""The fire burns as long, whatever the random draws are."""
SIZES: Final = (1, 16, 64, 256)
N_RECORDED: Final = 64
N_WORLDS: Final = 64
N_EPISODE_STEPS: Final = 400
"""About four episodes."""
TEAMS: Final = {"features": "paper-cooperative", "targets": "best"}
"""Which team's episodes are played by those who see what; of targets, those that the four actions name."""


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


def team_of(kind: str) -> KernelPolicy:
    """Return the team for an observation."""
    policy = find_policy(TEAMS[kind]).policy
    assert isinstance(policy, KernelPolicy)
    return replace(policy, kinds=tuple(min(kind, RANK_NAMED) for kind in policy.kinds))


class Episodes:
    """Episodes of many worlds with one team: in compiled code, and with its actions given step by step."""

    def __init__(self, kind: str, *, threads: int = 1) -> None:
        self.worlds = envs.worlds(SCENARIO, N_WORLDS, observation=kind, autoreset="same-step", threads=threads)
        policy = team_of(kind)
        self.team = policy.for_brigades(self.worlds.n_brigades)
        self.actions: list[Array] = []
        self.begun, latest = self.start(), list(range(N_WORLDS))
        for _ in range(N_EPISODE_STEPS):
            decided = []
            for index in range(N_WORLDS):
                world = self.worlds.world(index)
                world.step(policy)
                decided.append(np.maximum(world.state.brigades.action, 0))
            self.actions.append(np.array(decided))
            ended = self.worlds.step(self.actions[-1])
            for index in np.flatnonzero(ended.terminated | ended.truncated).tolist():
                latest[index] = len(self.begun)
                self.begun.append(self.worlds.world(index))
        for index, number in enumerate(latest):  # of the last episodes only as much as was played
            self.begun[number].n_steps_max = self.worlds.world(index).step_number

    def start(self) -> list[World]:
        """Let all worlds begin, and return them."""
        self.worlds.reset(seed=0)
        return [self.worlds.world(index) for index in range(N_WORLDS)]

    def given(self, name: str) -> Contender:
        """Return the steps in the environment."""

        def run(_: object) -> None:
            for actions in self.actions:
                self.worlds.step(actions)

        return Contender(name, run, lambda: self.worlds.reset(seed=0), parts=N_EPISODE_STEPS * N_WORLDS)

    def compiled(self) -> Contender:
        """Return the same steps, of whole episodes by the team itself."""

        def run(worlds: list[World]) -> None:
            for world in worlds:
                world.run(self.team)

        assert sum(world.copy().run(self.team) for world in self.begun) == N_EPISODE_STEPS * N_WORLDS, "other episodes"
        parts = N_EPISODE_STEPS * N_WORLDS
        return Contender("World.run", run, lambda: [world.copy() for world in self.begun], parts=parts)


def rows(*, quick: bool) -> Iterator[Row]:
    """Yield the rows of environments."""
    built, seconds = build_scenario(load_scenario(SCENARIO)), 1.0 if quick else 10.0
    size, python = f"{built.city.n_buildings} buildings", from_python(built)
    for n in SIZES[:2] if quick else SIZES:
        yield compare("envs", "a step of a world, features", size, in_batch(n, "features"), python, seconds=seconds)
    for kind in ("targets", "graph"):
        yield compare("envs", f"a step of a world, {kind}", size, in_batch(64, kind), python, seconds=seconds)
    for kind in TEAMS:
        one, two = Episodes(kind), Episodes(kind, threads=2)
        what, worlds = f"a step of whole episodes, {kind}", f"{N_WORLDS} worlds"
        yield compare("envs", what, worlds, one.given("in one call"), one.compiled(), seconds=seconds)
        yield compare("envs", what, worlds, two.given("two threads"), one.given("one thread"), seconds=seconds)
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
