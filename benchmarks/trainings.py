"""How a method fares over several trainings, in suites that nobody learned in: a table in Markdown for the docs.

    python -m benchmarks.trainings t-*.npz [--than OTHER...] [--suites contested,larger] [--seeds 20] [--first-seed 1]
    python -m benchmarks.trainings t-*.npz --curriculum unseen
    python -m benchmarks.trainings t-*.npz --drawn 300

A row a suite; or a stage of a curriculum; or, with `--drawn`, so many fires that are drawn like those of a stage
(`benchmarks.drawn_fires`), each with one seed, and a row of all of them. It says: the mean over the trainings with its
95 % interval, where trainings and fires are both drawn anew (where there are fewer than ten fires, trainings and
seeds); the worst and the best training; and how many trainings are below .9. With `--than` it says how much more is
saved than by other teams: as many trainings, taken in pairs, or one policy.
"""

from __future__ import annotations

import argparse
import sys

import click
import numpy as np

from benchmarks.drawn_fires import add_drawn, fires_of
from benchmarks.learning_fires import shares, table_of
from fireworld.evaluation.statistics import Estimate, estimate, paired_difference
from fireworld.evaluation.suites import suite
from fireworld.kernels.arrays import Array
from fireworld.markdown import markdown_table
from fireworld.policy.kernel import KernelPolicy
from fireworld.policy.names import find_policy
from fireworld.simulation.built import CityCache
from fireworld.training.curriculum import load_curriculum

SUITES = "tests,contested,larger,scarce-water,two-sites,few-brigades,many-brigades"
LOW = 0.9


def row_of(name: str, runs: Array, others: Array | None) -> list[str]:
    """Return what the table says of a suite."""
    table, by_team = table_of(runs), runs.mean(axis=(1, 2))
    cells = [_text(estimate(table)), *(f"{one:.2f}" for one in (by_team.min(), by_team.max()))]
    cells.append(f"{(by_team < LOW).sum()} of {len(by_team)}")
    if others is not None:
        cells.append(_text(paired_difference(table, table_of(others)), sign=True))
    return [f"{name} ({runs.shape[1]})", *cells]


def _text(one: Estimate, *, sign: bool = False) -> str:
    return one.text(digits=3, sign=sign)


def main() -> None:
    """Run all teams in every suite, and print the table."""
    parser = argparse.ArgumentParser(description="How a method fares over several trainings.")
    parser.add_argument("teams", nargs="+", metavar="TEAM", help="a policy that kernels follow, or a team file")
    parser.add_argument("--than", nargs="+", metavar="TEAM", default=[], help="as many others, or one")
    parser.add_argument("--suites", default=SUITES)
    parser.add_argument("--curriculum", help="a row for each of its stages in place of suites: one nobody learned in")
    add_drawn(parser, "stage")
    parser.add_argument("--seeds", type=int, default=20, help="runs of each fire")
    parser.add_argument("--first-seed", type=int, default=1)
    given = parser.parse_args()
    if len(given.than) not in (0, 1, len(given.teams)):
        parser.error(f"--than: expected 1 or {len(given.teams)} teams, got {len(given.than)}")
    policies = {name: find_policy(name).policy for name in (*given.teams, *given.than)}
    if odd := [name for name, policy in policies.items() if not isinstance(policy, KernelPolicy)]:
        parser.error(f"{odd[0]}: not a policy that kernels follow")
    n_seeds, curriculum = 1 if given.drawn else given.seeds, given.curriculum or ("conditions" if given.drawn else None)
    cities, seeds, first = CityCache(), range(given.first_seed, given.first_seed + n_seeds), given.first_seed
    if curriculum is None:
        groups = [(name, suite(name).scenarios) for name in given.suites.split(",")]
    else:
        groups = [(stage.name, stage.scenarios) for stage in load_curriculum(curriculum).stages]
    found = dict[str, tuple[Array, Array]]()
    with click.progressbar([*enumerate(groups)], label="fires", file=sys.stderr) as bar:
        for place, (name, scenarios) in bar:
            fires = fires_of(scenarios, cities, drawn=given.drawn, seed=first + place)
            runs, others = (
                np.array([shares(fires, policies[one], seeds) for one in some]) for some in (given.teams, given.than)
            )
            found[name] = runs, others.reshape(-1, *runs.shape[1:])
    if given.drawn:
        runs, others = (np.concatenate(all_of_them, axis=-2) for all_of_them in zip(*found.values(), strict=True))
        found["all"] = runs, others
    rows = [row_of(name, runs, others if given.than else None) for name, (runs, others) in found.items()]
    head = [
        "suite (fires)" if curriculum is None else "stage (fires)",
        f"mean of {len(given.teams)}",
        "worst",
        "best",
        f"below {LOW}",
    ]
    more = [f"more than {'the others' if len(given.than) > 1 else given.than[0]}"] if given.than else []
    print(markdown_table([*head, *more], rows))


if __name__ == "__main__":
    main()
