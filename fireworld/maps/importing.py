"""Import: an official map as a city file, and its scenario as a scenario file."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fireworld.arguments import path_of
from fireworld.city.formats.json_plan import parse_plan
from fireworld.city.formats.official.folder import Imported, MapFiles, find_files, import_files
from fireworld.city.formats.official.text import city_text
from fireworld.files import check_outputs
from fireworld.maps.fire import scenario_text
from fireworld.maps.imported import ImportedMap, city_name, outputs_of, write_import


@dataclass(frozen=True)
class ImportedCity(ImportedMap):
    """What an import made of a map."""

    @property
    def summary(self) -> dict[str, Any]:
        """How large the map is, as JSON holds it."""
        plan, roads = self.plan, self.plan.roads
        return {
            "name": plan.name,
            "n_buildings": len(plan.footprints.building_id),
            "n_refuges": int(plan.footprints.refuge.sum()),
            "n_roads": 0 if roads is None else len(roads.road_id),
            "n_entrances": int((plan.streets.entrance_node >= 0).sum()),
            "n_hydrants": len(plan.streets.hydrant_node),
            "extent_m": self.extent_m,
        }

    def __repr__(self) -> str:
        found = self.summary
        return f"<ImportedCity {found['name']}: {found['n_buildings']} buildings, {found['n_roads']} roads>"


def import_city(
    map: str | os.PathLike[str],  # noqa: A002 - what it is called everywhere
    *,
    config: str | os.PathLike[str] | None = None,
    scenario: str | os.PathLike[str] | None = None,
    fires: Sequence[int] | None = None,
    links: str | os.PathLike[str] | None = None,
    attribution: str | None = None,
    output: str | os.PathLike[str] | None = None,
    write_scenario: str | os.PathLike[str] | None = None,
    force: bool = False,
) -> ImportedCity:
    """Read a map of the RoboCup Rescue simulation exactly as the official reader does.

    Args:
        map: the folder of a map, or its map.gml, packed by gzip or not.
        config: folder with *.cfg; by default those beside the map.
        scenario: a scenario.xml; by default the one beside the map.
        fires: ids of the buildings that burn in the scenario, instead of those of scenario.xml.
        links: a file (.npz) with radiation links measured elsewhere, as a trace holds them; by default rays are sent.
        attribution: who made the map, to be named wherever it is shown.
        output: city file (.json) to write.
        write_scenario: scenario file (.yaml) to write; it names the city file.
        force: replace existing files.

    Raises:
        CityError: files that make no map.
        ScenarioError: no fires, or fires where nothing can burn.
        TraceError: links that do not fit.
        OutputError: files that cannot be written. Nothing is written after an error.
    """
    given = {"map": map, "config": config, "scenario": scenario, "links": links}
    paths = {name: path_of(name, value) for name, value in given.items() if value is not None}
    outputs = outputs_of(output, write_scenario)
    files = find_files(paths["map"], config=paths.get("config"), scenario=paths.get("scenario"))
    read = [path for path in (files.map_file, files.scenario_file, paths.get("links")) if path is not None]
    check_outputs(outputs, force=force, inputs=read)
    imported = import_files(files)
    text = _with_links(files, imported, paths.get("links"), attribution)
    plan = parse_plan(text.encode(), where=str(output or files.map_file), name=files.name)
    for line in plan.notes:
        imported.report.note("outlines", line)
    fire = None
    if write_scenario is not None:
        city = city_name(output, write_scenario, files.name)
        fire = scenario_text(files, imported, plan, text, fires=fires, city=city)
    write_import(outputs, text if output else None, fire)
    return ImportedCity(plan=plan, city_text=text, scenario_text=fire, report=imported.report, files=outputs)


def _with_links(files: MapFiles, imported: Imported, links: Path | None, attribution: str | None) -> str:
    """Return the text of the city file, with links that are given."""
    if links is None:
        return city_text(files, imported, attribution=attribution)
    from fireworld.conformance.links import load_links

    given = load_links(links, imported.plan.footprints.building_id)
    return city_text(files, imported, links=given, attribution=attribution)
