"""Decisions per CPU second, of fireworld's environments and of others: `python -m benchmarks.peers [--seconds 120]`.

Whole episodes are played, resets included, with actions at random. All environments take turns in one process, on one
thread, until the time is up. Those that are not installed are named; docs/peers.md says how to install them.
"""

from __future__ import annotations

import contextlib
import importlib.metadata
import json
import statistics
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import partial
from random import Random
from typing import Any, Final

import click
import numpy as np

from benchmarks.machine import describe

SCENARIO: Final = "test-1"
N_WORLDS: Final = 64
N_STEPS: Final = 500
"""Steps of many worlds in one turn: as many as an episode lasts at most."""
TURN_SECONDS: Final = 0.25
"""CPU time of a turn at least."""
ROUNDS_MIN: Final = 3
RANDOM: Final = Random(1)  # noqa: S311 - for actions

Play = Callable[[], int]
"""Plays an episode, and returns the number of decisions: one for every agent in every step."""


@dataclass(frozen=True)
class Contender:
    """An environment.

    Attributes:
        name: how it is called.
        package: what it comes with.
        what: its settings, in words.
        prepare: returns what plays an episode; ImportError if it is not installed.
    """

    name: str
    package: str
    what: str
    prepare: Callable[[], Play]


@dataclass(frozen=True)
class Measured:
    """What was measured of an environment, or why nothing was.

    Attributes:
        rate: decisions per CPU second, the median of the rounds.
        slower: rate of fireworld's worlds / rate, the median of the rounds' ratios, and their quartiles.
    """

    name: str
    version: str
    what: str
    rate: float | None = None
    slower: tuple[float, float, float] | None = None


def of_worlds() -> Play:
    """Return what plays many worlds in one call; worlds that end begin anew at once."""
    from fireworld import envs

    worlds = envs.worlds(SCENARIO, N_WORLDS, autoreset="SAME_STEP")
    worlds.reset()
    shape, random = (N_WORLDS, worlds.n_brigades), np.random.default_rng(1)

    def play() -> int:
        for _ in range(N_STEPS):
            worlds.step(random.integers(0, 4, size=shape))
        return N_STEPS * N_WORLDS * worlds.n_brigades

    return play


def of_parallel(env: Any) -> Play:
    """Return what plays a ParallelEnv of PettingZoo."""
    n_actions = {name: int(env.action_space(name).n) for name in env.possible_agents}

    def play() -> int:
        env.reset()
        n = 0
        while env.agents:
            n += len(env.agents)
            env.step({name: int(RANDOM.random() * n_actions[name]) for name in env.agents})
        return n

    return play


def of_aec(env: Any) -> Play:
    """Return what plays an AECEnv of PettingZoo; each agent looks before it decides."""
    n_actions = {name: int(env.action_space(name).n) for name in env.possible_agents}

    def play() -> int:
        env.reset()
        n = 0
        for name in env.agent_iter():
            _, _, terminated, truncated, _ = env.last()
            over = terminated or truncated
            env.step(None if over else int(RANDOM.random() * n_actions[name]))
            n += not over
        return n

    return play


def of_single(env: Any) -> Play:
    """Return what plays an environment of Gymnasium."""
    n_actions = int(env.action_space.n)

    def play() -> int:
        env.reset()
        n, over = 0, False
        while not over:
            _, _, terminated, truncated, _ = env.step(int(RANDOM.random() * n_actions))
            n, over = n + 1, terminated or truncated
        return n

    return play


def team() -> Play:
    """Return what plays fireworld's ParallelEnv."""
    from fireworld import envs

    return of_parallel(envs.team(SCENARIO, seed=1))


def turns() -> Play:
    """Return what plays fireworld's AECEnv."""
    from fireworld import envs

    return of_aec(envs.turns(SCENARIO, seed=1))


def brigade() -> Play:
    """Return what plays fireworld's single brigade."""
    from fireworld import envs

    return of_single(envs.brigade(SCENARIO, others="nearest-to-me", seed=1))


def simple_spread() -> Play:
    """Return what plays particles that spread over landmarks."""
    from mpe2 import simple_spread_v3

    return of_parallel(simple_spread_v3.parallel_env(N=4))


def knights_archers_zombies() -> Play:
    """Return what plays knights and archers, whom zombies attack."""
    from pettingzoo.butterfly import knights_archers_zombies_v11

    return of_parallel(knights_archers_zombies_v11.parallel_env())


def battle(map_size: int) -> Play:
    """Return what plays two armies on a grid, in C++."""
    from magent2.environments import battle_v4

    return of_parallel(battle_v4.parallel_env(map_size=map_size))


def wildfire(size: int) -> Play:
    """Return what plays drones over a burning forest."""
    from wildfire_environment.envs import WildfireEnv

    places = ((1, 1), (size - 2, size - 2), (1, size - 2), (size - 2, 1))
    colors = ("red", "blue", "green", "purple")
    env = WildfireEnv(
        size=size, num_agents=4, agent_start_positions=places, agent_colors=colors, cooperative_reward=True
    )

    def play() -> int:
        env.reset()
        n, over = 0, False
        while not over:
            _, _, over, _ = env.step({k: int(RANDOM.random() * 5) for k in range(4)})
            n += 4
        return n

    return play


