"""How far rollouts must look: what options come to after more and more steps, and how much of that is chance.

    python -m benchmarks.horizons [--team best] [--fights 130] [--horizons 25,50,100,200] [--seed 31]

Options of a team's decisions are tried out in fights of the curriculum `conditions`, in two rollouts each with other
random draws. What two rollouts of one option share is what it is worth; what they do not share is chance. Another
option than the team's own is worth less or more than that by so much:

    one rollout   the spread of what a single rollout says, in hundredths of the greatest score
    worth         the spread of what all rollouts together would say
    share         how much of what a single rollout says is worth: the square of worth / one rollout
    agrees        how what options are worth after so many steps correlates with what they are after the most
    cost          processor time beside that of the shortest
"""

from __future__ import annotations

import argparse
import math
import time
from threading import Event

import numpy as np

from benchmarks.fights import Fires, fires_by_condition, in_fights, network_of
from fireworld.kernels.arrays import Array, NetworkArrays
from fireworld.markdown import markdown_table
from fireworld.policy.kernel import from_network
from fireworld.simulation.built import BuiltScenario
from fireworld.training.options import Trial, TriedDecision, try_options

STEPS_MAX = 200
"""Of a fight; rollouts look further."""


def tried_out(
    fires: Fires, network: NetworkArrays, trial: Trial, n_fights: int, seed: int
) -> tuple[list[TriedDecision], float]:
    """Return the decisions that are tried out, the conditions in turn, and the processor time of a rollout."""

    def fight(built: BuiltScenario, _: int, fight_seed: int) -> list[TriedDecision]:
        policy = from_network(network, own_targets=True)
        world = built.world(seed=fight_seed, n_steps_max=min(STEPS_MAX, built.scenario.steps))
        return try_options(world, policy, trial, Event())

    began = time.process_time()
    found = in_fights(fires, n_fights, seed, fight)
    n_rollouts = trial.n_rollouts * sum(len(one.worth) for one in found)
    return found, (time.process_time() - began) / max(n_rollouts, 1)


def two_rollouts(fires: Fires, network: NetworkArrays, horizon: int, n_fights: int, seed: int) -> tuple[Array, float]:
    """Return what two rollouts of every option but the own one say, (options, 2), and the time of a rollout."""
    worths, seconds = list[Array](), 0.0
    for n_rollouts in (1, 2):
        trial = Trial(
            share=0.2, n_brigades=2, n_options=5, n_likely=2, n_rollouts=n_rollouts, commit=6, horizon=horizon
        )
        found, seconds = tried_out(fires, network, trial, n_fights, seed)
        worths.append(np.concatenate([one.worth[1:] for one in found]))
    first, mean = worths  # rollouts are numbered: the first of two is the one made alone
    return np.column_stack([first, 2.0 * mean - first]), seconds


def main() -> None:
    """Measure each horizon, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--team", default="best", help="a team with a network, whose decisions are tried out")
    parser.add_argument("--fights", type=int, default=130)
    parser.add_argument("--horizons", default="25,50,100,200", help="steps, rising")
    parser.add_argument("--seed", type=int, default=31)
    given = parser.parse_args()
    network = network_of(given.team, parser)
    horizons = [int(word) for word in given.horizons.split(",")]
    fires = fires_by_condition()
    found = [two_rollouts(fires, network, horizon, given.fights, given.seed) for horizon in horizons]
    longest, shortest_time = found[-1][0], found[0][1]
    meant_most = math.sqrt(max(float((longest[:, 0] * longest[:, 1]).mean()), 0.0))
    rows = []
    for horizon, (worth, seconds) in zip(horizons, found, strict=True):
        single = math.sqrt(float((worth**2).mean()))
        meant = math.sqrt(max(float((worth[:, 0] * worth[:, 1]).mean()), 0.0))
        both = float((worth * longest[:, ::-1]).mean())
        agrees = both / (meant * meant_most) if meant * meant_most > 0.0 else math.nan
        share = (meant / single) ** 2
        cost = seconds / shortest_time
        rows.append(
            [str(horizon), f"{100 * single:.1f}", f"{100 * meant:.1f}", f"{share:.2f}", f"{agrees:.2f}", f"{cost:.1f}"]
        )
    print(f"{len(longest)} options of {given.team} in {given.fights} fights\n")
    print(markdown_table(["steps", "one rollout", "worth", "share", "agrees", "cost"], rows))


if __name__ == "__main__":
    main()
