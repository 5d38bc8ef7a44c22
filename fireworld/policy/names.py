"""Find a policy by what a user gives: a name, a file, a class, an object or a function."""

from __future__ import annotations

import inspect
import pickle
import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from functools import partial
from pathlib import Path
from pkgutil import resolve_name
from typing import Any, Final, NamedTuple

from fireworld.errors import PolicyError, expected
from fireworld.policy.asking import complete, name_of, own_digest
from fireworld.policy.chief import chief
from fireworld.policy.identity import NOTEBOOK, can_be_imported, covering, digest_of, digest_of_module
from fireworld.policy.importing import CODE_SUFFIX, find_in, import_source, make_policy
from fireworld.policy.kernel import KernelPolicy, allocating, always, at_random, each_another
from fireworld.policy.parameter_text import (
    Parameters,
    check_no_parameters,
    check_plain,
    check_signature,
    read_parameters,
    write_parameters,
)
from fireworld.policy.protocol import Policy
from fireworld.policy.teams import team_names, team_path
from fireworld.policy.teams.npz import SUFFIX, read_bytes
from fireworld.policy.teams.team import Team, load_team, parse_team
from fireworld.records import ACTIONS

BUILT_IN: Final[dict[str, Callable[[], KernelPolicy]]] = {
    **{name: partial(always, action) for action, name in enumerate(ACTIONS)},
    "each-another": each_another,
    "random": at_random,
    "chief": chief,
    "allocate": allocating,
}
"""Rules by name."""
RULES: Final = {
    "easiest": "goes for the burning building that is coolest",
    "nearest-to-civilian": "goes for the one nearest to a civilian",
    "nearest-to-center": "goes for the one nearest to the city's center",
    "nearest-to-me": "goes for the one nearest to the brigade",
    "each-another": "brigade b always takes action b modulo 4 of these",
    "random": "takes one of these actions at random, every step",
    "chief": "one protects civilians, the others the front",
    "allocate": "shares brigades out among the fire sites; each goes for the coolest that nobody has",
}
"""What each rule does."""
PLANNERS: Final = {"planner": "fireworld.planning.planner:Planner"}
"""Where the classes of planners are: they use the world, which this layer does not know."""
TEAM_ATTACHMENT: Final = "policy.npz"
"""What a recording calls the team file that its brigades followed."""
RECORDED: Final = "recorded"
"""Names the policy of brigades that decide as is recorded, whatever happens."""
_FILE: Final = re.compile(rf"(.+?(?:{re.escape(CODE_SUFFIX)}|{re.escape(SUFFIX)}))(?::(.*))?", re.DOTALL)
_OVER: Final = re.compile(rf"(?:{'|'.join(PLANNERS)}):(?:[^\"']*,)?over=(?=[^\"'])", re.DOTALL)
"""The beginning of a planner's name, up to the policy that it is over."""
FORMER_TEAMS: Final = {"best": ("best-2026",)}
"""Names under which teams are kept that had this name before."""


class KnownPolicy(NamedTuple):
    """A policy that comes with fireworld."""

    name: str
    kind: str
    """rule, team or planner."""
    doc: str


