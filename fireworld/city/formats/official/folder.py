"""The files of an official map: which there are, their contents, and the plan that they make."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from fireworld.city.city import Plan
from fireworld.city.formats.official.cfg import Config, read_config
from fireworld.city.formats.official.gml import read_gml
from fireworld.city.formats.official.reading import build_plan
from fireworld.city.formats.official.report import Report
from fireworld.city.formats.official.scenario_xml import ScenarioXml, read_scenario_xml
from fireworld.errors import CityError, expected
from fireworld.files import read_input

MAP_NAMES: Final = ("map.gml", "map.gml.gz")
SCENARIO_NAME: Final = "scenario.xml"
MAP_BYTES_MAX: Final = 1_000_000_000
CONFIG_BYTES_MAX: Final = 1_000_000
N_CONFIGS_MAX: Final = 200


@dataclass(frozen=True)
class MapFiles:
    """What an import reads: contents, and the names that errors say."""

    name: str
    map_file: Path
    map_content: bytes
    scenario_file: Path | None
    scenario_content: bytes
    config_folder: Path | None
    config: tuple[tuple[str, bytes], ...] = ()
    """Names, relative to the folder, and contents of its *.cfg."""


@dataclass(frozen=True)
class Imported:
    """A map as the official reader reads it."""

    plan: Plan
    scenario: ScenarioXml | None
    config: Config
    report: Report


def find_files(given: Path, *, config: Path | None = None, scenario: Path | None = None) -> MapFiles:
    """Find the files of a map: a folder, or the map.gml itself, packed by gzip or not.

    Without `scenario` and `config`: the scenario.xml and the *.cfg beside the map, or in a folder config beside its
    folder; where there are none, the map has none.

    Raises:
        CityError: a file that is not there or cannot be read.
    """
    map_file = _map_file(given)
    folder = map_file.parent
    if scenario is None and (folder / SCENARIO_NAME).is_file():
        scenario = folder / SCENARIO_NAME
    configs = _configs(folder, config)
    return MapFiles(
        name=_name(map_file),
        map_file=map_file,
        map_content=_read(map_file, "a map", MAP_BYTES_MAX),
        scenario_file=scenario,
        scenario_content=_read(scenario, "a scenario.xml", MAP_BYTES_MAX) if scenario else b"",
        config_folder=configs,
        config=_read_configs(configs) if configs else (),
    )


def import_files(files: MapFiles) -> Imported:
    """Read a map.

    Raises:
        CityError: which names the file, for whatever makes no map.
    """
    report = Report()
    gml = read_gml(files.map_content, where=str(files.map_file))
    config = read_config(dict(files.config), where=str(files.config_folder)) if files.config_folder else Config()
    scenario = None
    if files.scenario_file is not None:
        scenario = read_scenario_xml(files.scenario_content, where=str(files.scenario_file))
    if not config.values:
        report.note("no-configuration", "no configuration: floors and codes are those of the map")
    if config.missing:
        report.note("config-missing", f"included and not there: {', '.join(dict.fromkeys(config.missing))}")
    plan = build_plan(gml, config, scenario, name=files.name, report=report)
    if gml.n_spaces:
        report.note("spaces", f"{gml.n_spaces} spaces of the map: left out")
    return Imported(plan, scenario, config, report)


def _map_file(given: Path) -> Path:
    """Return the map of a folder, or the file that was named."""
    if not given.is_dir():
        return given
    for folder in (given, given / "map"):
        for name in MAP_NAMES:
            if (folder / name).is_file():
                return folder / name
    raise CityError(expected(str(given), "", f"a folder with {' or '.join(MAP_NAMES)}", "none of them in it"))


def _name(map_file: Path) -> str:
    """Name a map by its folder, or by its file if that is not called map.gml."""
    if map_file.name not in MAP_NAMES:
        return map_file.name.removesuffix(".gz").removesuffix(".gml") or "map"
    folder = map_file.absolute().parent
    name = (folder.parent if folder.name == "map" else folder).name
    return "".join(letter if letter.isprintable() else "_" for letter in name)[:100] or "map"


def _configs(folder: Path, given: Path | None) -> Path | None:
    """Return the folder with the configuration, None if there is none."""
    if given is not None:
        if not given.is_dir() or not any(given.glob("*.cfg")):
            got = "none of them in it" if given.is_dir() else "no folder"
            raise CityError(expected(str(given), "", "a folder with *.cfg", got))
        return given
    candidates = (folder, folder / "config", folder.parent / "config" if folder.name == "map" else folder)
    return next((one for one in candidates if one.is_dir() and any(one.glob("*.cfg"))), None)


def _read_configs(folder: Path) -> tuple[tuple[str, bytes], ...]:
    """Read all *.cfg of a folder and the folders in it, by their names relative to it."""
    paths = sorted(path for path in (*folder.glob("*.cfg"), *folder.glob("*/*.cfg")) if path.is_file())
    if len(paths) > N_CONFIGS_MAX:
        raise CityError(expected(str(folder), "", f"at most {N_CONFIGS_MAX} files *.cfg", len(paths)))
    return tuple(
        (path.relative_to(folder).as_posix(), _read(path, "a configuration", CONFIG_BYTES_MAX)) for path in paths
    )


def _read(path: Path, what: str, most: int) -> bytes:
    """Read a file; CityError if it cannot be read or is too large."""
    return read_input(path, what=what, n_bytes_max=most, error=CityError)
