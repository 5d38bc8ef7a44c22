"""Suites: named, fixed sets of scenarios that nobody trained or chose on, to measure policies in."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import msgspec

from fireworld.arguments import ArgumentError
from fireworld.errors import TrainingError, expected, nearest
from fireworld.files import read_input
from fireworld.scenario import Scenario
from fireworld.scenario.shipped import shipped_folder
from fireworld.scenario.yaml_text import read_yaml
from fireworld.training.curriculum import SIZE_MAX_BYTES, StageText, build_stage

NAMES: Final = (
    "tests", "paper-world", "contested", "larger", "scarce-water", "two-sites", "three-sites", "few-brigades",
    "many-brigades", "official-like",
)  # fmt: skip
"""All suites in the order in which they are shown."""


class GroupText(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Scenarios of a suite as written: by name, or variations of one."""

    scenarios: tuple[str, ...] = ()
    base: str | None = None
    set: dict[str, Any] = {}
    each: tuple[dict[str, Any], ...] = ()


class SuiteText(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A suite as written."""

    description: str
    groups: tuple[GroupText, ...]


@dataclass(frozen=True)
class Suite:
    """A named, fixed set of scenarios."""

    name: str
    description: str
    scenarios: tuple[Scenario, ...]
    sampled: bool
    """Its fires were drawn, and others might have been; else these very scenarios are meant."""

    @property
    def digest(self) -> str:
        """SHA-256 of everything that can change a run."""
        return digest_of([one.digest for one in self.scenarios])

    def __repr__(self) -> str:
        return f"<Suite {self.name}: {len(self.scenarios)} scenarios>"


def digest_of(digests: Sequence[str]) -> str:
    """Return the digest of scenarios, by theirs."""
    return hashlib.sha256(json.dumps(digests).encode()).hexdigest()


def suite_names() -> list[str]:
    """Name the suites, in the order in which they are shown."""
    return [*NAMES]


def suites() -> list[Suite]:
    """Return all suites."""
    return [suite(name) for name in suite_names()]


def suite(name: str) -> Suite:
    """Return a suite by its name.

    Raises:
        ArgumentError: there is no such suite.
    """
    if name not in suite_names():
        hint = nearest(str(name), suite_names(), otherwise="try `fireworld scenarios`")
        raise ArgumentError(expected("suite", "", "one of " + ", ".join(suite_names()), name, hint))
    return _load(name)


@lru_cache(maxsize=len(NAMES))
def _load(name: str) -> Suite:
    path = _folder() / f"{name}.yaml"
    text = read_input(path, what="a suite", n_bytes_max=SIZE_MAX_BYTES, error=TrainingError)
    read = msgspec.convert(read_yaml(text, source=name), SuiteText)
    found = list[Scenario]()
    for number, group in enumerate(read.groups):
        stage = StageText(name=name, cooperation=True, **msgspec.structs.asdict(group))
        built = build_stage(stage, where=f"{name}: groups.{number}", folder=path.parent).scenarios
        numbered = (f"{name}-{len(found) + k}" for k in range(1, len(built) + 1))
        drawn = zip(built, numbered, strict=True)
        found += built if group.scenarios else [msgspec.structs.replace(one, name=label) for one, label in drawn]
    sampled = not any(group.scenarios for group in read.groups)
    return Suite(name, read.description, tuple(found), sampled)


def _folder() -> Path:
    return shipped_folder() / "suites"
