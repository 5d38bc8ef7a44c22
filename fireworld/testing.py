"""A conformance test that any policy inherits: what fireworld expects of a policy besides good decisions.

    from fireworld.testing import PolicyConformance
    from my_module import MyPolicy

    class TestMyPolicy(PolicyConformance):
        def make_policy(self):
            return MyPolicy()

pytest collects the inherited tests; nothing here needs pytest.
"""

from __future__ import annotations

import random
from collections.abc import Sequence
from functools import lru_cache
from typing import Final

import numpy as np

from fireworld.policy.asking import begin
from fireworld.policy.protocol import Decision, Observation, Policy
from fireworld.scenario import load_scenario
from fireworld.simulation.built import BuiltScenario, build_scenario
from fireworld.simulation.state import named_arrays
from fireworld.simulation.world import World

SCENARIO: Final = "quick"
STEPS: Final = 30


@lru_cache(maxsize=4)
def _stage(n_brigades: int) -> BuiltScenario:
    """Build the scenario of the tests once for every size of team."""
    return build_scenario(load_scenario(SCENARIO).with_settings({"brigades.n": str(n_brigades)}))


class _Watched:
    """Passes a policy's decisions on, and checks that asking for them changes nothing but the policy."""

    def __init__(self, policy: Policy) -> None:
        self.policy = policy

    def decide(self, observation: Observation) -> Decision:
        before = [(name, array.copy()) for name, array in named_arrays(observation.world)]
        luck = (random.getstate(), np.random.get_state(legacy=True))  # noqa: NPY002 - the state that must not change
        decision = self.policy.decide(observation)
        for (name, held), (_, array) in zip(before, named_arrays(observation.world), strict=True):
            assert np.array_equal(held, array, equal_nan=True), f"decide() changed the world's {name}"
        now = (random.getstate(), np.random.get_state(legacy=True))  # noqa: NPY002
        assert repr(now) == repr(luck), "decide() used global randomness; draw from fireworld.draws or a generator"
        return decision


class PolicyConformance:
    """Inherit from this in a test and say how the policy is made."""

    def make_policy(self) -> Policy:
        """Return a new policy."""
        raise NotImplementedError

    def test_has_a_method_decide(self) -> None:
        """A policy is something with a method `decide`."""
        assert isinstance(self.make_policy(), Policy), "a policy has a method decide(observation)"

    def test_decides_in_every_step(self) -> None:
        """Decisions for teams of several sizes are Decisions, and making them changes nothing else."""
        for n_brigades in (1, 2, 5):
            assert _play(self.make_policy(), n_brigades=n_brigades), "nobody was ever asked"

    def test_same_seed_same_decisions(self) -> None:
        """Two new policies decide alike: a run can be had again from its seed."""
        assert _play(self.make_policy()) == _play(self.make_policy()), "one seed led to two runs"

    def test_begins_anew(self) -> None:
        """A policy that has played another run decides like a new one."""
        used = self.make_policy()
        _play(used, seed=2)
        assert _play(used) == _play(self.make_policy()), "something of the run before is left; see `begin`"


def _play(policy: Policy, *, n_brigades: int = 3, seed: int = 1) -> Sequence[Decision]:
    """Run a short episode and return the decisions."""
    world: World = _stage(n_brigades).world(seed=seed, n_steps_max=STEPS)
    watched = _Watched(policy)
    begin(policy, world.city_arrays, n_brigades=n_brigades, seed=seed)
    decisions: list[Decision] = []
    while not (world.terminated or world.truncated):
        choices = world.step(watched)
        decisions += [decision for decision in choices.decisions if decision.action >= 0]
    return decisions
