"""Ask a policy, whatever a user brought as one; what goes wrong in it becomes one line that says where."""

from __future__ import annotations

import inspect
import math
import operator
import sys
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from itertools import islice
from pathlib import Path
from threading import Lock, local
from typing import Any, Final, TypeVar

import numpy as np

from fireworld.errors import FireworldError, PolicyError, described, expected, nearest, shown
from fireworld.kernels.arrays import CityArrays
from fireworld.policy.identity import LIBRARIES
from fireworld.policy.protocol import Action, Decision, Observation, Policy
from fireworld.records import ACTION_NAMES, ACTIONS

AN_ANSWER: Final = f"a Decision or an action ({', '.join(ACTION_NAMES)}, or 0 to {len(ACTION_NAMES) - 1})"

PASSING: Final = (FireworldError, KeyboardInterrupt)
"""What is raised in a policy and is no fault of it."""

Value = TypeVar("Value")


class PrintsAside:
    """Lets what users' code prints go to the error stream, for what fireworld prints is read by machines, too.

    Threads may be within at the same time; the last one to leave puts standard output back.
    """

    def __init__(self) -> None:
        self._lock, self._n_within = Lock(), 0
        self._before: Any = None

    def __enter__(self) -> None:
        with self._lock:
            if self._n_within == 0:
                self._before, sys.stdout = sys.stdout, sys.stderr
            self._n_within += 1

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._n_within -= 1
            if self._n_within == 0:
                sys.stdout = self._before


PRINTS_ASIDE: Final = PrintsAside()


def read_only(given: Any) -> Any:
    """Return named arrays, or tuples of such, as views that cannot be written."""
    if isinstance(given, np.ndarray):
        view = given.view()
        view.flags.writeable = False
        return view
    if isinstance(given, tuple) and hasattr(given, "_make"):
        return type(given)._make(map(read_only, given))
    return given


class _Views(local):
    """The read-only views that were made last, in this thread: those of one world serve a whole run."""

    of: tuple[Any, Any] = (None, None)
    views: tuple[Any, Any] = (None, None)


_VIEWS: Final = _Views()


def _shown(observation: Observation) -> Observation:
    """Return an observation as users' code sees it: it cannot change the world."""
    if not isinstance(observation, Observation):  # whoever asks by hand may show anything
        return observation
    seen = observation.city, observation.world
    if seen[0] is not _VIEWS.of[0] or seen[1] is not _VIEWS.of[1]:
        _VIEWS.of, _VIEWS.views = seen, (read_only(seen[0]), read_only(seen[1]))
    city, world = _VIEWS.views
    return replace(observation, city=city, world=world, known_targets=read_only(observation.known_targets))


def is_ours(policy: Policy) -> bool:
    """Return whether a policy is fireworld's own: it changes nothing, and kernels want arrays as they are."""
    return type(policy).__module__.startswith("fireworld.") and not isinstance(policy, Adapted)


class Adapted(Policy):
    """A policy made of what a user brought; what that lacks of a policy's methods is the default."""

    def __init__(self, given: Any) -> None:
        self.given = given
        with users_code(given, "its attributes"):
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
    asked = complete(policy)
    with users_code(policy, "begin"):
        asked.begin(city if is_ours(asked) else read_only(city), n_brigades, seed)


def ask(policy: Policy, observation: Observation) -> Decision:
    """Return a policy's decision, checked and in plain Python values; PolicyError if it fails or makes no sense."""
    if is_ours(policy):
        return _checked(policy.decide(observation), policy, observation)
    try:
        with PRINTS_ASIDE:
            answer = policy.decide(_shown(observation))
            return _checked(answer, policy, observation)
    except PASSING:
        raise
    except BaseException as error:
        raise _failure(policy, _moment(observation), error) from error


def plain_actions(answers: Sequence[Any]) -> list[int] | None:
    """Return the index of the paper's action in each answer; None if one of them is anything else."""
    found = [None if isinstance(answer, bool | Decision) else _action_index(answer) for answer in answers]
    named = [index for index in found if index is not None and index < len(ACTIONS)]
    return named if len(named) == len(found) else None


def keeps(policy: Policy, brigade: int, last_action: int, step: int) -> bool:
    """Return whether a policy lets a brigade repeat its last action, False if it has none; PolicyError if it fails."""
    if last_action < 0:
        return False
    try:
        with PRINTS_ASIDE:
            return bool(policy.keeps(brigade, last_action, step))
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
        with PRINTS_ASIDE:
            yield
    except PASSING:
        raise
    except BaseException as error:
        raise _failure(what, moment, error) from error


def changed_its_world(policy: object, seed: int) -> PolicyError:
    """Return the error of a policy whose decisions, in a world that it has never seen, lead elsewhere."""
    wanted = "decisions that lead to its outcome by themselves"
    return PolicyError(expected(f"policy {name_of(policy)}", f"seed {seed}", wanted, "a world that it has changed"))


def own_digest(policy: Policy) -> str:
    """Return the digest that a policy says it has, "" for none, or what is no text; PolicyError if it cannot say."""
    with users_code(policy, "digest"):
        digest = policy.digest
        return digest if isinstance(digest, str) else ""


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
    hint = "; the world it sees cannot be changed, only copies of it" if _is_refused_write(error) else ""
    return PolicyError(f"{place}: {moment}: {describe(error)}{hint}")


def _is_refused_write(error: BaseException) -> bool:
    """Return whether an error is numpy's, about writing into a view that is read-only."""
    return type(error) is ValueError and "read-only" in str(error.args[:1])


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

    if inspect.iscoroutine(answer):
        answer.close()
        raise refusal(AN_ANSWER, "a coroutine", "decide without async")
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
    if isinstance(action, np.bool_):  # older versions of numpy take it for an index
        return None
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
