"""Fights under the ten conditions in which benchmarks try out options of a team: which fires, with which seeds."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Sequence
from itertools import chain
from typing import TypeVar

from fireworld.draws import FIRE, hash_key
from fireworld.executors import On, workers_for
from fireworld.kernels.arrays import NetworkArrays
from fireworld.policy.kernel import KernelPolicy
from fireworld.policy.names import find_policy
from fireworld.simulation.built import BuiltScenario, CityCache
from fireworld.training.curriculum import load_curriculum
from fireworld.training.seeds import fight_seed

T = TypeVar("T")
Fires = Sequence[Sequence[BuiltScenario]]


def network_of(team: str, parser: argparse.ArgumentParser) -> NetworkArrays:
    """Return the network of a team; the parser ends with an error if it has none."""
    policy = find_policy(team).policy
    if not isinstance(policy, KernelPolicy) or not len(policy.network.layer):
        parser.error(f"--team: expected a team with a network, got {team}")
    return policy.network


def fires_by_condition() -> Fires:
    """Build the fires of the curriculum `conditions`, condition by condition."""
    cities = CityCache()
    return [[cities.build(one) for one in stage.scenarios] for stage in load_curriculum("conditions").stages]


def in_fights(
    fires: Fires, n_fights: int, seed: int, fight: Callable[[BuiltScenario, int, int], Iterable[T]]
) -> list[T]:
    """Return what is found in so many fights, one after another; the conditions come in turn, on all threads.

    Args:
        fires: by condition.
        n_fights: how many.
        seed: of the fires that are drawn, and of the fights.
        fight: called with a fire, the number of the fight and its seed; returns what it found.
    """

    def numbered(number: int) -> Iterable[T]:
        among = fires[number % len(fires)]
        built = among[hash_key(seed, FIRE, number, 0) % len(among)]
        return fight(built, number, fight_seed(seed, number, 0))

    workers = workers_for(On("threads"))
    with workers.make_pool(workers.n) as pool:
        return [*chain.from_iterable(pool.map(numbered, range(n_fights)))]
