"""How well a fire must be known to say what an option is worth: options are tried out in it and in fires nearly alike.

    python -m benchmarks.blurred [--team best] [--fights 800] [--horizon 200] [--rollouts 6] [--seed 41]

In a fight of the curriculum `conditions`, in one of its first 40 steps, options of a brigade are tried out, in as many
rollouts once more with other random draws, and as often in the same fire with the heat and the fuel of every burning
building multiplied by numbers around 1 of their own. Another option than the team's own is worth less or more than
that by so much; shares are of the greatest score.

    blur      how far those numbers spread, from one building to the next
    agrees    how what options are worth there goes with what they are worth in the fire itself: 1 is as well as in
              the fire itself
    gain      what the option that is worth the most there gains in the fire itself, on the mean of all decisions
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Final

import numpy as np

from benchmarks.fights import Fires, fires_by_condition, in_fights, network_of
from fireworld.draws import MOMENT, OPTION, below
from fireworld.kernels.arrays import Array, NetworkArrays, WorldState
from fireworld.markdown import markdown_table
from fireworld.policy.kernel import from_network
from fireworld.simulation.built import BuiltScenario
from fireworld.simulation.state import copy_world
from fireworld.training.options import Asking, Rollouts, Trial

Worths = tuple[Array, ...]
BLURS: Final = (0.03, 0.1, 0.3)
FIRST_STEPS: Final = 40
"""In one of these a brigade is asked."""


def blurred(state: WorldState, blur: float, draws: np.random.Generator) -> WorldState:
    """Return a copy of a state in which the heat and the fuel of every burning building are others by about `blur`."""
    copy = copy_world(state)
    fire = copy.fire
    burning = (fire.fieryness >= 1) & (fire.fieryness <= 3)
    for values, most in ((fire.energy, np.inf), (fire.fuel, fire.fuel.copy())):
        times = np.where(burning, 1.0 + blur * draws.standard_normal(len(values)), 1.0)
        values[:] = np.clip(values * times, 0.0, most)
    return copy


def worths(built: BuiltScenario, network: NetworkArrays, trial: Trial, *, seed: int, step: int) -> Worths | None:
    """Fight up to a step, and try out the options of one brigade there; None if it has no choice.

    Returns:
        What options are worth, (k,) each, the own one first; in the fire, once more, and blurred.
    """
    policy = from_network(network, own_targets=True)
    world = built.world(seed=seed, n_steps_max=built.scenario.steps)
    policy.begin(world.city_arrays, world.n_brigades, world.seed)
    while world.step_number < step - 1 and not (world.terminated or world.truncated):
        world.step(policy)
    if world.terminated or world.truncated:
        return None
    rollouts, before = Rollouts(world, policy, trial), copy_world(world.state)
    asking = Asking(policy, [below(seed, OPTION, 0, step, bound=world.n_brigades)], trial.n_likely)
    world.step(asking)
    if not asking.asked or len(asking.asked[0].targets) < 2:
        return None
    draws = np.random.default_rng(seed)
    states = [before, before, *(blurred(before, blur, draws) for blur in BLURS)]
    return tuple(
        rollouts.tried(state, step, asking.asked[0], first=number * trial.n_rollouts).worth
        for number, state in enumerate(states)
    )


def found_in(fires: Fires, network: NetworkArrays, trial: Trial, n_fights: int, seed: int) -> list[Worths]:
    """Return what options are worth, decision by decision."""

    def fight(built: BuiltScenario, number: int, fight_seed: int) -> list[Worths]:
        step = 1 + below(seed, MOMENT, number, 0, bound=FIRST_STEPS)
        found = worths(built, network, trial, seed=fight_seed, step=step)
        return [] if found is None else [found]

    return in_fights(fires, n_fights, seed, fight)


def together(one: Sequence[Array], other: Sequence[Array]) -> float:
    """Return the mean product of what options but the own ones are worth in two ways."""
    return float((np.concatenate([worth[1:] for worth in one]) * np.concatenate([worth[1:] for worth in other])).mean())


def gain(chosen_by: Sequence[Array], measured_by: Sequence[Array]) -> float:
    """Return what is gained by the options that one side holds to be worth the most, measured by the other."""
    return float(np.mean([its[by.argmax()] for by, its in zip(chosen_by, measured_by, strict=True)]))


def main() -> None:
    """Try options out in fires and in fires nearly alike, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--team", default="best", help="a team with a network, whose decisions are tried out")
    parser.add_argument("--fights", type=int, default=800)
    parser.add_argument("--horizon", type=int, default=200, help="steps of a rollout")
    parser.add_argument("--rollouts", type=int, default=6, help="of every option, in every fire")
    parser.add_argument("--seed", type=int, default=41)
    given = parser.parse_args()
    network = network_of(given.team, parser)
    trial = Trial(
        share=1.0, n_brigades=1, n_options=4, n_likely=2, n_rollouts=given.rollouts, commit=6, horizon=given.horizon
    )
    found = found_in(fires_by_condition(), network, trial, given.fights, given.seed)
    if not found:
        parser.error("--fights: expected fights in which a brigade has a choice, got none")
    itself, again, *others = zip(*found, strict=True)
    alike = together(itself, again)
    rows = [["0", "1.00", f"{(gain(itself, again) + gain(again, itself)) / 2:+.3f}"]]
    for blur, other in zip(BLURS, others, strict=True):
        agrees = (together(itself, other) + together(again, other)) / (2.0 * alike)
        gained = (gain(other, itself) + gain(other, again)) / 2.0
        rows.append([f"{blur:g}", f"{agrees:.2f}", f"{gained:+.3f}"])
    n_options = sum(len(worth) - 1 for worth in itself)
    print(f"{n_options} options of {len(found)} decisions of {given.team}; worth spreads by {alike**0.5:.3f}\n")
    print(markdown_table(["blur", "agrees", "gain"], rows))


if __name__ == "__main__":
    main()
