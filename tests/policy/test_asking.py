"""Asking a policy: plain decisions come back, and every fault of it becomes one line that says where."""

from __future__ import annotations

import numpy as np
import pytest

from fireworld.errors import LogError, PolicyError
from fireworld.policy.asking import begin, name_of
from fireworld.policy.protocol import Action, Decision
from tests.kernels.small import make_city, make_world, square
from tests.simulation.town import town_world

NAME = "policy tests.policy.test_asking:Scripted"


class Scripted:
    """Answers the second brigade as told, the others with a plain decision."""

    def __init__(self, answer):
        self.answer = answer

    def decide(self, observation):
        if observation.brigade != 1:
            return Decision(0)
        return self.answer() if callable(self.answer) else self.answer


def step(answer):
    """Run a step and return the decision of brigade 1."""
    return town_world(seed=1).step(Scripted(answer)).decisions[1]


@pytest.mark.parametrize(
    "answer",
    [
        Decision(2),
        Decision(Action.NEAREST_TO_CENTER),
        Decision(np.int64(2)),
        Decision(np.array(2)),
    ],
)
def test_actions_are_whole_numbers_of_any_kind(answer):
    assert step(answer) == Decision(2)
    assert type(step(answer).action) is int


def test_values_may_be_an_array():
    decision = step(Decision(1, q_values=np.array([0.0, 3.0, -np.inf, 1.0]), explored=np.bool_(True), epsilon=1))
    assert decision == Decision(1, q_values=(0.0, 3.0, float("-inf"), 1.0), explored=True, epsilon=1.0)
    assert [type(value) for value in decision.q_values] == [float] * 4


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (None, "expected a Decision with an action from 0 to 4, got None"),
        (2, "expected a Decision with an action from 0 to 4, got 2"),
        (Decision(5), "got action 5"),
        (Decision(-1), "got action -1"),
        (Decision(1.0), "got action 1.0"),
        (Decision("easiest"), "got action 'easiest'"),
        (Decision(None), "got action None"),
        (Decision(np.array([1, 2])), r"got action array\(\[1, 2\]\)"),
        (Decision(1, q_values=(1.0, 2.0)), r"expected q_values that are 4 numbers, or None, got q_values \(1.0, 2.0\)"),
        (Decision(1, q_values=("a", "b", "c", "d")), "expected q_values that are 4 numbers"),
        (Decision(1, q_values=(0.0, 0.0, 0.0, float("nan"))), "expected q_values that are 4 numbers"),
        (Decision(1, q_values=3.0), "expected q_values that are 4 numbers"),
        (Decision(1, epsilon="low"), "expected epsilon as a number, got epsilon 'low'"),
        (Decision(1, value="high"), "expected value as a number, or None, got value 'high'"),
        (Decision(1, value=float("nan")), "expected value as a number, or None, got value nan"),
    ],
)
def test_answers_that_are_no_decision(answer, message):
    with pytest.raises(PolicyError, match=f"^{NAME}: step 1, brigade 1: .*{message}"):
        step(answer)


NAMED = "with OWN_TARGET a target that is one of observation.burning, got target "


@pytest.mark.parametrize(
    ("target", "shown"),
    [(None, "None"), ("7", "'7'"), (2.0, "2.0"), (-1, "-1"), (999, "999"), (np.array([1, 2]), r"array\(\[1, 2\]\)")],
)
def test_own_targets_that_are_none(target, shown):
    with pytest.raises(PolicyError, match=f"^{NAME}: step 1, brigade 1: expected {NAMED}{shown}$"):
        step(Decision(Action.OWN_TARGET, target=target))


class Naming:
    """Names a building that burns in the brigade's site, or one that does not."""

    def __init__(self, choose):
        self.choose = choose

    def decide(self, observation):
        return Decision(Action.OWN_TARGET, target=self.choose(observation), value=np.float32(0.5))