def evacuation() -> Play:
    """Return what plays the evacuation of four towns, on a grid of ten by ten."""
    import gymnasium
    import pyrorl  # noqa: F401 - enters it into the registry

    towns = np.array([[1, 2], [4, 8], [6, 4], [8, 7]])
    paths = np.empty(len(towns), dtype=object)
    paths[:] = [[[1, 1], [1, 0]], [[4, 9]], [[6, 3], [6, 2], [6, 1], [6, 0]], [[9, 7]]]
    options = {"num_rows": 10, "num_cols": 10, "populated_areas": towns, "paths": paths}
    ways = {k: [town] for k, town in enumerate(towns.tolist())}
    return of_single(gymnasium.make("pyrorl/PyroRL-v0", disable_env_checker=True, **options, paths_to_pops=ways))


OURS: Final = Contender("worlds", "fireworld", f"{N_WORLDS} worlds in one call, 4 brigades each", of_worlds)
CONTENDERS: Final = (
    OURS,
    Contender("team, a ParallelEnv", "fireworld", "4 brigades", team),
    Contender("turns, an AECEnv", "fireworld", "4 brigades", turns),
    Contender("a single brigade", "fireworld", "1 agent among 3 brigades by a rule", brigade),
    Contender("simple_spread", "mpe2", "4 agents", simple_spread),
    Contender("knights_archers_zombies", "pettingzoo", "4 agents", knights_archers_zombies),
    Contender("battle, small", "magent2", "60 agents, map of 30 x 30", partial(battle, 30)),
    Contender("battle", "magent2", "162 agents, map of 45 x 45", partial(battle, 45)),
    Contender("wildfire, small", "wildfire-environment", "4 agents, grid of 17 x 17", partial(wildfire, 17)),
    Contender("wildfire", "wildfire-environment", "4 agents, grid of 27 x 27", partial(wildfire, 27)),
    Contender("evacuation", "pyrorl", "1 agent, grid of 10 x 10", evacuation),
)


def version_of(package: str) -> str:
    """Return the version of an installed package, or "not installed"."""
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "not installed"


def turn(play: Play) -> float:
    """Play episodes for a while, and return decisions per CPU second."""
    n, start, spent = 0, time.process_time(), 0.0
    while spent < TURN_SECONDS:
        n += play()
        spent = time.process_time() - start
    return n / spent


def measure(contenders: Sequence[Contender], *, seconds: float) -> list[Measured]:
    """Measure environments in turns, for that long at least; the first of them is what the others are compared with."""
    plays, rates = {}, {}
    for contender in contenders:
        with suppress(ImportError):
            plays[contender.name] = contender.prepare()
            plays[contender.name]()  # compile, fill caches
            rates[contender.name] = []
    end = time.monotonic() + seconds
    while len(rates[contenders[0].name]) < ROUNDS_MIN or time.monotonic() < end:
        for name, play in plays.items():
            rates[name].append(turn(play))
    return [result(contender, rates.get(contender.name), rates[contenders[0].name]) for contender in contenders]


def result(contender: Contender, rates: list[float] | None, reference: list[float]) -> Measured:
    """Return what was measured of an environment in every round, and of the one that it is compared with."""
    if rates is None:
        return Measured(contender.name, f"{contender.package}, not installed", contender.what)
    low, middle, high = statistics.quantiles([ours / rate for ours, rate in zip(reference, rates, strict=True)], n=4)
    version = f"{contender.package} {version_of(contender.package)}"
    return Measured(contender.name, version, contender.what, statistics.median(rates), (low, middle, high))


def as_markdown(found: Sequence[Measured]) -> str:
    """Return the table of a page."""
    lines = ["| environment | of | | decisions per CPU second | worlds are faster by |", "|---|---|---|---|---|"]
    for one in found:
        rate = "" if one.rate is None else f"{float(f'{one.rate:.3g}'):,.0f}"
        times = "" if one.slower is None else "{1:.3g} x ({0:.3g} to {2:.3g})".format(*one.slower)
        lines.append(f"| {one.name} | {one.version} | {one.what} | {rate} | {times} |")
    return "\n".join(lines)


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--seconds", default=120.0, show_default=True, help="Measure for that long at least.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON instead of a table.")
def main(*, seconds: float, as_json: bool) -> None:
    """Compare the speed of fireworld's environments with that of others."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):  # some write into the current folder
        found = measure(CONTENDERS, seconds=seconds)
    machine = describe()
    if as_json:
        click.echo(json.dumps({"machine": machine, "rows": [asdict(one) for one in found]}, indent=1))
    else:
        click.echo(", ".join(f"{name} {value}" for name, value in machine.items()))
        click.echo(as_markdown(found))


if __name__ == "__main__":
    main()
