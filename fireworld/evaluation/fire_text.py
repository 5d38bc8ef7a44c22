"""New fires as scenario files, and several of them as a curriculum."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import msgspec

from fireworld.errors import one_line
from fireworld.files import name_from
from fireworld.scenario import Scenario
from fireworld.scenario.document import BrigadeTeam, Document, GeneratedCity
from fireworld.scenario.yaml_text import write_yaml

WIDTH: Final = 100
STATED: Final = {Document: {"preset", "brigades", "steps"}, BrigadeTeam: {"n"}, GeneratedCity: {"seed"}}
"""Keys that are written even if they are as the defaults have them, by what they belong to."""


def fire_text(scenario: Scenario, *, folder: Path, comment: str) -> str:
    """Return a scenario as the text of a file: what differs from most defaults, below a comment.

    Args:
        scenario: the scenario; its name is left to the file.
        folder: of the file, which its city is named from.
        comment: how it was made.
    """
    document = {key: _stated(getattr(scenario, key)) for key in _changed(scenario, Document) if key != "name"}
    for key in ("file", "official"):
        if key in document["city"]:
            document["city"][key] = name_from(Path(document["city"][key]), folder)
    return f"{_as_comment(comment)}\n{write_yaml(document)}"


def curriculum_text(files: Sequence[Path], *, cooperation: bool, description: str, comment: str) -> str:
    """Return a curriculum of scenario files beside it: its only stage is called contested."""
    stage = {"name": "contested", "cooperation": cooperation, "scenarios": [path.name for path in files]}
    return f"{_as_comment(comment)}\n{write_yaml({'description': description, 'stages': [stage]})}"


def _changed(value: msgspec.Struct, kind: type[msgspec.Struct]) -> list[str]:
    """Return the keys whose values are not the defaults, and those that are written in any case."""
    stated = STATED.get(kind, set())
    fields = msgspec.structs.fields(kind)
    return [item.name for item in fields if item.name in stated or getattr(value, item.name) != item.default]


def _stated(value: Any) -> Any:
    """Return a value as a YAML reader would, without what is as the defaults have it."""
    if isinstance(value, msgspec.Struct):
        return {key: _stated(getattr(value, key)) for key in _changed(value, type(value))}
    if isinstance(value, tuple):
        return [_stated(item) for item in value]
    return value


def _as_comment(text: str) -> str:
    """Return a text as a comment of several lines."""
    lines = textwrap.wrap(one_line(text), WIDTH - 2, break_on_hyphens=False, break_long_words=False)
    return "\n".join(f"# {line}" for line in lines)
