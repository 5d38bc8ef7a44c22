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
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
from typing import Final

import numpy as np

from fireworld.kernels.arrays import CityArrays
from fireworld.policy.asking import ask, begin, complete, keeps
from fireworld.policy.protocol import Action, Decision, Observation, Policy
from fireworld.scenario import load_scenario
from fireworld.simulation.built import BuiltScenario, build_scenario
from fireworld.simulation.state import named_arrays
from fireworld.simulation.world import World

SCENARIO: Final = "quick"
STEPS: Final = 30


@lru_cache(maxsize=4)
def _built(n_brigades: int) -> BuiltScenario:
    """Build the scenario of the tests once for every size of team."""
    return build_scenario(load_scenario(SCENARIO).with_settings({"brigades.n": str(n_brigades)}))


class _Watched(Policy):
    """Passes calls on to a policy, and checks that they change nothing but the policy."""

    def __init__(self, policy: Policy, world: World) -> None:
        self.policy = policy
        self.arrays = [
            *((f"city's {name}", array) for name, array in named_arrays(world.city_arrays)),
            *((f"world's {name}", array) for name, array in named_arrays(world.state)),
        ]

    def begin(self, city: CityArrays, n_brigades: int, seed: int) -> None:
        with self._unchanged("begin()"):
            begin(self.policy, city, n_brigades=n_brigades, seed=seed)

    def keeps(self, brigade: int, last_action: int, step: int) -> bool:
        with self._unchanged("keeps()"):
            answers = {keeps(self.policy, brigade, last_action, step) for _ in range(2)}
        assert len(answers) == 1, "keeps() answers differently when it is called again for the same brigade and step"
        return answers.pop()

    def decide(self, observation: Observation) -> Decision:
        with self._unchanged("decide()"):
            return ask(self.policy, observation)

    @contextmanager
    def _unchanged(self, call: str) -> Iterator[None]:
        before = [(name, array.copy()) for name, array in self.arrays]
        drawn = _global_randomness()
        yield
        for (name, held), (_, array) in zip(before, self.arrays, strict=True):
            if not np.array_equal(held, array, equal_nan=True):
                array[...] = held  # the city is shared with the tests that come after
                raise AssertionError(f"{call} changed the {name}")
        assert _global_randomness() == drawn, f"{call} used global randomness; draw from fireworld.draws or a generator"


class PolicyConformance:
    """Inherit from this in a test, with a `make_policy` of your own."""

    def make_policy(self) -> Policy:
        """Return a new policy."""
        raise NotImplementedError

    def test_has_a_method_decide(self) -> None:
        """A policy is something with a method `decide`."""
        assert isinstance(self.make_policy(), Policy), "a policy has a method decide(observation)"

    def test_decides_in_every_step(self) -> None:
        """Decisions for teams of several sizes are Decisions, and neither they nor `begin` change anything else."""
        for n_brigades in (1, 2, 5):
            assert _play(self.make_policy(), n_brigades=n_brigades), "nobody was ever asked"

    def test_same_seed_same_decisions(self) -> None:
        """Two new policies decide alike: a run can be repeated from its seed."""
        assert _play(self.make_policy()) == _play(self.make_policy()), "one seed led to two runs"

    def test_begins_anew(self) -> None:
        """A policy that has played another run decides like a new one."""
        used = self.make_policy()
        _play(used, seed=2)
        assert _play(used) == _play(self.make_policy()), "something of the run before is left; see `begin`"

    def test_keeps_from_any_step_on(self) -> None:
        """`keeps` answers for any brigade, action and step after `begin`: a fork begins in the middle of a run."""
        watched, world = _begun(self.make_policy(), n_brigades=5, seed=1)
        for brigade in range(world.n_brigades):
            for last_action in range(len(Action)):
                for step in range(1, STEPS + 1):
                    watched.keeps(brigade, last_action, step)


def _global_randomness() -> tuple[object, ...]:
    """Return where the generators of the whole process stand."""
    name, keys, *rest = np.random.get_state(legacy=True)  # noqa: NPY002 - the state that must not change
    return random.getstate(), name, np.asarray(keys).tobytes(), *rest


def _begun(policy: object, *, n_brigades: int, seed: int) -> tuple[_Watched, World]:
    """Return a watched policy for which a run begins, and the world of the run."""
    world = _built(n_brigades).world(seed=seed, n_steps_max=STEPS)
    watched = _Watched(complete(policy), world)
    watched.begin(world.city_arrays, n_brigades, seed)
    return watched, world


def _play(policy: object, *, n_brigades: int = 3, seed: int = 1) -> Sequence[Decision]:
    """Run a short episode and return the decisions."""
    watched, world = _begun(policy, n_brigades=n_brigades, seed=seed)
    decisions: list[Decision] = []
    while not (world.terminated or world.truncated):
        decisions += [decision for decision in world.step(watched).decisions if decision.action >= 0]
    return decisions
