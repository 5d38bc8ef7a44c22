"""How teams fare under each condition of a curriculum: a table in Markdown, as docs/science.md has it.

    python -m benchmarks.by_condition TEAM... [--curriculum conditions] [--seeds 2] [--first-seed 9001] [--steps N]

The fires are those that teams learn in, so this flatters who learned there: what a team is worth elsewhere is for
`fireworld leaderboard` to say.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator, Mapping, Sequence

from fireworld.evaluation.runs import evaluate_each
from fireworld.executors import On, workers_for
from fireworld.markdown import markdown_table
from fireworld.policy.kernel import KernelPolicy
from fireworld.policy.names import find_policy
from fireworld.simulation.built import BuiltScenario, CityCache
from fireworld.training.curriculum import load_curriculum


def mean_shares(
    stages: Mapping[str, Sequence[BuiltScenario]], policy: KernelPolicy, seeds: Sequence[int]
) -> Iterator[float]:
    """Yield the mean share of the greatest score in each stage, over all runs of its fires."""
    workers = workers_for(On("threads"))
    for fires in stages.values():
        outcomes = evaluate_each([(built, policy) for built in fires], seeds, workers=workers)
        shares = [share for of_fire in outcomes for share in of_fire.score_share.tolist()]
        yield math.fsum(shares) / len(shares)


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
    rows = []
    for name in given.teams:
        policy = find_policy(name).policy
        if not isinstance(policy, KernelPolicy):
            parser.error(f"{name}: not a policy that kernels follow")
        means = [*mean_shares(stages, policy, seeds)]
        rows.append([name, f"{math.fsum(means) / len(means):.3f}", *(f"{mean:.2f}" for mean in means)])
    print(markdown_table(["team", "mean", *stages], rows))


if __name__ == "__main__":
    main()
