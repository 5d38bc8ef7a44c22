"""The conformance test that any policy inherits: the built-in ones pass, policies with a fault do not."""

from __future__ import annotations

import random

import numpy as np
import pytest

from fireworld.errors import PolicyError
from fireworld.policy.kernel import from_assignment, from_rankings, from_tables
from fireworld.policy.names import BUILT_IN, find_policy
from fireworld.policy.protocol import Action, Decision
from fireworld.testing import PolicyConformance
from tests.networks import make_network

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("name", BUILT_IN)
class TestBuiltIn(PolicyConformance):
    @pytest.fixture(autouse=True)
    def _named(self, name):
        self.name = name

    def make_policy(self):
        return find_policy(self.name).policy


class TestExploringTable(PolicyConformance):
    def make_policy(self):
        tables = np.random.default_rng(1).normal(size=(2, 4320, 4))
        return from_tables(tables, epsilon=0.5)


@pytest.mark.parametrize("own_targets", [False, True])
class TestRanking(PolicyConformance):
    @pytest.fixture(autouse=True)
    def _kind(self, own_targets):
        self.own_targets = own_targets

    def make_policy(self):
        return from_rankings(np.random.default_rng(1).normal(size=(2, 17)), own_targets=self.own_targets)


class TestAssignment(PolicyConformance):
    def make_policy(self):
        return from_assignment(np.random.default_rng(1).normal(size=17))


class TestNetwork(TestRanking):
    def make_policy(self):
        return make_network(own_targets=self.own_targets).policy()


class AlwaysNear:
    def decide(self, observation):
        return Decision(Action.NEAREST_TO_ME)


class Steady(AlwaysNear):
    """Decides anew in every third step only, and does not look whether there is something to keep."""

    def keeps(self, brigade, last_action, step):
        return step % 3 != 0


class TestSteady(PolicyConformance):
    def make_policy(self):
        return Steady()


class TestOwn(PolicyConformance):
    def make_policy(self):
        return AlwaysNear()


class Global:
    def decide(self, observation):
        return Decision(random.randrange(4))


class GlobalNumpy:
    def decide(self, observation):
        return Decision(int(np.random.randint(4)))  # noqa: NPY002 - the fault


class Meddler:
    def decide(self, observation):
        observation.world.fire.energy.base[0] += 1.0  # behind the view that it was given
        return Decision(0)


class Unseeded:
    def __init__(self):
        self.random = np.random.default_rng()

    def decide(self, observation):
        return Decision(int(self.random.integers(4)))


class Forgetful:
    """Counts on through runs, because it has no `begin`."""

    def __init__(self):
        self.asked = 0

    def decide(self, observation):
        self.asked += 1
        return Decision(min(self.asked // 20, 3))


class Wordless:
    def decide(self, observation):
        return None


class CityMeddler(AlwaysNear):
    def begin(self, city, n_brigades, seed):
        city.buildings.capacity.base[0] += 1.0


class Hasty(AlwaysNear):
    """Keeps by what it noted in `decide`, which in a fork it has not seen."""

    def begin(self, city, n_brigades, seed):
        self.until = {}

    def decide(self, observation):
        self.until[observation.brigade] = observation.step + 3
        return super().decide(observation)

    def keeps(self, brigade, last_action, step):
        return step < self.until[brigade]


class Moody(AlwaysNear):
    def __init__(self):
        self.asked = 0

    def keeps(self, brigade, last_action, step):
        self.asked += 1
        return self.asked % 2 == 0


class GlobalKeeps(AlwaysNear):
    def keeps(self, brigade, last_action, step):
        return random.random() < 2


@pytest.mark.parametrize(
    ("make", "test", "message"),
    [
        (object, "test_has_a_method_decide", "has a method decide"),
        (Wordless, "test_decides_in_every_step", "expected a Decision"),
        (Meddler, "test_decides_in_every_step", "changed the world's fire.energy"),
        (Global, "test_decides_in_every_step", "global randomness"),
        (GlobalNumpy, "test_decides_in_every_step", "global randomness"),
        (Unseeded, "test_same_seed_same_decisions", "one seed led to two runs"),
        (Forgetful, "test_begins_anew", "something of the run before is left"),
        (CityMeddler, "test_decides_in_every_step", r"begin\(\) changed the city's buildings.capacity"),
        (Hasty, "test_keeps_from_any_step_on", "keeps: KeyError: 0"),
        (Moody, "test_keeps_from_any_step_on", "answers differently"),
        (Moody, "test_decides_in_every_step", "answers differently"),
        (GlobalKeeps, "test_decides_in_every_step", r"keeps\(\) used global randomness"),
    ],
)
def test_faults_are_found(make, test, message):
    conformance = PolicyConformance()
    conformance.make_policy = make
    with pytest.raises((AssertionError, PolicyError), match=message):
        getattr(conformance, test)()


def test_a_city_that_was_changed_is_as_before():
    """It is shared by the tests of all policies."""
    conformance = PolicyConformance()
    for _ in range(2):
        conformance.make_policy = CityMeddler
        with pytest.raises(AssertionError, match="changed the city"):
            conformance.test_same_seed_same_decisions()
        conformance.make_policy = AlwaysNear
        conformance.test_decides_in_every_step()
