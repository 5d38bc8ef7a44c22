"""The scenarios that come with fireworld, and loading a scenario by name or path."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fireworld.errors import ScenarioError, expected, nearest
from fireworld.scenario.scenario import Scenario, read_scenario


def scenario_names() -> list[str]:
    """Name the scenarios that come with fireworld, numbers in counting order."""
    return sorted((path.stem for path in shipped_folder().glob("*.yaml")), key=_counting_order)


def load_scenario(name_or_path: str | Path) -> Scenario:
    """Load a shipped scenario by its name, or a scenario file by its path."""
    names = scenario_names()
    if str(name_or_path) in names:
        return read_scenario(shipped_folder() / f"{name_or_path}.yaml", source=str(name_or_path))
    path = Path(name_or_path)
    if path.suffix == ".mcap":
        hint = f"`fireworld view {path}` shows a recording, `fireworld verify {path}` runs it again"
        raise ScenarioError(expected(str(path), "", "a scenario", "a recording", hint))
    if path.suffix in {".yaml", ".yml"} or path.parent != Path() or path.is_file():
        return read_scenario(path)
    hint = nearest(str(name_or_path), names, otherwise="try `fireworld scenarios`")
    raise ScenarioError(expected("scenario", "", "the name of a scenario or a .yaml file", str(name_or_path), hint))


def find_scenario(given: str | Path | Scenario | Mapping[str, Any]) -> Scenario:
    """Return a scenario by its name or file, or made of the keys and values of one, or itself."""
    if isinstance(given, Scenario):
        return given
    if isinstance(given, str | Path):
        return load_scenario(given)
    if isinstance(given, Mapping):
        return Scenario.from_dict(given)
    raise ScenarioError(expected("scenario", "", "a name, a file, a Scenario, or keys and values", given))


def scenarios() -> list[Scenario]:
    """Return the scenarios that come with fireworld, by name."""
    return [load_scenario(name) for name in scenario_names()]


def shipped_folder() -> Path:
    """Return the folder of the shipped scenarios: inside the package, or at the top of a checkout."""
    package = Path(__file__).parents[1]
    inside = package / "shipped" / "scenarios"
    return inside if inside.is_dir() else package.parent / "scenarios"


def _counting_order(name: str) -> list[tuple[int, str]]:
    """Sort train-10 behind train-2."""
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in re.split(r"(\d+)", name)]
