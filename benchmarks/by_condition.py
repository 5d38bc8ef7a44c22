"""How teams fare under each condition of a curriculum: a table in Markdown, as docs/science.md has it.

    python -m benchmarks.by_condition TEAM... [--curriculum conditions] [--seeds 2] [--first-seed 9001] [--steps N]

The fires are those that teams learn in, so this flatters who learned there: what a team is worth elsewhere is for
`fireworld leaderboard` to say.
"""

from __future__ import annotations

import argparse
import math

from benchmarks.learning_fires import shares
from fireworld.markdown import markdown_table
from fireworld.policy.names import find_policy
from fireworld.simulation.built import CityCache
from fireworld.training.curriculum import load_curriculum


def main() -> None:
    """Measure each team under each condition, and print the table."""
    parser = argparse.ArgumentParser(description="How teams fare under each condition of a curriculum.")
    parser.add_argument("teams", nargs="+", metavar="TEAM", help="a policy or a team file")
    parser.add_argument("--curriculum", default="conditions", help="whose stages are the conditions")
    parser.add_argument("--seeds", type=int, default=2, help="runs of each fire")
    parser.add_argument("--first-seed", type=int, default=9001)
    parser.add_argument("--steps", type=int, help="of a run at most; all of the scenario's if left out")
    given = parser.parse_args()
    cities, seeds = CityCache(), range(given.first_seed, given.first_seed + given.seeds)
    stages = {
        stage.name: [
            cities.build(one if given.steps is None else one.with_values({"steps": min(given.steps, one.steps)}))
            for one in stage.scenarios
        ]
        for stage in load_curriculum(given.curriculum).stages
    }
    rows = []
    for name in given.teams:
        policy = find_policy(name).policy
        means = [float(shares(fires, policy, seeds).mean()) for fires in stages.values()]
        rows.append([name, f"{math.fsum(means) / len(means):.3f}", *(f"{mean:.2f}" for mean in means)])
    print(markdown_table(["team", "mean", *stages], rows))


if __name__ == "__main__":
    main()
