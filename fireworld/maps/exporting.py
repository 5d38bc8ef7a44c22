"""Export: a city, and a scenario in it, as a map of the official program."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from fireworld.arguments import path_of
from fireworld.city.city import Plan, RoadMap
from fireworld.city.entrances import at_entrances
from fireworld.city.formats.json_text import hydrants_of
from fireworld.city.formats.official.folder import MapFiles, import_files
from fireworld.city.formats.official.gml_text import GmlWriter
from fireworld.city.formats.official.scenario_text import config_files, scenario_xml
from fireworld.city.streets import streets_of
from fireworld.files import check_folder, new_folder
from fireworld.maps.sources import CitySource, city_of
from fireworld.maps.street_areas import as_positions, roads_of_streets
from fireworld.scenario import Scenario
from fireworld.simulation.placement import Placement, place

FILES: Final = ("map.gml", "scenario.xml", "common.cfg", "gis.cfg", "resq-fire.cfg", "misc.cfg")
ID_MAX: Final = 2**31 - 1
STEPS: Final = 300


@dataclass(frozen=True)
class ExportedCity:
    """What an export wrote."""

    folder: Path
    plan: Plan
    """The city as the official reader reads it again."""
    differences: Sequence[str]
    """What it reads otherwise than it was: a line each."""

    def __repr__(self) -> str:
        return f"<ExportedCity {self.folder}: {len(self.plan.footprints.building_id)} buildings>"


def export_city(
    city: str | os.PathLike[str] | Scenario, folder: str | os.PathLike[str], *, force: bool = False
) -> ExportedCity:
    """Write a city as a map of the RoboCup Rescue simulation: map.gml, scenario.xml and *.cfg.

    What was written is read again, exactly as the official reader does, and compared. A city without roads gets roads
    along its streets, and an entrance to every building.

    Args:
        city: a city file, a scenario by its name or file, the folder of an official map, or a Scenario.
        folder: the folder to make.
        force: replace an earlier export.

    Raises:
        CityError, ScenarioError: no city.
        OutputError: the folder exists, holds other files, or cannot be written.
    """
    target = path_of("folder", folder)
    check_folder(target, own=FILES, force=force)
    source = city_of(city)
    contents, plan, differences = _written(source)
    with new_folder(target, own=FILES, force=force) as partial:
        for name, text in contents.items():
            (partial / name).write_text(text, encoding="utf-8", newline="\n")
    return ExportedCity(folder=target, plan=plan, differences=differences)


def _written(source: CitySource) -> tuple[dict[str, str], Plan, list[str]]:
    """Return the files of a map, the plan that they make, and what it has otherwise."""
    plan = _moved(source.plan)
    roads, hydrants = _roads(plan)
    writer = GmlWriter(plan, roads)
    contents = {"map.gml": "".join(writer.lines())}
    people, left_out = _people(source, plan)
    contents["scenario.xml"] = scenario_xml(plan, hydrants, people)
    contents |= config_files(plan, source.parameters, source.scenario.steps if source.scenario else STEPS)
    configs = tuple((name, text.encode()) for name, text in contents.items() if name.endswith(".cfg"))
    files = MapFiles(
        name=plan.name,
        map_file=Path("map.gml"),
        map_content=contents["map.gml"].encode(),
        scenario_file=Path("scenario.xml"),
        scenario_content=contents["scenario.xml"].encode(),
        config_folder=Path(),
        config=configs,
    )
    again = import_files(files).plan
    differences = [*left_out, *_differences(source.plan, plan, again)]
    if writer.lost_passages:
        differences.append(f"{writer.lost_passages} passages are no edge of an area: left out")
    if source.plan.links is not None:
        differences.append("radiation links are no part of a map: left out")
    return contents, again, differences


def _moved(plan: Plan) -> Plan:
    """Return a plan that has no negative coordinates: moved by whole metres, if need be."""
    lows = [plan.footprints.outline_mm.min(axis=0), plan.streets.node_mm.min(axis=0)]
    if plan.roads is not None and len(plan.roads.outline_mm):
        lows.append(plan.roads.outline_mm.min(axis=0))
    elif plan.roads is None:
        lows[1] = lows[1] - 4000  # half a road that is laid along a street
    low = np.minimum.reduce(lows)
    by = np.where(low < 0, -(low // 1000) * 1000, 0).astype(np.int32)
    if not by.any():
        return plan
    found, streets, roads = plan.footprints, plan.streets, plan.roads
    if roads is not None:
        roads = replace(
            roads,
            outline_mm=roads.outline_mm + by,
            centroid_mm=roads.centroid_mm + by,
            passage_mm=roads.passage_mm + np.tile(by, 2),
        )
    return replace(
        plan,
        footprints=replace(found, outline_mm=found.outline_mm + by, centroid_mm=found.centroid_mm + by),
        streets=replace(streets, node_mm=streets.node_mm + by),
        roads=roads,
    )


def _roads(plan: Plan) -> tuple[RoadMap, list[int]]:
    """Return the roads of a city, laid along its streets if it has none, and those with a hydrant."""
    if plan.roads is not None:
        return plan.roads, [hydrant["id"] for hydrant in hydrants_of(plan)]
    streets = streets_of(plan.streets, plan.footprints.centroid_mm)
    streets = at_entrances(streets, plan.streets.entrance_node)
    first_id = int(plan.footprints.building_id.max()) + 1
    roads = roads_of_streets(plan, streets, first_id=first_id)
    return roads, as_positions(plan.streets.hydrant_node.astype(np.int64), roads)


def _people(source: CitySource, plan: Plan) -> tuple[dict[str, list[int]], list[str]]:
    """Return the places of fires, civilians and brigades by ids, and what has no place in a scenario.xml."""
    if source.scenario is None:
        return {}, []
    placement = place(source.scenario, source.plan)
    ids = plan.footprints.building_id
    people = {
        "fire": ids[placement.ignited].tolist(),
        "civilian": _civilians(source.plan, placement),
        "firebrigade": _brigades(source.plan, placement),
    }
    later = len(placement.later_step)
    left_out = [f"{later} fires of later steps: left out, for scenario.xml has no steps"] if later else []
    return people, left_out


def _civilians(plan: Plan, placement: Placement) -> list[int]:
    ids, found = plan.footprints.building_id, []
    for building, point in zip(placement.civilian_building.tolist(), placement.civilian_mm.tolist(), strict=True):
        found.append(int(ids[building]) if building >= 0 else _road_at(plan, point))
    return found


def _brigades(plan: Plan, placement: Placement) -> list[int]:
    ids = plan.footprints.building_id
    nodes = placement.brigade_node.tolist() or [-1] * len(placement.brigade_refuge)
    found = []
    for building, node in zip(placement.brigade_refuge.tolist(), nodes, strict=True):
        found.append(int(ids[building]) if node < 0 else _road_at(plan, plan.streets.node_mm[node].tolist()))
    return found


def _road_at(plan: Plan, point: Sequence[int]) -> int:
    """Return the id of the road whose centroid is at a point, or nearest to it."""
    if plan.roads is None:
        raise AssertionError("a place on a road of a city without roads")
    away = plan.roads.centroid_mm.astype(np.int64) - np.array(point)
    return int(plan.roads.road_id[int(np.argmin((away * away).sum(axis=1)))])


def _differences(before: Plan, moved: Plan, again: Plan) -> list[str]:
    """Say what the official reader reads otherwise than the plan has it."""
    found = []
    if moved is not before:
        x, y = (moved.footprints.outline_mm[0] - before.footprints.outline_mm[0]).tolist()
        found.append(f"all is moved by {x // 1000} m to the east and {y // 1000} m to the north")
    ours, theirs = moved.footprints.building_id, again.footprints.building_id
    if not np.array_equal(ours, theirs):
        found.append("the order of the buildings is that of the official program, and another one here")
    place = {building: at for at, building in enumerate(theirs.tolist())}
    order = [place[building] for building in ours.tolist()]
    for item in fields(moved.footprints):
        if item.name in {"building_id", "outline_ptr", "outline_mm"}:
            continue
        mine, other = getattr(moved.footprints, item.name), getattr(again.footprints, item.name)[order]
        differs = int((np.asarray(mine != other).reshape(len(ours), -1)).any(axis=1).sum())
        if differs:
            found.append(f"{item.name} of {differs} buildings is read otherwise")
    if moved.roads is None:
        roads: Any = again.roads
        found.append(f"{len(roads.road_id)} roads are laid along the streets, with an entrance to every building")
    return found
