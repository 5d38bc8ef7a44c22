"""Runs: a policy in a world, step by step, as records."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from fireworld.policy.asking import begin
from fireworld.policy.names import NamedPolicy
from fireworld.policy.protocol import Policy
from fireworld.records import CityRecord, RunHeader, StepRecord
from fireworld.simulation.built import BuiltScenario
from fireworld.simulation.observer import Observer
from fireworld.simulation.world import World


@dataclass(frozen=True)
class Run:
    """A run that is about to happen: iterate over it to let it happen."""

    header: RunHeader
    city: CityRecord
    world: World
    policy: Policy

    def __iter__(self) -> Iterator[StepRecord]:
        """Yield the start and then every step, until nothing burns or the last step is done."""
        begin(self.policy, self.world.city_arrays, n_brigades=self.world.n_brigades, seed=self.world.seed)
        observer = Observer(self.world)
        yield observer.record()
        while not (self.world.terminated or self.world.truncated):
            yield observer.record(self.world.step(self.policy))


def prepare_run(built: BuiltScenario, named: NamedPolicy, *, seed: int, n_steps_max: int | None = None) -> Run:
    """Get a run ready.

    Args:
        built: the scenario, built.
        named: the policy.
        seed: of the run's luck.
        n_steps_max: last step; None: the scenario's.
    """
    world = built.world(seed=seed, n_steps_max=n_steps_max)
    header = built.header(seed=seed, policy=named.name, policy_digest=named.digest, n_steps_max=world.n_steps_max)
    header = replace(header, attachments={**header.attachments, **named.attachments})
    return Run(header=header, city=built.city_record(), world=world, policy=named.policy)
