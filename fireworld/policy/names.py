"""Find a policy by the name a user gives: a built-in one, or MODULE:CLASS of the user's own."""

from __future__ import annotations

import hashlib
import importlib
import inspect
import sys
from collections.abc import Callable
from dataclasses import dataclass
from difflib import get_close_matches
from functools import partial
from pathlib import Path
from typing import Final

from fireworld.errors import PolicyError, expected
from fireworld.policy.asking import describe
from fireworld.policy.chief import chief
from fireworld.policy.kernel import KernelPolicy, always, at_random, each_another
from fireworld.policy.protocol import Policy
from fireworld.records import ACTIONS

BUILT_IN: Final[dict[str, Callable[[], KernelPolicy]]] = {
    **{name: partial(always, action) for action, name in enumerate(ACTIONS)},
    "each-another": each_another,
    "random": at_random,
    "chief": chief,
}
"""Policies by name."""


@dataclass(frozen=True)
class NamedPolicy:
    """A policy, the name it was asked for by, and a digest of what it does."""

    name: str
    digest: str
    policy: Policy


def load_policy(name: str) -> NamedPolicy:
    """Return a policy by name.

    Args:
        name: a built-in policy, or `module:Class` found from the current folder or the Python path.

    Raises:
        PolicyError: no such policy, or it has no `decide` method, or making it fails.
    """
    if ":" in name:
        return _load_own(name)
    if name not in BUILT_IN:
        meant = name.lower()
        near = [known for known in BUILT_IN if meant and meant in known] or get_close_matches(meant, BUILT_IN, n=1)
        hint = "try " + " or ".join(near) if near else "MODULE:CLASS names one of your own"
        raise PolicyError(expected("--policy", "", "one of " + ", ".join(BUILT_IN), name, hint))
    policy = BUILT_IN[name]()
    return NamedPolicy(name, policy.digest, policy)


def _load_own(name: str) -> NamedPolicy:
    module_name, _, class_name = name.partition(":")
    folder = str(Path.cwd())
    if folder not in sys.path:
        sys.path.insert(0, folder)
    try:
        module = importlib.import_module(module_name)
    except (Exception, SystemExit) as error:
        raise PolicyError(f"--policy: {module_name}: cannot be imported: {describe(error)}") from error
    made = getattr(module, class_name, None)
    if made is None:
        raise PolicyError(expected("--policy", module_name, "a class of that name", class_name))
    try:
        policy = made() if inspect.isclass(made) or inspect.isfunction(made) else made
    except (Exception, SystemExit) as error:
        raise PolicyError(f"--policy: {name}: cannot be made: {describe(error)}") from error
    if not isinstance(policy, Policy):
        wanted = "a policy with a method decide(observation)"
        raise PolicyError(expected("--policy", name, wanted, type(policy).__name__))
    source = Path(inspect.getfile(module)).read_bytes()
    return NamedPolicy(name, hashlib.sha256(source).hexdigest(), policy)
