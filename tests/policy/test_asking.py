"""Asking a policy: plain decisions come back, and every fault in it becomes one line that says where."""

from __future__ import annotations

import sys
from functools import partial
from itertools import repeat

import numpy as np
import pytest

from fireworld.errors import LogError, PolicyError
from fireworld.policy.asking import ask, begin, complete, keeps, name_of
from fireworld.policy.protocol import Action, Decision, Policy
from fireworld.records import ACTION_NAMES
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
        Decision("nearest-to-center"),
        2,
        np.int32(2),
        Action.NEAREST_TO_CENTER,
        "nearest-to-center",
    ],
)
def test_actions_are_names_and_whole_numbers_of_any_kind(answer):
    assert step(answer) == Decision(2)
    assert type(step(answer).action) is int


def test_values_may_be_an_array():
    decision = step(Decision(1, q_values=np.array([0.0, 3.0, -np.inf, 1.0]), explored=np.bool_(True), epsilon=1))
    assert decision == Decision(1, q_values=(0.0, 3.0, float("-inf"), 1.0), explored=True, epsilon=1.0)
    assert [type(value) for value in decision.q_values] == [float] * 4


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (None, rf"expected a Decision or an action \({', '.join(ACTION_NAMES)}, or 0 to 4\), got None"),
        (5, "expected a Decision or an action .*, got 5"),
        (-1, "got -1"),
        (2.0, "got 2.0"),
        (True, "got True"),
        (np.True_, "got np.True_"),
        ("nearest", "got 'nearest'"),
        ("nearest-to-mee", "got 'nearest-to-mee'; try nearest-to-me"),
        ("own-target", "expected with OWN_TARGET a target that is one of observation.burning, got target None"),
        (Decision(5), "got action 5"),
        (Decision(-1), "got action -1"),
        (Decision(1.0), "got action 1.0"),
        (Decision("easyest"), "got action 'easyest'"),
        (Decision(10**400), "got action 10+"),
        (Decision(10**5000), "got action something of type int"),
        (Decision(None), "got action None"),
        (Decision(np.array([1, 2])), r"got action array\(\[1, 2\]\)"),
        (Decision(1, q_values=(1.0, 2.0)), r"expected q_values that are 4 numbers, or None, got q_values \(1.0, 2.0\)"),
        (Decision(1, q_values=("a", "b", "c", "d")), "expected q_values that are 4 numbers"),
        (Decision(1, q_values=(0.0, 0.0, 0.0, float("nan"))), "expected q_values that are 4 numbers"),
        (Decision(1, q_values=3.0), "expected q_values that are 4 numbers"),
        (Decision(1, q_values=repeat(1.0)), "expected q_values that are 4 numbers, or None, got q_values repeat"),
        (Decision(1, q_values=(1.0, 2.0, 3.0, 10**400)), "expected q_values that are 4 numbers"),
        (Decision(1, epsilon=10**400), "expected epsilon as a number, got epsilon 10+"),
        (Decision(1, value=10**400), "expected value as a number, or None, got value 10+"),
        (Decision(1, explored=np.array([1, 2])), r"expected explored as true or false, got explored array\(\[1, 2\]\)"),
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


def leave():
    sys.exit(0)


class MuteError(Exception):
    def __str__(self):
        raise RuntimeError


class LeavingError(Exception):
    def __str__(self):
        leave()
        return "never"


def fail_without_text(kind):
    raise kind


class Unshown:
    def __repr__(self):
        raise RuntimeError


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
        (leave, r"SystemExit: 0 \(test_asking.py, line \d+\)$"),
        (partial(fail_without_text, MuteError), r"MuteError \(test_asking.py, line \d+\)$"),
        (partial(fail_without_text, LeavingError), r"LeavingError \(test_asking.py, line \d+\)$"),
        (partial(fail_without_text, GeneratorExit), r"GeneratorExit \(test_asking.py, line \d+\)$"),
        (Unshown, "expected a Decision or an action .*, got something of type Unshown$"),
        (partial(Decision, Unshown()), "expected a Decision .*, got action something of type Unshown$"),
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
        self.outcome, self.seen = outcome, None

    def begin(self, city, n_brigades, seed):
        if self.outcome is not None:
            raise self.outcome
        self.seen = (len(city.buildings.capacity), n_brigades, seed)


def test_begin_is_called_with_the_run():
    world, policy = town_world(seed=5), Beginner()
    begin(policy, world.city_arrays, n_brigades=3, seed=5)
    assert policy.seen == (30, 3, 5)
    begin(Scripted(None), world.city_arrays, n_brigades=3, seed=5)  # has none, needs none


