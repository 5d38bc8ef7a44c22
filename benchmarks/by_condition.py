"""How teams fare under each condition of a curriculum: a table in Markdown, as docs/science.md has it.

    python -m benchmarks.by_condition TEAM... [--curriculum conditions] [--seeds 2] [--first-seed 9001] [--steps N]
    python -m benchmarks.by_condition TEAM... --drawn 200

The fires are those that teams learn in, so this flatters who learned there. With `--drawn` they are others like them,
so many under each condition, each with one seed: `benchmarks.drawn_fires`.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence

from benchmarks.drawn_fires import add_drawn, fires_of
from benchmarks.learning_fires import shares
from fireworld.kernels.arrays import Array
from fireworld.markdown import markdown_table
from fireworld.policy.names import find_policy
from fireworld.scenario import Scenario
from fireworld.simulation.built import CityCache
from fireworld.training.curriculum import load_curriculum


def shortened(scenarios: Sequence[Scenario], steps: int | None) -> list[Scenario]:
    """Return scenarios that end after so many steps at most."""
    return [one if steps is None else one.with_values({"steps": min(steps, one.steps)}) for one in scenarios]


def more_than(differences: Sequence[Array]) -> str:
    """Write the mean over all conditions of what a team saves more of each fire, and its standard error."""
    mean = math.fsum(float(one.mean()) for one in differences) / len(differences)
    if min(map(len, differences)) < 2:  # one fire has no spread
        return f"{mean:+.3f}"
    variance = math.fsum(float(one.var(ddof=1)) / len(one) for one in differences) / len(differences) ** 2
    return f"{mean:+.3f} ± {math.sqrt(variance):.3f}"


def main() -> None:
    """Measure each team under each condition, and print the table."""
    parser = argparse.ArgumentParser(description="How teams fare under each condition of a curriculum.")
    parser.add_argument("teams", nargs="+", metavar="TEAM", help="a policy or a team file")
    parser.add_argument("--curriculum", default="conditions", help="whose stages are the conditions")
    parser.add_argument("--seeds", type=int, default=2, help="runs of each fire")
    parser.add_argument("--first-seed", type=int, default=9001)
    parser.add_argument("--steps", type=int, help="of a run at most; all of the scenario's if left out")
    add_drawn(parser, "condition")
    given = parser.parse_args()
    n_seeds = 1 if given.drawn else given.seeds
    cities, seeds = CityCache(), range(given.first_seed, given.first_seed + n_seeds)
    curriculum = load_curriculum(given.curriculum)
    stages = {stage.name: shortened(stage.scenarios, given.steps) for stage in curriculum.stages}
    fires = {
        name: fires_of(scenarios, cities, drawn=given.drawn, seed=given.first_seed + place)
        for place, (name, scenarios) in enumerate(stages.items())
    }
    rows, first = [], None
    for name in given.teams:
        policy = find_policy(name).policy
        found = [shares(group, policy, seeds).mean(axis=1) for group in fires.values()]
        first = found if first is None else first
        means, more = [float(one.mean()) for one in found], [one - its for one, its in zip(found, first, strict=True)]
        rows.append([name, f"{math.fsum(means) / len(means):.3f}", more_than(more), *(f"{one:.2f}" for one in means)])
    print(markdown_table(["team", "mean", f"more than {given.teams[0]}", *stages], rows))


if __name__ == "__main__":
    main()
