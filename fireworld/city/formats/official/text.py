"""The city file that an official map makes."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

from fireworld.city.city import Links
from fireworld.city.formats.json_text import plan_text
from fireworld.city.formats.official.folder import Imported, MapFiles, find_files, import_files

FORMAT: Final = "RoboCup Rescue map (GML)"
REPORT_LINES_MAX: Final = 50


def city_file(folder: Path, *, scenario: str | None = None) -> bytes:
    """Return the content of the city file that an official map makes; `scenario` is relative to its folder.

    Raises:
        CityError: whatever makes no map.
    """
    files = find_files(folder, scenario=None if scenario is None else folder / scenario)
    return _city_file(files)


@lru_cache(maxsize=4)
def _city_file(files: MapFiles) -> bytes:
    """Make it once for each content: a scenario is read, built and recorded."""
    return city_text(files, import_files(files)).encode()


def city_text(
    files: MapFiles, imported: Imported, *, links: Links | None = None, attribution: str | None = None
) -> str:
    """Return the text of the city file of a map, with what its source is and what was repaired and inferred."""
    plan = replace(imported.plan, links=links, source=source_of(files, imported, attribution))
    return plan_text(plan)


def source_of(files: MapFiles, imported: Imported, attribution: str | None = None) -> Mapping[str, Any]:
    """Return what a city file says of the map that it comes from: names and digests of files, not where they were."""
    source = {
        "format": FORMAT,
        "map": files.map_file.name,
        "map_sha256": hashlib.sha256(files.map_content).hexdigest(),
        "attribution": attribution or f"{files.name}, a map of the RoboCup Rescue simulation",
    }
    if files.scenario_file is not None:
        source["scenario"] = files.scenario_file.name
    return {**source, "report": imported.report.lines[:REPORT_LINES_MAX]}
