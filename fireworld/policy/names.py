"""Find a policy by the name a user gives: a built-in one, a team, or MODULE:CLASS of the user's own."""

from __future__ import annotations

import hashlib
import importlib
import inspect
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import partial
from pathlib import Path
from typing import Final

from fireworld.errors import PolicyError, expected
from fireworld.policy.asking import describe
from fireworld.policy.chief import chief
from fireworld.policy.kernel import KernelPolicy, always, at_random, each_another
from fireworld.policy.protocol import Policy
from fireworld.policy.teams.npz import SUFFIX, read_bytes
from fireworld.policy.teams.shipped import team_names, team_path
from fireworld.policy.teams.team import parse_team
from fireworld.records import ACTIONS

BUILT_IN: Final[dict[str, Callable[[], KernelPolicy]]] = {
    **{name: partial(always, action) for action, name in enumerate(ACTIONS)},
    "each-another": each_another,
    "random": at_random,
    "chief": chief,
}
"""Policies by name."""

WITH_OPTIONS: Final = {"planner": "fireworld.planning.planner:planner"}
"""Policies that take options, `NAME` or `NAME:KEY=VALUE,...`: what makes each from the options' text. They use the
world, which this layer does not know, so they are found as a user's own policy is."""
TEAM_ATTACHMENT: Final = "policy.npz"
"""What a recording calls the team file that its brigades followed."""


@dataclass(frozen=True)
class NamedPolicy:
    """A policy, the name it was asked for by, and a digest of what it does."""

    name: str
    digest: str
    policy: Policy
    attachments: Mapping[str, bytes] = field(default_factory=dict)
    """Files that go with a recording of it, by name."""
    trained_choices: str = ""
    """Of a team: the scenario's `choices` that it was trained with, where its file tells."""


def load_policy(name: str) -> NamedPolicy:
    """Return a policy by name.

    Args:
        name: a built-in policy, with its options where it takes any; a team that comes with fireworld, or a team file;
            or `module:Class` found from the current folder or the Python path.

    Raises:
        PolicyError: no such policy, or it has no `decide` method, or making it fails.
        TrainingError: a team file that cannot be read or makes no sense.
    """
    if name.endswith(SUFFIX):
        return _load_team(Path(name), name=Path(name).name)
    kind, _, options = name.partition(":")
    if kind in WITH_OPTIONS and (name == kind or "=" in options):
        module_name, _, maker = WITH_OPTIONS[kind].partition(":")
        made = getattr(importlib.import_module(module_name), maker)(options)
        return NamedPolicy(name, made.digest, made)
    if ":" in name:
        return _load_own(name)
    if name in team_names():
        return _load_team(team_path(name), name=name)
    if name not in BUILT_IN:
        meant = name.lower()
        names = [*BUILT_IN, *WITH_OPTIONS, *team_names()]
        near = [known for known in names if meant and meant in known] or get_close_matches(meant, names, n=1)
        hint = "try " + " or ".join(near) if near else "MODULE:CLASS names one of your own"
        raise PolicyError(expected("--policy", "", "one of " + ", ".join(names), name, hint))
    policy = BUILT_IN[name]()
    return NamedPolicy(name, policy.digest, policy)


def note_on_team(named: NamedPolicy, n_brigades: int, *, choices: str = "") -> str:
    """Say how a team will be used otherwise than it was trained, a line each; nothing of other policies.

    Args:
        named: the policy.
        n_brigades: brigades of the scenario.
        choices: of the scenario; left out, nothing is said of them.
    """
    if TEAM_ATTACHMENT not in named.attachments or not isinstance(named.policy, KernelPolicy):
        return ""
    notes = (_note_on_tables(len(named.policy.kinds), n_brigades), _note_on_choices(named.trained_choices, choices))
    return "\n".join(f"{named.name}: {note}" for note in notes if note)


def _note_on_tables(n_tables: int, n_brigades: int) -> str:
    """Say which brigade follows which table, if there is not one for each."""
    if n_tables in {1, n_brigades}:
        return ""
    if n_tables > n_brigades:
        return f"{n_tables} tables for {n_brigades} brigades: the last {n_tables - n_brigades} are not used"
    return f"{n_tables} tables for {n_brigades} brigades: brigade b follows table b modulo {n_tables}"


def _note_on_choices(trained: str, choices: str) -> str:
    """Say so if the brigades learned to choose in another order than the scenario has it."""
    if not (trained and choices) or trained == choices:
        return ""
    return f"trained with choices {trained}, run with choices {choices}; --set choices={trained} runs it as trained"


def _load_team(path: Path, *, name: str) -> NamedPolicy:
    """Return the policy of a team file; a recording names it without its folder and takes the file along."""
    content = read_bytes(path)
    team = parse_team(content, source=str(path))
    policy = team.policy()
    return NamedPolicy(name, policy.digest, policy, {TEAM_ATTACHMENT: content}, team.choices)


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