def test_a_begin_that_fails():
    with pytest.raises(PolicyError, match=r"^policy .*:Beginner: begin: RuntimeError: no model \(test_asking.py"):
        begin(Beginner(RuntimeError("no model")), town_world(seed=1).city_arrays, n_brigades=3, seed=1)
    with pytest.raises(PolicyError, match=r"^policy .*:Beginner: begin: SystemExit: 0 \(test_asking.py"):
        begin(Beginner(SystemExit(0)), town_world(seed=1).city_arrays, n_brigades=3, seed=1)
    with pytest.raises(LogError):
        begin(Beginner(LogError("damaged")), town_world(seed=1).city_arrays, n_brigades=3, seed=1)


def test_a_policy_is_named_as_on_the_command_line():
    assert name_of(Beginner()) == "tests.policy.test_asking:Beginner"
    assert name_of(complete(Beginner())) == "tests.policy.test_asking:Beginner"
    assert name_of(complete(fail)) == "tests.policy.test_asking:fail"


class Steady:
    """Keeps whatever it can, and notes what it was asked about."""

    def __init__(self, answer=True):
        self.answer, self.asked = answer, []

    def decide(self, observation):
        return (observation.brigade + observation.step) % 4

    def keeps(self, brigade, last_action, step):
        self.asked.append((brigade, last_action, step))
        return self.answer() if callable(self.answer) else self.answer


def test_what_is_kept():
    world, policy = town_world(seed=1), Steady()
    first = world.step(policy).decisions
    assert [decision.action for decision in first] == [1, 2, 3], "in the first step there is nothing to keep"
    assert policy.asked == []
    assert [decision.action for decision in world.step(policy).decisions] == [1, 2, 3]
    assert policy.asked == [(0, 1, 2), (1, 2, 2), (2, 3, 2)]


def test_after_a_refill_there_is_nothing_to_keep():
    world, policy = town_world(seed=1), Steady()
    world.step(policy)
    world.state.brigades.refilling[0] = 1
    assert world.step(policy).decisions[0].action == -1
    world.state.brigades.refilling[0] = 0
    assert world.step(policy).decisions[0].action == 3
    assert (0, -1, 3) not in policy.asked


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (lambda: 1 / 0, "ZeroDivisionError: division by zero"),
        (leave, "SystemExit: 0"),
        (lambda: np.array([1, 2]), "ValueError: The truth value of an array"),
    ],
)
def test_a_keeps_that_fails(answer, message):
    world, policy = town_world(seed=1), Steady(answer)
    world.step(policy)
    with pytest.raises(PolicyError, match=rf"^policy .*:Steady: step 2, brigade 0: keeps: {message}") as caught:
        world.step(policy)
    assert "\n" not in str(caught.value)


class Bare:
    def decide(self, observation):
        return 0


class Heir(Policy):
    def decide(self, observation):
        return 0


def test_everything_that_decides_is_a_policy():
    """What inherits nothing too; what inherits from Policy has all methods, and stays what it is."""
    given = Bare()
    given.decide = fail
    assert all(isinstance(one, Policy) for one in (Bare(), given, Heir(), complete(Bare())))
    assert not any(isinstance(one, Policy) for one in (object(), fail, 3))
    assert isinstance(Heir(), Heir)
    assert not isinstance(Bare(), Heir)
    heir = Heir()
    assert complete(heir) is heir
    with pytest.raises(TypeError, match="abstract"):
        type("Idle", (Policy,), {})()


def first(observation):
    return 0


@pytest.mark.parametrize("given", [Heir(), Bare(), first, partial(first)])
def test_defaults_of_what_is_not_there(given):
    policy = complete(given)
    assert (policy.begin(None, 3, 1), policy.keeps(0, 1, 2), policy.stateless, policy.digest) == (
        None,
        False,
        False,
        "",
    )
    assert ask(policy, None) == Decision(0)
    assert keeps(policy, 0, 1, 2) is False


def test_what_is_there_is_used():
    policy = complete(Steady())
    assert policy.keeps(0, 1, 2) is True
    assert complete(type("Told", (Bare,), {"stateless": True, "digest": "of a model"})()).digest == "of a model"


@pytest.mark.parametrize("given", [3, None, "easiest", Bare, object()])
def test_what_is_no_policy(given):
    with pytest.raises(
        PolicyError, match=r"^policy: expected a policy with a method decide\(observation\) or .*, got "
    ):
        complete(given)
