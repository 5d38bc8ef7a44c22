"""Ask a policy, and turn what goes wrong in it into one line that names the policy, the step and the brigade."""

from __future__ import annotations

import math
import operator
import sysconfig
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from fireworld.errors import FireworldError, PolicyError, expected
from fireworld.kernels.arrays import CityArrays
from fireworld.policy.protocol import Action, Decision, Observation, Policy
from fireworld.records import ACTIONS

LIBRARIES: Final = (
    str(Path(__file__).parents[1]),
    *(sysconfig.get_path(name) for name in ("stdlib", "purelib", "platlib")),
    "<",  # code without a file
)
"""Where code that is not the user's own comes from."""
DETAIL_SHOWN_MAX: Final = 200


def begin(policy: Policy, city: CityArrays, *, n_brigades: int, seed: int) -> None:
    """Tell a policy that a run begins, if it wants to know.

    Raises:
        PolicyError: the policy's own `begin` fails.
    """
    if not hasattr(policy, "begin"):
        return
    try:
        policy.begin(city, n_brigades, seed)
    except FireworldError:
        raise
    except Exception as error:
        raise PolicyError(f"policy {name_of(policy)}: begin: {describe(error)}") from error


def ask(policy: Policy, observation: Observation) -> Decision:
    """Return a policy's decision, checked and in plain Python values.

    Raises:
        PolicyError: the policy fails, or answers with something else than a decision.
    """
    try:
        answer = policy.decide(observation)
    except FireworldError:
        raise
    except Exception as error:
        raise PolicyError(f"policy {name_of(policy)}: {_moment(observation)}: {describe(error)}") from error
    return _checked(answer, policy, observation)


def name_of(policy: object) -> str:
    """Name a policy as a user would on the command line: module:Class."""
    kind = type(policy)
    return f"{kind.__module__}:{kind.__qualname__}"


def describe(error: BaseException) -> str:
    """Say in one line what went wrong in a user's code, and where: "ValueError: no such state (mine.py, line 7)"."""
    text = " ".join(str(error).split())
    shown = text if len(text) <= DETAIL_SHOWN_MAX else text[: DETAIL_SHOWN_MAX - 3] + "..."
    own = [frame for frame in traceback.extract_tb(error.__traceback__) if not frame.filename.startswith(LIBRARIES)]
    place = f" ({Path(own[-1].filename).name}, line {own[-1].lineno})" if own else ""
    return f"{type(error).__name__}{': ' if shown else ''}{shown}{place}"


def _moment(observation: Observation) -> str:
    return f"step {observation.step}, brigade {observation.brigade}"


def _checked(answer: object, policy: Policy, observation: Observation) -> Decision:
    """Return a decision with nothing but plain values in it."""
    wanted = f"a Decision with an action from 0 to {len(Action) - 1}"
    if not isinstance(answer, Decision):
        raise _refusal(policy, observation, wanted, answer)
    try:
        action = operator.index(answer.action)
    except TypeError:
        raise _refusal(policy, observation, wanted, f"action {answer.action!r}") from None
    if not 0 <= action < len(Action):
        raise _refusal(policy, observation, wanted, f"action {action}")
    target = _own_target(answer, policy, observation) if action == Action.OWN_TARGET else None
    try:
        values = _plain_values(answer.q_values)
    except (TypeError, ValueError):
        wanted = f"q_values that are {len(ACTIONS)} numbers, or None"
        raise _refusal(policy, observation, wanted, f"q_values {answer.q_values!r}") from None
    try:
        epsilon = _number(answer.epsilon)
    except (TypeError, ValueError):
        raise _refusal(policy, observation, "epsilon as a number", f"epsilon {answer.epsilon!r}") from None
    try:
        value = None if answer.value is None else _number(answer.value)
    except (TypeError, ValueError):
        raise _refusal(policy, observation, "value as a number, or None", f"value {answer.value!r}") from None
    explored = bool(answer.explored)
    return Decision(action, target=target, q_values=values, value=value, explored=explored, epsilon=epsilon)


def _own_target(answer: Decision, policy: Policy, observation: Observation) -> int:
    """Return the target of a brigade that names it itself."""
    wanted = "with OWN_TARGET a target that is one of observation.burning"
    try:
        target = operator.index(answer.target)  # type: ignore[arg-type]  # whatever a user's policy answers
    except TypeError:
        raise _refusal(policy, observation, wanted, f"target {answer.target!r}") from None
    if target not in observation.burning:
        raise _refusal(policy, observation, wanted, f"target {target}")
    return target


def _plain_values(values: Sequence[float] | None) -> tuple[float, ...] | None:
    if values is None:
        return None
    plain = tuple(_number(value) for value in values)
    if len(plain) != len(ACTIONS):
        raise ValueError
    return plain


def _number(value: Any) -> float:
    """Return a number as a float; one that is not equal to itself could never be compared."""
    number = float(value)
    if math.isnan(number):
        raise ValueError
    return number


def _refusal(policy: Policy, observation: Observation, wanted: str, got: object) -> PolicyError:
    return PolicyError(expected(f"policy {name_of(policy)}", _moment(observation), wanted, got))
