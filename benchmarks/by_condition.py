"""How teams fare under each condition of a curriculum: a table in Markdown, as docs/science.md has it.

    python -m benchmarks.by_condition TEAM... [--curriculum conditions] [--seeds 2] [--first-seed 9001] [--steps N]

The fires are those that teams learn in, so this flatters who learned there: what a team is worth elsewhere is for
`fireworld leaderboard` to say.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from fireworld.evaluation.runs import evaluate
from fireworld.executors import On, workers_for
from fireworld.policy.kernel import KernelPolicy
from fireworld.policy.names import find_policy
from fireworld.simulation.built import BuiltScenario, CityCache
from fireworld.training.curriculum import load_curriculum


def mean_share(builts: Sequence[BuiltScenario], policy: KernelPolicy, seeds: Sequence[int]) -> float:
    """Return the mean share of the greatest score over the runs of each fire."""
    shares = [share for built in builts for share in evaluate(built, policy, seeds).score_share]
    return math.fsum(shares) / len(shares)


def main() -> None:
    """Measure each team under each condition, and print the table."""
    parser = argparse.ArgumentParser(description="How teams fare under each condition of a curriculum.")
    parser.add_argument("teams", nargs="+", metavar="TEAM", help="a policy that kernels follow, or a team file")
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
    print("| team | " + " | ".join([*stages, "mean"]) + " |\n" + "|---" * (len(stages) + 2) + "|")
    workers = workers_for(On("threads"))
    for name in given.teams:
        policy = find_policy(name).policy
        if not isinstance(policy, KernelPolicy):
            parser.error(f"{name}: not a policy that kernels follow")
        tasks = [partial(mean_share, builts, replace(policy), seeds) for builts in stages.values()]
        means = workers.run(tasks, lambda *_: None)
        assert means is not None, "nobody asks them to stop"
        cells = [*(f"{mean:.2f}" for mean in means), f"{math.fsum(means) / len(means):.3f}"]
        print(f"| {name} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
