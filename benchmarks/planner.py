"""How good the planner is, and what its horizon, interval and rollouts are worth.

`python -m benchmarks.planner` prints the table in docs/planner.md. The defaults were chosen on other fires: those of
`--on contested` are in cities of other seeds, of sizes at which fixed policies neither all win nor all lose.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterable
from dataclasses import dataclass
from statistics import fmean
from typing import Final

import click

from benchmarks.machine import describe
from fireworld.policy.asking import begin
from fireworld.policy.names import find_policy
from fireworld.scenario import load_scenario
from fireworld.simulation.built import BuiltScenario, CityCache

TESTS: Final = ("test-1", "test-2", "test-3")
TRAINING: Final = tuple(f"train-{number}" for number in range(1, 9))
OPTIONS: Final = (
    "",
    "horizon=15",
    "horizon=20",
    "horizon=45",
    "horizon=60",
    "interval=1",
    "interval=2",
    "interval=8",
    "rollouts=2",
    "rollouts=4",
)
CONTESTED: Final = (
    (11, "[0.56, 0.62]", 8),
    (12, "[0.65, 0.72]", 7),
    (13, "[0.62, 0.71]", 12),
    (12, "[0.72, 0.57]", 6),
    (13, "[0.70, 0.31]", 5),
    (11, "[0.48, 0.37]", 5),
    (12, "[0.52, 0.54]", 4),
    (13, "[0.26, 0.36]", 6),
    (11, "[0.39, 0.71]", 7),
    (11, "[0.56, 0.31]", 5),
    (12, "[0.25, 0.69]", 6),
    (13, "[0.35, 0.36]", 8),
    (11, "[0.74, 0.69]", 7),
)
"""City seed, place and number of burning buildings; people and brigades as in test-1."""


@dataclass(frozen=True)
class Result:
    """Means over seeds on one built."""

    score: float  # share of the maximum
    seconds: float  # processor time of an episode


def contested(cities: CityCache, *, larger: bool = False) -> list[BuiltScenario]:
    """Build the contested fires; `larger`: with a quarter more burning buildings."""
    base, more = load_scenario("test-1"), 1.25 if larger else 1.0
    settings = [
        {"city.generated.seed": str(seed), "fires.0.at": at, "fires.0.n_buildings": str(math.ceil(more * n))}
        for seed, at, n in CONTESTED
    ]
    return [cities.build(base.with_settings(one)) for one in settings]


def play(built: BuiltScenario, options: str, seeds: Iterable[int]) -> Result:
    """Run the planner on several seeds."""
    scores, seconds = [], []
    for seed in seeds:
        world, policy = built.world(seed=seed), find_policy(f"planner:{options}" if options else "planner").policy
        started = time.process_time()
        begin(policy, world.city_arrays, n_brigades=world.n_brigades, seed=seed)
        while not (world.terminated or world.truncated):
            world.step(policy)
        seconds.append(time.process_time() - started)
        scores.append(world.outcome.score_share)
    return Result(fmean(scores), fmean(seconds))


@click.command()
@click.option(
    "--on", "which", type=click.Choice(["tests", "training", "contested", "larger"]), default="tests", show_default=True
)
@click.option("--seeds", "n_seeds", default=20, show_default=True, help="Runs on each fire.")
@click.option("--first-seed", default=1, show_default=True)
@click.option("--options", "chosen", multiple=True, help="Options of the planner; repeatable.  [default: a choice]")
def main(which: str, n_seeds: int, first_seed: int, chosen: tuple[str, ...]) -> None:
    """Print score / maximum on every fire, their mean, and processor seconds an episode."""
    cities = CityCache()
    if which in {"contested", "larger"}:
        stages = contested(cities, larger=which == "larger")
    else:
        names = TESTS if which == "tests" else TRAINING
        stages = [cities.build(load_scenario(name)) for name in names]
    play(stages[0], "horizon=1", [0])  # compiles
    machine = describe()
    print(f"{machine['processor']}, {n_seeds} seeds from {first_seed}\n")
    labels = [str(k) for k in range(1, len(stages) + 1)] if which in {"contested", "larger"} else list(names)
    print("| options | mean | " + " | ".join(labels) + " | s an episode |")
    print("|---" * (len(stages) + 3) + "|")
    for options in chosen or OPTIONS:
        results = [play(built, options, range(first_seed, first_seed + n_seeds)) for built in stages]
        cells = " | ".join(f"{result.score:.3f}" for result in results)
        mean, seconds = fmean(result.score for result in results), fmean(result.seconds for result in results)
        print(f"| {options or 'default'} | {mean:.3f} | {cells} | {seconds:.2f} |", flush=True)


if __name__ == "__main__":
    main()
