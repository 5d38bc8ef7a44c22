"""The world that is most like the paper's, found by teams that learn nothing, in a small grid that is declared here.

`python -m benchmarks.paper_world` runs a team that acts at random in every world of the grid, in the three tests with
4 and with 7 and 8 brigades, and compares steps and burnt-out buildings with the rows "without cooperation" of the
paper's Tables 2 and 3: nothing that anybody learned has a part in the choice. It prints the fits, today's tests among
them, and writes the scenarios `paper-1` ... of the best fit; with `--check` it says whether they are the shipped ones.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean
from typing import Any, Final

import click

from fireworld.evaluation.runs import evaluate_each
from fireworld.executors import Workers, workers_for
from fireworld.files import write_file
from fireworld.policy.kernel import at_random
from fireworld.reproduction import paper
from fireworld.scenario import Scenario, load_scenario
from fireworld.scenario.shipped import shipped_folder
from fireworld.simulation.built import CityCache

STREETS_M: Final = (8.0, 10.0, 12.0, 14.0, 16.0, 18.0, 20.0)
FILLS: Final = ((0.5, 0.8), (0.6, 0.85), (0.7, 0.97))
FIRES: Final = (1.0, 1.5, 2.0, 2.5)
"""How many times as many buildings burn at first as in today's tests."""
CITY_SEEDS: Final = (167, 168, 169)
FROM_M, TO_M = 90, 220
"""Where civilians are: farther off than today's 65 to 150, and the same in the whole grid, as nothing that is compared
tells of them."""
N_SHOWN: Final = 12
SEEDS: Final = range(500, 510)
"""Of the runs. Nobody is tested with them."""


@dataclass(frozen=True)
class World:
    """A world of the grid."""

    street_m: float
    fill: tuple[float, float]
    fires: float
    city_seed: int

    @property
    def values(self) -> dict[str, Any]:
        """The keys of its scenarios that are not those of today's tests, its fires apart."""
        city = {"street_m": self.street_m, "fill": list(self.fill), "seed": self.city_seed}
        return {f"city.generated.{key}": value for key, value in city.items()} | {
            "civilians.from_m": FROM_M,
            "civilians.to_m": TO_M,
        }

    def scenario(self, name: str) -> Scenario:
        """Return one of today's scenarios in this world."""
        base = load_scenario(name)
        return base.with_values({**self.values, "fires.0.n_buildings": self.n_burning(base)})

    def n_burning(self, base: Scenario) -> int:
        """Return how many buildings burn at first."""
        return round((base.fires[0].n_buildings or 1) * self.fires)


@dataclass(frozen=True)
class Fit:
    """How a world compares with the paper's.

    Attributes:
        steps: means of the rows of Tables 2 and 3, in their order.
        burnt_out: likewise.
    """

    steps: Sequence[float]
    burnt_out: Sequence[float]

    @property
    def distance(self) -> float:
        """Mean size of the logarithms of ours / the paper's; .1 is a tenth too much or too little."""
        pairs = [*zip(self.steps, (row.steps[0] for row in ROWS), strict=True)]
        pairs += zip(self.burnt_out, (row.burnt_out[0] for row in ROWS), strict=True)
        return fmean(abs(math.log(max(ours, 1.0) / theirs)) for ours, theirs in pairs)


ROWS: Final = paper.TESTS.tests


def grid() -> Iterator[World]:
    """Yield all worlds that are tried."""
    for street_m, fill, fires, seed in itertools.product(STREETS_M, FILLS, FIRES, CITY_SEEDS):
        yield World(street_m, fill, fires, seed)


def fit_of(scenarios: Sequence[Scenario], cities: CityCache, workers: Workers) -> Fit:
    """Run a team that acts at random in the scenarios of all rows."""
    measured = [(cities.build(scenario), at_random()) for scenario in scenarios]
    found = evaluate_each(measured, SEEDS, workers=workers)
    return Fit(*([float(getattr(one, name).mean()) for one in found] for name in ("steps", "n_burnt_out")))


