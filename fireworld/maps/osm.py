"""Import: an extract of OpenStreetMap as a city file, and a fire in it as a scenario file."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any, Final

from fireworld.arguments import path_of, seed_of
from fireworld.city.formats.json_plan import parse_plan
from fireworld.city.formats.json_text import plan_text
from fireworld.city.formats.official.report import Report
from fireworld.city.formats.osm.area import Area, area_of
from fireworld.city.formats.osm.projection import UNITS_PER_DEGREE
from fireworld.city.formats.osm.reader import OsmFile
from fireworld.city.formats.osm.reading import read_city
from fireworld.errors import CityError, expected
from fireworld.files import check_outputs
from fireworld.maps.imported import ImportedMap, city_name, outputs_of, write_import
from fireworld.maps.osm_fire import fire_text

ATTRIBUTION: Final = "© OpenStreetMap contributors, ODbL 1.0"
"""What the license of OpenStreetMap asks for, wherever something made of its data is shown."""
FORMAT: Final = "OpenStreetMap"
TEXT_MAX: Final = 200
REPORT_LINES_MAX: Final = 60


@dataclass(frozen=True)
class ImportedOsm(ImportedMap):
    """What an import made of an extract."""

    @property
    def summary(self) -> dict[str, Any]:
        """How large the city is, as JSON holds it."""
        footprints, streets = self.plan.footprints, self.plan.streets
        return {
            "name": self.plan.name,
            "n_buildings": len(footprints.building_id),
            "n_refuges": int(footprints.refuge.sum()),
            "n_nodes": len(streets.node_mm),
            "n_streets": len(streets.street),
            "n_hydrants": len(streets.hydrant_node),
            "extent_m": self.extent_m,
        }

    def __repr__(self) -> str:
        found = self.summary
        return f"<ImportedOsm {found['name']}: {found['n_buildings']} buildings, {found['n_streets']} streets>"


def import_osm(
    extract: str | os.PathLike[str],
    *,
    around: tuple[float, float] | None = None,
    radius_m: float | None = None,
    box: tuple[float, float, float, float] | None = None,
    seed: int = 1,
    name: str | None = None,
    refuges: Sequence[int | str] = (),
    attribution: str = ATTRIBUTION,
    output: str | os.PathLike[str] | None = None,
    write_scenario: str | os.PathLike[str] | None = None,
    fires: Sequence[int | str] | None = None,
    force: bool = False,
    on_progress: Callable[[str], object] = lambda _: None,
) -> ImportedOsm:
    """Make a city of an extract of OpenStreetMap: .osm, .osm.gz, .osm.bz2 or .pbf. Needs `fireworld[osm]`.

    Args:
        extract: the file.
        around: latitude and longitude of the middle, in degrees; by default the middle of the extract.
        radius_m: buildings with their middle so near to it are taken.
        box: south, west, north, east in degrees, instead of a radius; without either all of the extract is taken.
        seed: of the materials that no tag names; the same extract, area and seed make the same city.
        name: of the city; by default the file's.
        refuges: buildings by number or by id of OpenStreetMap ("w123", "r45"); by default the fire stations.
        attribution: whom the data is by: goes wherever the city is shown.
        output: city file (.json) to write.
        write_scenario: scenario file (.yaml) to write; it names the city file.
        fires: buildings that burn in the scenario, named as refuges are; by default some in the middle.
        force: replace existing files.
        on_progress: called with what is done next.

    Raises:
        ArgumentError: an argument that makes no sense.
        CityError: pyosmium is not installed, the file is damaged or no extract, or no city is there.
        ScenarioError: fires where nothing can burn.
        OutputError: files that cannot be written. Nothing is written after an error.
    """
    path, seed = path_of("extract", extract), seed_of(seed)
    outputs = outputs_of(output, write_scenario)
    check_outputs(outputs, force=force, inputs=[path])
    for key, text in (("--name", name), ("--attribution", attribution)):
        if text is not None and not (0 < len(text) <= (100 if key == "--name" else TEXT_MAX) and text.isprintable()):
            raise CityError(expected(key, "", "a text of printable characters, not too long", text))
    file = OsmFile(path)
    area = area_of(file, around=around, radius_m=radius_m, box=box)
    made = read_city(
        file, area, name=name or _printable(file.stem), seed=seed, refuges=refuges, on_progress=on_progress
    )
    source = _source(file, area, made.report, seed=seed, attribution=attribution)
    text = plan_text(replace(made.plan, source=source))
    plan = parse_plan(text.encode(), where=str(output or path), name=made.plan.name)
    fire = None
    if write_scenario is not None:
        fire = fire_text(plan, text, fires=fires, city=city_name(output, write_scenario, plan.name))
    write_import(outputs, text if output else None, fire)
    return ImportedOsm(plan=plan, city_text=text, scenario_text=fire, report=made.report, files=outputs)


def _source(file: OsmFile, area: Area, report: Report, *, seed: int, attribution: str) -> Mapping[str, Any]:
    """Return what the city file says of where it comes from; no more of the report than there is room for."""
    projection = area.projection
    source: dict[str, Any] = {
        "format": FORMAT,
        "attribution": attribution,
        "file": _printable(file.name),
        "middle": [projection.latitude / UNITS_PER_DEGREE, projection.longitude / UNITS_PER_DEGREE],
        "radius_m": None if area.radius_mm is None else area.radius_mm / 1000,
        "box_m": [one / 1000 for one in area.box_mm],
        "projection": "transverse Mercator on WGS 84 around the middle",
        "seed": seed,
        "report": list(islice(report.lines, REPORT_LINES_MAX)),
    }
    return source


def _printable(text: str) -> str:
    """Return a file's name as a name that cities can have."""
    kept = "".join(letter if letter.isprintable() else "?" for letter in text)[: TEXT_MAX // 2]
    return kept or "city"
