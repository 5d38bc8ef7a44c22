"""Why two runs or trainings can differ: what they were made of that is not the same."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from fireworld.shown import at_most
from fireworld.version import simulator_version

if TYPE_CHECKING:
    from fireworld.scenario import Scenario

DIGEST_SHOWN: Final = 12
"""Digits of a digest that identify it."""
LINES_MAX: Final = 8
"""Changed keys that are listed; of more their number is said."""
NOT_SET: Final = "not set"
SIMULATOR: Final = "simulator"
NAMES: Final = frozenset({"name", "description", "preset"})
"""Keys of a scenario that can change no run."""


@dataclass(frozen=True)
class Cause:
    """What A and B, two runs or trainings, were made of: scenario, policy, seed, simulator.

    Attributes:
        changes: by what is not the same, as in "scenario", a line for each change, as in "civilians.n: 7, was 8".
        same: what is the same.
        unknown: what one of them does not say.
    """

    changes: Mapping[str, Sequence[str]]
    same: Sequence[str]
    unknown: Sequence[str] = ()

    @property
    def lines(self) -> list[str]:
        """What changed, in words: a sentence, and below it every change, unless the sentence has it."""
        lines = [line for what in self.changes.values() for line in what]
        rest = _is(self.same, "same") + _is(self.unknown, "not known")
        if not lines:
            return [f"changed: nothing that is recorded{rest}; perhaps libraries, the machine, or draws of its own"]
        head = f"changed: {_and([*self.changes])}"
        if len(lines) == 1:
            return [f"{head}: {lines[0]}{rest}"]
        lines = [f"{what}: {line}" for what, several in self.changes.items() for line in several]
        shown = lines if len(lines) <= LINES_MAX else at_most(lines, LINES_MAX - 1)
        return [head + rest, *(f"  {line}" for line in shown)]

    @property
    def short(self) -> str:
        """What changed, in a few words: "scenario and policy changed"."""
        return f"{_and([*self.changes])} changed" if self.changes else "nothing recorded changed"

    def to_dict(self) -> dict[str, Any]:
        """Return plain values."""
        changes = {what: list(lines) for what, lines in self.changes.items()}
        return {"changes": changes, "same": list(self.same), "unknown": list(self.unknown)}


def cause_of(changes: Mapping[str, Sequence[str] | None]) -> Cause:
    """Make a cause of all that a run or training is made of; None: one of the two does not say what that is."""
    return Cause(
        {what: lines for what, lines in changes.items() if lines},
        [what for what, lines in changes.items() if lines is not None and not lines],
        [what for what, lines in changes.items() if lines is None],
    )


def with_digest(name: str, digest: str) -> str:
    """Return a name with the digits of a digest that identify what it names."""
    return f"{name} ({digest[:DIGEST_SHOWN]})"


def value_changes(a: Mapping[str, Any], b: Mapping[str, Any], *, prefix: str = "") -> list[str]:
    """Compare nested values key by key: "civilians.n: 7, was 8" where B has 7 and A has 8."""
    one, other = dict(_flat(a, prefix)), dict(_flat(b, prefix))
    keys = [key for key in dict.fromkeys([*one, *other]) if one.get(key, NOT_SET) != other.get(key, NOT_SET)]
    return [f"{key}: {other.get(key, NOT_SET)}, was {one.get(key, NOT_SET)}" for key in keys]


def scenario_changes(a: Scenario, b: Scenario, *, prefix: str = "") -> list[str]:
    """Compare scenarios key by key, with nothing left to presets and defaults; leave out names and descriptions."""
    one, other = ({key: value for key, value in of.resolved.items() if key not in NAMES} for of in (a, b))
    return value_changes(one, other, prefix=prefix)


def simulator_changes(a: tuple[str, str], b: tuple[str, str], *, known: bool = True) -> list[str] | None:
    """Compare simulators, each a version and a digest of its sources; "" where nobody wrote that down."""
    if not known or (a[0] == b[0] and not (a[1] and b[1])):
        return None
    return [] if a == b else [f"{simulator_version(*b)}, was {simulator_version(*a)}"]


def _flat(value: Any, key: str) -> Iterator[tuple[str, str]]:
    """Yield dotted keys and what they are; of a list of tables, each by its place."""
    if isinstance(value, Mapping):
        for name, below in value.items():
            yield from _flat(below, f"{key}.{name}" if key else str(name))
    elif isinstance(value, list | tuple) and any(isinstance(one, Mapping) for one in value):
        for place, below in enumerate(value):
            yield from _flat(below, f"{key}[{place}]")
    else:
        yield key, _text(value)


def _text(value: Any) -> str:
    if value is None:
        return NOT_SET
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_text, value)) + "]"
    return str(value).lower() if isinstance(value, bool) else str(value)


def _is(names: Sequence[str], what: str) -> str:
    return (
        f"; {_and(names)} {'is' if len(names) == 1 else 'are'} {'the ' if what == 'same' else ''}{what}"
        if names
        else ""
    )


def _and(names: Sequence[str]) -> str:
    return " and ".join([*filter(None, [", ".join(names[:-1])]), names[-1]])
