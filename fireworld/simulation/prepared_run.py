"""A prepared run: a policy in a world, step by step, as records."""

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
class PreparedRun:
    """A prepared run; iterating runs it, from its start each time."""

    header: RunHeader
    city: CityRecord
    start: World
    policy: Policy

    def __iter__(self) -> Iterator[StepRecord]:
        """Yield the start and then every step, until nothing burns or the last step is done."""
        world = self.start.copy()
        begin(self.policy, world.city_arrays, n_brigades=world.n_brigades, seed=world.seed)
        observer = Observer(world)
        yield observer.record()
        while not (world.terminated or world.truncated):
            yield observer.record(world.step(self.policy))


def prepare_run(built: BuiltScenario, named: NamedPolicy, *, seed: int, n_steps_max: int | None = None) -> PreparedRun:
    """Prepare a run; its last step is the scenario's unless another is given."""
    world = built.world(seed=seed, n_steps_max=n_steps_max)
    header = built.header(seed=seed, policy=named.name, policy_digest=named.digest, n_steps_max=world.n_steps_max)
    header = replace(header, attachments={**header.attachments, **named.attachments})
    return PreparedRun(header=header, city=built.city_record(), start=world, policy=named.policy)
