"""Ask a policy, whatever a user brought as one; what goes wrong in it becomes one line that says where."""

from __future__ import annotations

import inspect
import math
import operator
import sysconfig
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any, Final, TypeVar

from fireworld.errors import FireworldError, PolicyError, described, expected, nearest, shown
from fireworld.kernels.arrays import CityArrays
from fireworld.policy.protocol import Action, Decision, Observation, Policy
from fireworld.records import ACTION_NAMES, ACTIONS

LIBRARIES: Final = (
    str(Path(__file__).parents[1]),
    *(sysconfig.get_path(name) for name in ("stdlib", "purelib", "platlib")),
    "<",  # code without a file
)
"""Where code that is not the user's own comes from."""
AN_ANSWER: Final = f"a Decision or an action ({', '.join(ACTION_NAMES)}, or 0 to {len(ACTION_NAMES) - 1})"

PASSING: Final = (FireworldError, KeyboardInterrupt)
"""What is raised in a policy and is no fault of it."""

Value = TypeVar("Value")


class Adapted(Policy):
    """A policy made of what a user brought; what that lacks of a policy's methods is the default."""

    def __init__(self, given: Any) -> None:
        self.given = given
        self._choose = given.decide if isinstance(given, Policy) else given
        for name in ("begin", "keeps", "stateless", "digest"):
            own = getattr(given, name, None)
            if own is not None:
                setattr(self, name, own)

    def decide(self, observation: Observation) -> Decision | str | int:
        """Return what the user's own answers, which may be anything."""
        answer: Decision | str | int = self._choose(observation)
        return answer


def complete(given: Any, *, where: str = "policy") -> Policy:
    """Return the policy given, or one that calls it and has all of a policy's methods; errors begin with `where`."""
    if Policy in type(given).__mro__:
        policy: Policy = given
        return policy
    if inspect.isclass(given) or not (isinstance(given, Policy) or callable(given)):
        wanted = "a policy with a method decide(observation) or a function of the observation"
        raise PolicyError(expected(where, "", wanted, given if inspect.isclass(given) else type(given).__name__))
    return Adapted(given)


def begin(policy: Policy, city: CityArrays, *, n_brigades: int, seed: int) -> None:
    """Let a policy prepare for a run; raise PolicyError if its own `begin` fails."""
    with users_code(policy, "begin"):
        complete(policy).begin(city, n_brigades, seed)


def ask(policy: Policy, observation: Observation) -> Decision:
    """Return a policy's decision, checked and in plain Python values; PolicyError if it fails or makes no sense."""
    try:
        return _checked(policy.decide(observation), policy, observation)
    except PASSING:
        raise
    except BaseException as error:
        raise _failure(policy, _moment(observation), error) from error


def keeps(policy: Policy, brigade: int, last_action: int, step: int) -> bool:
    """Return whether a policy lets a brigade repeat its last action, False if it has none; PolicyError if it fails."""
    try:
        return last_action >= 0 and bool(policy.keeps(brigade, last_action, step))
    except PASSING:
        raise
    except BaseException as error:
        raise _failure(policy, f"step {step}, brigade {brigade}: keeps", error) from error


@contextmanager
def users_code(what: object, moment: str) -> Iterator[None]:
    """Turn whatever a user's code raises into a PolicyError; only Ctrl-C and fireworld's own errors pass.

    Its message begins with `what`, a policy or words, and says next the `moment` in which the code runs.
    """
    try:
        yield
    except PASSING:
        raise
    except BaseException as error:
        raise _failure(what, moment, error) from error


def name_of(policy: object) -> str:
    """Return a policy's name as on the command line: module:Class, or module:function."""
    given = policy.given if isinstance(policy, Adapted) else policy
    while isinstance(given, partial):
        given = given.func
    named = given if inspect.isroutine(given) or inspect.isclass(given) else type(given)
    return f"{named.__module__}:{named.__qualname__}"


def describe(error: BaseException) -> str:
    """Return in one line what went wrong in a user's code, and where: "ValueError: no such state (mine.py, line 7)"."""
    own = [frame for frame in traceback.extract_tb(error.__traceback__) if not frame.filename.startswith(LIBRARIES)]
    return described(error) + (f" ({Path(own[-1].filename).name}, line {own[-1].lineno})" if own else "")


def _failure(what: object, moment: str, error: BaseException) -> PolicyError:
    place = what if isinstance(what, str) else f"policy {name_of(what)}"
    return PolicyError(f"{place}: {moment}: {describe(error)}")


def _moment(observation: Observation) -> str:
    return f"step {observation.step}, brigade {observation.brigade}"


def _checked(answer: Any, policy: Policy, observation: Observation) -> Decision:
    """Return a decision with nothing but plain values in it."""

    def refusal(wanted: str, got: object, hint: str = "") -> PolicyError:
        return PolicyError(expected(f"policy {name_of(policy)}", _moment(observation), wanted, got, hint))

    def plain(name: str, wanted: str, convert: Callable[[Any], Value]) -> Value:
        value = getattr(answer, name)
        try:
            return convert(value)
        except (ArithmeticError, TypeError, ValueError):
            raise refusal(wanted, f"{name} {shown(value)}") from None

    bare = not isinstance(answer, Decision)
    action = _action_index(answer if bare else answer.action)
    if action is None or (bare and isinstance(answer, bool)):
        hint = nearest(answer, ACTION_NAMES) if isinstance(answer, str) else ""
        raise refusal(AN_ANSWER, answer if bare else f"action {shown(answer.action)}", hint)
    answer = Decision(action) if bare else answer
    target = None
    if action == Action.OWN_TARGET:
        wanted = "with OWN_TARGET a target that is one of observation.burning"
        target = plain("target", wanted, operator.index)
        if target not in observation.burning:
            raise refusal(wanted, f"target {shown(target)}")
    return Decision(
        action,
        target=target,
        q_values=plain("q_values", f"q_values that are {len(ACTIONS)} numbers, or None", _action_values),
        epsilon=plain("epsilon", "epsilon as a number", _number),
        value=plain("value", "value as a number, or None", lambda value: None if value is None else _number(value)),
        explored=plain("explored", "explored as true or false", bool),
    )


def _action_index(action: Any) -> int | None:
    """Return the index of an action given by its name or index; None if there is no such action."""
    if isinstance(action, str):
        return ACTION_NAMES.index(action) if action in ACTION_NAMES else None
    try:
        index = operator.index(action)
    except TypeError:
        return None
    return index if 0 <= index < len(ACTION_NAMES) else None


def _action_values(values: Any) -> tuple[float, ...] | None:
    """Return the values of the four actions; of what yields more, no more than one too many is read."""
    if values is None:
        return None
    found = tuple(_number(value) for value in islice(values, len(ACTIONS) + 1))
    if len(found) != len(ACTIONS):
        raise ValueError
    return found


def _number(value: Any) -> float:
    """Return a number as a float; one that is not equal to itself could never be compared."""
    number = float(value)
    if math.isnan(number):
        raise ValueError
    return number
