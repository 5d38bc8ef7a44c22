"""What every import of a map makes and writes: a city file, and a scenario file if it is asked for."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from fireworld.arguments import path_of
from fireworld.city.city import Plan
from fireworld.city.formats.official.report import Report
from fireworld.files import name_from, write_file
from fireworld.scenario.scenario import scenario_of
from fireworld.scenario.yaml_text import write_yaml
from fireworld.simulation.placement import place

WHERE: Final = "--write-scenario"
"""What errors of a scenario that is to be written begin with."""


@dataclass(frozen=True)
class ImportedMap:
    """What an import made of a map."""

    plan: Plan
    city_text: str
    """Content of the city file."""
    scenario_text: str | None
    """Content of the scenario file; None if none was asked for."""
    report: Report
    """What was repaired, inferred or left out."""
    files: Sequence[Path]
    """What was written."""

    @property
    def extent_m(self) -> list[float]:
        """Sides of the bounding box of all buildings, along x and y."""
        low, high = self.plan.footprints.outline_mm.min(axis=0), self.plan.footprints.outline_mm.max(axis=0)
        return [(int(high[axis]) - int(low[axis])) / 1000.0 for axis in (0, 1)]


def outputs_of(output: str | os.PathLike[str] | None, write_scenario: str | os.PathLike[str] | None) -> list[Path]:
    """Return the files that an import is asked to write: the city first."""
    return [path_of(key, to) for key, to in (("output", output), ("write_scenario", write_scenario)) if to]


def city_name(output: str | os.PathLike[str] | None, scenario: str | os.PathLike[str], name: str) -> str:
    """Name the city file as the scenario file does: relative to the scenario's folder."""
    if output is None:
        return f"{name}.json"
    return name_from(Path(output), Path(scenario).parent)


def checked_scenario(document: dict[str, Any], plan: Plan, city_text: str) -> str:
    """Return the text of a scenario file, once everybody has found a place in its city.

    Raises:
        ScenarioError, CityError: it makes no sense there.
    """
    digest = hashlib.sha256(city_text.encode()).hexdigest()
    checked = {**document, "city": {**document["city"], "sha256": digest}}
    place(scenario_of(checked, source=WHERE, folder=None), plan)
    return write_yaml(document)


def write_import(outputs: Sequence[Path], *contents: str | None) -> None:
    """Write what was asked for: as many contents are given as there are outputs, None for those that are not."""
    for path, content in zip(outputs, [one for one in contents if one], strict=True):
        write_file(path, content.encode())