@dataclass(frozen=True)
class NamedPolicy:
    """A policy, the name it was asked for by, and a digest of what it does."""

    name: str
    digest: str
    """"" if what it does is not known: of an object with values that are not plain, of a function without source."""
    policy: Policy = field(repr=False)
    attachments: Mapping[str, bytes] = field(default_factory=dict, repr=False)
    """Files that go with a recording of it, by name."""
    trained_choices: str = field(default="", repr=False)
    """Of a team: the scenario's `choices` that it was trained with, where its file has them."""
    part: str = field(default="", repr=False)
    """The class, function or object within its source; "": the class of the policy."""
    parameters: Mapping[str, Any] = field(default_factory=dict, repr=False)
    """What it was made with."""
    given: object = field(default=None, repr=False)
    """What `find_policy` was given to find it."""
    thing: object = field(default=None, repr=False)
    """The class, function or object of a user's own that its name led to; None of other policies."""

    def __post_init__(self) -> None:
        """Complete what has not all of a policy's methods."""
        object.__setattr__(self, "policy", complete(self.policy))

    @property
    def identity(self) -> str:
        """What distinguishes the policy from every other one, parts of one file too; "" if nothing is known to."""
        own = own_digest(self.policy)
        if own and not self.parameters:
            return own
        part = self.part or name_of(self.policy).partition(":")[2]
        return ":".join(filter(None, (self.digest, part, own))) if self.digest else ""

    @property
    def can_be_found_again(self) -> bool:
        """Whether other processes find the same policy: by its name, or by importing its class and unpickling it."""
        if isinstance(self.given, str):
            return True
        found = self.policy if self.given is None else self.given
        with suppress(Exception):
            return can_be_imported(found) and bool(pickle.dumps(found))
        return False

    def require_identity(self, purpose: str) -> str:
        """Return the identity; raise PolicyError, whose message begins with the purpose, if there is none."""
        if not self.identity:
            wanted = "a policy whose source is in a file and whose values are plain, or with an attribute `digest`"
            raise PolicyError(expected(purpose, "", wanted, self.name))
        return self.identity

    def require_found_again(self, purpose: str) -> None:
        """Raise PolicyError if other processes cannot find the policy; `purpose` as for `require_identity`."""
        if not self.can_be_found_again:
            raise PolicyError(expected(purpose, "", "a policy that other processes can import or unpickle", self.name))

    def __getstate__(self) -> dict[str, Any]:
        """Return what another process finds the policy by."""
        return vars(self) if self.given is None else {"given": self.given, "parameters": self.parameters}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Find the policy again."""
        if "name" not in state:
            given, written = state["given"], isinstance(state["given"], str)  # a name says its parameters
            state = vars(find_policy(given, parameters=None if written else state["parameters"]))
        vars(self).update(state)


def find_policy(given: object, *, parameters: Parameters | None = None) -> NamedPolicy:
    """Return a policy by what a user gives: a name, as docs/policies.md has them, a class, an object or a function.

    The parameters, plain values, are keywords of the class or function; more of them, if the name has some. Raises
    PolicyError if there is no such policy, or making it fails, TrainingError for a team file that makes no sense.
    """
    if isinstance(given, NamedPolicy | Team):
        named = given if isinstance(given, NamedPolicy) else _named_team(given)
        check_no_parameters(parameters or {}, where=f"policy: {named.name}")
        return named
    if isinstance(given, str | Path):
        return _by_name(str(given), parameters or {})
    is_named = inspect.isclass(given) or inspect.isroutine(given)
    where = f"policy: {name_of(given)}" if is_named else "policy"
    values = check_plain(parameters or {}, where=where)
    policy = make_policy(given, values, where=where, as_function=True)
    name, source = name_of(given), own_digest(policy)
    return NamedPolicy(
        _with_parameters(name, values),
        covering(source or digest_of(given), values),
        policy,
        part=name.partition(":")[2],
        parameters=values,
        given=given,
    )


def policies() -> list[KnownPolicy]:
    """List the policies that come with fireworld."""
    known = [KnownPolicy(name, "rule", doc) for name, doc in RULES.items()]
    known += [KnownPolicy(name, "planner", "tries out actions in copies of the world") for name in PLANNERS]
    for name in team_names():
        origin = load_team(name).provenance
        method, curriculum = (dict(origin.get(key, {})) for key in ("method", "curriculum"))
        learned = method.get("name") or method.get("rule")
        known.append(KnownPolicy(name, "team", f"learned by {learned} on the curriculum {curriculum.get('name')}"))
    return known


def with_file(name: str, changed: Callable[[str], str]) -> str:
    """Return the name of a policy with another path of its file, if it names one."""
    over = _OVER.match(name)
    before = over[0] if over else ""
    rest, more = (name[len(before) :], "") if not over else _until_comma(name[len(before) :])
    file = _FILE.fullmatch(rest)
    return name if file is None else before + changed(file[1]) + rest[len(file[1]) :] + more


def former_names(name: str) -> list[str]:
    """Return the names of what a policy may have been when it was recorded: planners over a team that had this name."""
    over = _OVER.match(name)
    if over is None:
        return []
    team, more = _until_comma(name[len(over[0]) :])
    return [over[0] + former + more for former in FORMER_TEAMS.get(team, ())]


def _until_comma(text: str) -> tuple[str, str]:
    end = text.find(",")
    return (text, "") if end < 0 else (text[:end], text[end:])


def note_on_team(named: NamedPolicy, n_brigades: int, *, choices: str = "") -> str:
    """Return how a team is used differently from its training, a line each; nothing about other policies.

    The scenario's `choices` are compared unless they are left out.
    """
    if TEAM_ATTACHMENT not in named.attachments or not isinstance(named.policy, KernelPolicy):
        return ""
    n_tables, trained, notes = len(named.policy.kinds), named.trained_choices, []
    tables = f"{named.name}: {n_tables} tables for {n_brigades} brigades"
    if n_tables > max(n_brigades, 1):
        notes.append(f"{tables}: the last {n_tables - n_brigades} are not used")
    elif 1 < n_tables < n_brigades:
        notes.append(f"{tables}: brigade b follows table b modulo {n_tables}")
    if trained and choices and trained != choices:
        hint = f"--set choices={trained} runs it as trained"
        notes.append(f"{named.name}: trained with choices {trained}, run with choices {choices}; {hint}")
    return "\n".join(notes)


def _by_name(text: str, more: Parameters) -> NamedPolicy:
    """Find a policy by its name, with its parameters and more of them."""
    source, target, written = _split(text)
    where = f"--policy: {source}" + (f":{target}" if target else "")
    values = read_parameters(written, where=where)
    for name in more.keys() & values:
        raise PolicyError(expected(where, "", "every parameter once", f"{name} twice"))
    values |= check_plain(more, where=where)
    name = _with_parameters(text, more)
    if source.endswith(SUFFIX) or (source in team_names() and target is None):
        check_no_parameters(values, where=where)
        return _team_by_name(source)
    if target is None and source in BUILT_IN | PLANNERS:
        make: Callable[..., Policy] = BUILT_IN.get(source) or resolve_name(PLANNERS[source])
        check_signature(make, values, where=where)
        policy = make(**values)
        return NamedPolicy(name, policy.digest, policy, given=name)
    if ":" not in text and "." not in text:
        if not Path(f"{text}{CODE_SUFFIX}").is_file():
            raise _unknown(text)
        source = f"{text}{CODE_SUFFIX}"
    module = import_source(source)
    thing = find_in(module, target or "", where=f"--policy: {source}")
    policy = make_policy(thing, values, where=where)
    digest = covering(digest_of(thing) if module.__name__ == NOTEBOOK else digest_of_module(module), values)
    part = target or thing.__qualname__
    return NamedPolicy(name, digest, policy, part=part, parameters=values, given=name, thing=thing)


def _split(text: str) -> tuple[str, str | None, str]:
    """Split SOURCE:TARGET:PARAMETERS; what holds a "=" is parameters, so a target can be left out."""
    first = text.partition(":")[0]
    file = None if first in BUILT_IN | PLANNERS else _FILE.fullmatch(text)
    source = file[1] if file else first
    if source == text:
        return source, None, ""
    rest = text[len(source) + 1 :]
    target, _, written = rest.partition(":")
    return (source, None, rest) if "=" in target else (source, target, written)


def _with_parameters(name: str, parameters: Parameters) -> str:
    """Return the name by which a policy with these parameters is found again."""
    if not parameters:
        return name
    separator = "," if "=" in _split(name)[2] else ":"
    return f"{name}{separator}{write_parameters(parameters)}"


def _team_by_name(source: str) -> NamedPolicy:
    """Return the policy of a team; a recording names a file without its folder and takes it along."""
    path, name = (Path(source), Path(source).name) if source.endswith(SUFFIX) else (team_path(source), source)
    content = read_bytes(path)
    return replace(_named_team(parse_team(content, source=str(path)), content), name=name, given=source)


def _named_team(team: Team, content: bytes = b"") -> NamedPolicy:
    """Return the policy of a team, with its file."""
    policy, attachments = team.policy(), {TEAM_ATTACHMENT: content or team.to_bytes()}
    return NamedPolicy("team", policy.digest, policy, attachments, team.choices, given=team)


def _unknown(name: str) -> PolicyError:
    """Return the error for a name that no policy has."""
    names, meant = [*BUILT_IN, *PLANNERS, *team_names()], name.lower()
    near = [known for known in names if meant and meant in known] or get_close_matches(meant, names, n=1)
    hint = "try " + " or ".join(near) if near else "FILE.py:CLASS or MODULE:CLASS names one of your own"
    return PolicyError(expected("--policy", "", "one of " + ", ".join(names), name, hint))