def best_of(fits: Mapping[World, Fit]) -> World:
    """Return the world that fits best; of equal ones the first of the grid."""
    return min(fits, key=lambda world: fits[world].distance)


def tests_in(world: World | None) -> list[Scenario]:
    """Return the tests of all rows in a world; None: today's."""
    return [load_scenario(row.scenario) if world is None else world.scenario(row.scenario) for row in ROWS]


def text_of(world: World, name: str) -> str:
    """Return the file of a scenario in a world: that of today's, with other values."""
    base, lines = load_scenario(name), (shipped_folder() / f"{name}.yaml").read_text(encoding="utf-8").splitlines()
    low, high = world.fill
    city = f"seed: {world.city_seed}, street_m: {world.street_m:g}, fill: [{low:g}, {high:g}]"
    found = []
    for number, line in enumerate(lines):
        new = line
        if number == 0:
            new = f"{line.removesuffix('.')}, in a world like the paper's; `python -m benchmarks.paper_world` makes it."
        new = re.sub(r"seed: 167", city, new)
        new = re.sub(r"n_buildings: \d+", f"n_buildings: {world.n_burning(base)}", new)
        found.append(re.sub(r"from_m: \d+, to_m: \d+", f"from_m: {FROM_M}, to_m: {TO_M}", new))
    return "\n".join(found) + "\n"


def table(fits: Mapping[World, Fit], n: int, *, todays: Fit) -> Iterator[str]:
    """Yield a Markdown table: the paper, today's tests, and the worlds that fit best."""
    yield "| world | " + " | ".join(f"{row.scenario}, {row.n_brigades}" for row in ROWS) + " | distance |"
    yield "|---" * (len(ROWS) + 2) + "|"
    yield _row("the paper, without cooperation", Fit([r.steps[0] for r in ROWS], [r.burnt_out[0] for r in ROWS]))
    yield _row("today's tests", todays)
    for world in sorted(fits, key=lambda one: fits[one].distance)[:n]:
        low, high = world.fill
        built = f"{low:.0%} to {high:.0%} built"
        name = f"streets {world.street_m:g} m, {built}, fires x {world.fires:g}, city {world.city_seed}"
        yield _row(name, fits[world])


def _row(name: str, fit: Fit) -> str:
    cells = [f"{burnt:.0f} in {steps:.0f}" for burnt, steps in zip(fit.burnt_out, fit.steps, strict=True)]
    return f"| {name} | " + " | ".join(cells) + f" | {fit.distance:.2f} |"


@click.command()
@click.option("--jobs", type=click.IntRange(1), help="Runs at a time.  [default: cores]")
@click.option("--check", is_flag=True, help="Write nothing; exit code 1 if a shipped scenario is another.")
@click.pass_context
def main(context: click.Context, *, jobs: int | None, check: bool) -> None:
    """Find the world most like the paper's, and write its scenarios."""
    workers, cities = workers_for(jobs), CityCache()
    worlds, fits = list(grid()), {}
    for number, world in enumerate(worlds, 1):
        fits[world] = fit_of(tests_in(world), cities, workers)
        click.echo(f"\r{number} of {len(worlds)} worlds", nl=False, err=True)
    click.echo("", err=True)
    click.echo("\n".join(table(fits, N_SHOWN, todays=fit_of(tests_in(None), cities, workers))))
    best, differing = best_of(fits), []
    for name in (*(row.scenario for row in ROWS), *(row.scenario for row in paper.TESTS.table_1)):
        path, text = shipped_folder() / f"{paper.like_the_papers(name)}.yaml", text_of(best, name)
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            differing.append(path.stem)
            if not check:
                write_file(path, text)
    click.echo(f"{'another' if check else 'written'}: {', '.join(differing)}" if differing else "all as shipped")
    if check and differing:
        context.exit(1)


if __name__ == "__main__":
    main()
