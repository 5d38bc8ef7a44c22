"""How contested is a fire: what policies that learn nothing make of it, by the number of buildings that burn first.

A scenario is worth playing if it is neither won nor lost whatever one does. The shipped scenarios were set with this
table: `python -m benchmarks.calibrate --scenarios test-1,test-2,test-3 --counts 8-12`. No learning policy takes part.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from statistics import fmean
from typing import Final

import click
from rich.console import Console
from rich.table import Table

from fireworld.evaluation.runs import evaluate
from fireworld.evaluation.statistics import mean
from fireworld.policy.names import BUILT_IN
from fireworld.scenario import load_scenario, scenario_names
from fireworld.simulation.built import build_scenario

POLICIES: Final = ("easiest", "nearest-to-civilian", "nearest-to-center", "nearest-to-me", "each-another", "random")
FIRST_SEED: Final = 1000


def rows(scenarios: Iterable[str], counts: Iterable[int | None], *, n_seeds: int) -> Iterator[list[str]]:
    """Yield a row of the table for every scenario and number of burning buildings (None: as shipped)."""
    seeds = range(FIRST_SEED, FIRST_SEED + n_seeds)
    for name in scenarios:
        for count in counts:
            settings = {} if count is None else {"fires.0.n_buildings": str(count)}
            built = build_scenario(load_scenario(name).with_settings(settings))
            outcomes = [evaluate(built, BUILT_IN[policy](), seeds) for policy in POLICIES]
            cells = [
                f"{mean(found.score_share):.2f} {mean(found.burnt_out):3.0f} {mean(found.steps):3.0f}"
                for found in outcomes
            ]
            of_all = fmean(mean(found.score_share) for found in outcomes)
            yield [name, str(len(built.placement.ignited)), f"{of_all:.2f}", *cells]


def parse_counts(text: str | None) -> list[int | None]:
    """Turn "8-12" into the whole numbers from 8 to 12; nothing into the scenarios' own."""
    if text is None:
        return [None]
    first, _, last = text.partition("-")
    return list(range(int(first), int(last or first) + 1))


@click.command()
@click.option("--scenarios", default="test-1,test-2,test-3", show_default=True, help="Names, with commas; or all.")
@click.option("--counts", help="Burning buildings at the start, as 8-12.  [default: the scenarios']")
@click.option("--seeds", "n_seeds", default=10, show_default=True, help="Runs of each policy.")
@click.option("--markdown", is_flag=True, help="Write the table as it stands in docs/scenarios.md.")
def main(scenarios: str, counts: str | None, n_seeds: int, *, markdown: bool) -> None:
    """Print score / maximum, burnt-out buildings and steps of every fixed policy."""
    names = scenario_names() if scenarios == "all" else scenarios.split(",")
    found = rows(names, parse_counts(counts), n_seeds=n_seeds)
    if markdown:
        print("| " + " | ".join(["scenario", "fire", "mean", *POLICIES]) + " |")
        print("|---" * (3 + len(POLICIES)) + "|")
        for row in found:
            print("| " + " | ".join([f"`{row[0]}`", *row[1:3], *(cell.split()[0] for cell in row[3:])]) + " |")
        return
    table = Table("scenario", "fire", "mean", *POLICIES, title=f"score / maximum, burnt out, steps; {n_seeds} seeds")
    for row in found:
        table.add_row(*row)
    Console(width=160).print(table)


if __name__ == "__main__":
    main()
