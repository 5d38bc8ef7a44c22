"""Cities by whatever names one: a city file, a scenario, the folder of an official map."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

from fireworld.city.city import Plan
from fireworld.city.formats import read_plan
from fireworld.city.formats.official.text import city_file
from fireworld.errors import CityError
from fireworld.files import read_input
from fireworld.parameters import OFFICIAL_2013, Parameters
from fireworld.scenario import Scenario, load_scenario
from fireworld.scenario.scenario import CITY_BYTES_MAX
from fireworld.simulation.placement import scenario_plan

MAP_ENDINGS: Final = (".gml", ".gz")
SCENARIO_ENDINGS: Final = (".yaml", ".yml")
Kind = Literal["map", "scenario", "city file"]


@dataclass(frozen=True)
class CitySource:
    """A city, and the scenario that names it."""

    plan: Plan
    scenario: Scenario | None

    @property
    def parameters(self) -> Parameters:
        """The scenario's physical parameters; those of the official program where there is none."""
        return OFFICIAL_2013 if self.scenario is None else self.scenario.resolved_parameters


def kind_of(path: Path) -> Kind:
    """Return what a path that names a city is: an official map, a scenario (by name or file), or a city file."""
    if path.is_dir() or path.suffix.lower() in MAP_ENDINGS:
        return "map"
    return "scenario" if path.suffix.lower() in SCENARIO_ENDINGS or not path.suffix else "city file"


def city_of(given: str | os.PathLike[str] | Scenario) -> CitySource:
    """Return the city of a city file, of a scenario by name or file, or of an official map.

    Raises:
        CityError, ScenarioError: it names none.
    """
    if isinstance(given, Scenario):
        return CitySource(scenario_plan(given), given)
    path = Path(given)
    kind = kind_of(path)
    if kind == "map":
        return CitySource(read_plan(city_file(path), file=Path(f"{path.stem}.json"), where=str(path)), None)
    if kind == "scenario":
        scenario = load_scenario(os.fspath(given))
        return CitySource(scenario_plan(scenario), scenario)
    what = "a city file, a scenario or a map"
    content = read_input(path, what=what, n_bytes_max=CITY_BYTES_MAX, error=CityError)
    return CitySource(read_plan(content, file=path, where=str(path)), None)