@pytest.mark.parametrize("kind", [int, np.uint32, np.array])
def test_own_targets_are_whole_numbers_of_any_kind(kind):
    world = town_world(seed=1)
    decisions = world.step(Naming(lambda observation: kind(observation.burning[-1]))).decisions
    assert [decision.action for decision in decisions] == [Action.OWN_TARGET] * 3
    assert [decision.target for decision in decisions] == world.state.brigades.target.tolist()
    assert all(type(decision.target) is int for decision in decisions)
    assert [decision.value for decision in decisions] == [0.5] * 3


def test_an_own_target_burns_in_the_brigades_own_site():
    """A building that does not burn is refused, and so is one that burns elsewhere."""

    def elsewhere(observation):
        burning = np.flatnonzero(observation.world.sites.place >= 0)
        return int(np.setdiff1d(burning, observation.burning)[0])

    def cold(observation):
        return int(np.flatnonzero(observation.world.sites.place < 0)[0])

    for choose in (elsewhere, cold):
        world = two_sites()
        with pytest.raises(PolicyError, match=rf"Naming: step 1, brigade 0: expected {NAMED}\d+$") as caught:
            world.step(Naming(choose))
        assert "\n" not in str(caught.value)


def two_sites():
    world = make_world(make_city(square(0, 0), square(500, 0), square(1000, 0)), ignited=[0, 1], brigades=[2])
    assert not world.state.sites.counts[0], "nobody has looked yet"
    return world


def test_a_target_without_its_action_is_none():
    assert step(Decision(2, target=17)) == Decision(2)


def fail():
    raise ValueError("no\nsuch  state")


def fail_in_a_library():
    return Decision(int(np.argmax([])))


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (fail, r"ValueError: no such state \(test_asking.py, line \d+\)"),
        (fail_in_a_library, r"ValueError: attempt to get argmax of an empty sequence \(test_asking.py, line \d+\)"),
        (lambda: 1 / 0, "ZeroDivisionError: division by zero"),
        (Decision, "TypeError: .*missing 1 required positional argument: 'action'"),
        (lambda: {}["key"], "KeyError: 'key'"),
    ],
)
def test_a_policy_that_fails(answer, message):
    with pytest.raises(PolicyError, match=f"^{NAME}: step 1, brigade 1: {message}") as caught:
        step(answer)
    assert "\n" not in str(caught.value)


def test_long_messages_are_cut():
    def fail_at_length():
        raise ValueError("x" * 10_000)

    with pytest.raises(PolicyError) as caught:
        step(fail_at_length)
    assert len(str(caught.value)) < 400


@pytest.mark.parametrize("error", [LogError("damaged"), KeyboardInterrupt()])
def test_what_is_not_the_policys_fault_passes(error):
    def fail_otherwise():
        raise error

    with pytest.raises(type(error)) as caught:
        step(fail_otherwise)
    assert caught.value is error


def test_no_step_is_done_by_a_policy_that_fails():
    world = town_world(seed=1)
    energy = world.state.fire.energy.copy()
    with pytest.raises(PolicyError):
        world.step(Scripted(fail))
    assert (world.state.fire.energy == energy).all()


class Beginner(Scripted):
    def __init__(self, outcome=None):
        self.outcome, self.told = outcome, None

    def begin(self, city, n_brigades, seed):
        if self.outcome is not None:
            raise self.outcome
        self.told = (len(city.buildings.capacity), n_brigades, seed)


def test_begin_is_told_of_the_run():
    world, policy = town_world(seed=5), Beginner()
    begin(policy, world.city_arrays, n_brigades=3, seed=5)
    assert policy.told == (30, 3, 5)
    begin(Scripted(None), world.city_arrays, n_brigades=3, seed=5)  # has none, needs none


def test_a_begin_that_fails():
    with pytest.raises(PolicyError, match=r"^policy .*:Beginner: begin: RuntimeError: no model \(test_asking.py"):
        begin(Beginner(RuntimeError("no model")), town_world(seed=1).city_arrays, n_brigades=3, seed=1)
    with pytest.raises(LogError):
        begin(Beginner(LogError("damaged")), town_world(seed=1).city_arrays, n_brigades=3, seed=1)


def test_a_policy_is_named_as_on_the_command_line():
    assert name_of(Beginner()) == "tests.policy.test_asking:Beginner"
