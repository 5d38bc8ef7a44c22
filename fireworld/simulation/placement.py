"""From a scenario to its city plan, and who and what is where in it at the start.

The data flows one way: a scenario is read (fireworld.scenario), its plan made or loaded here, fires, people and
brigades placed in the plan here, and the plan built into a City (fireworld.city.build).
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Final, NoReturn

import msgspec
import numpy as np

from fireworld import draws
from fireworld.city.city import Int32Array, Int64Array, Plan, freeze
from fireworld.city.formats import read_plan
from fireworld.city.generator import generate_plan
from fireworld.city.places import Place, find_buildings, find_places, in_building, with_places
from fireworld.errors import CityError, ScenarioError, expected
from fireworld.scenario.document import Civilians, Fire, Point
from fireworld.scenario.scenario import Scenario, read_city_file

SCENARIO_ATTACHMENT: Final = "scenario.yaml"
CITY_ATTACHMENT: Final = "city.json"


@dataclass(frozen=True)
class Placement:
    """Who and what is where at the start; buildings by index, read-only."""

    ignited: Int32Array  # (k,) buildings that burn at the start, rising
    civilian_building: Int32Array  # (c,) building each civilian is in, -1 on a road
    civilian_mm: Int32Array  # (c, 2) where: the centroid of the building or the road
    brigade_refuge: Int32Array  # (b,) building at which each brigade starts: a refuge, unless the scenario says where
    brigade_node: Int32Array = field(default_factory=lambda: np.zeros(0, dtype=np.int32))
    """(b,) node of the streets at which a brigade starts, -1 for those at a building; empty if all are."""
    later_step: Int64Array = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    """(l,) step, rising, in which each later fire is lit."""
    later_building: Int64Array = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    """(l,) building that it is lit in."""


def scenario_plan(scenario: Scenario, *, city_json: bytes | None = None) -> Plan:
    """Make or load the plan of a scenario's city; `city_json` is the content of its file, where that is in a recording.

    Raises ScenarioError for figures that make no city or another city file, CityError for a file that makes none.
    """
    source = scenario.city
    plan = _plan_of_source(scenario, city_json)
    refuse = partial(_refuse, scenario)
    return with_places(
        plan, refuges=source.refuges, hydrants=source.hydrants, gas_stations=source.gas_stations, refuse=refuse
    )


def _plan_of_source(scenario: Scenario, city_json: bytes | None) -> Plan:
    generated = scenario.city.generated
    if generated is None:
        file = scenario.city.named_file
        text = _check_city_file(scenario, city_json if city_json is not None else read_city_file(scenario))
        return read_plan(text, file=file, where=file.name if city_json is not None else str(file))
    name = f"generated-{generated.columns}x{generated.rows}-{generated.seed}"
    try:
        return generate_plan(name=name, **msgspec.structs.asdict(generated))
    except CityError as error:
        raise ScenarioError(f"{scenario.source}: city.generated: {error}") from None


def attachments(scenario: Scenario, *, city_json: bytes | None = None) -> dict[str, bytes]:
    """Return the files that a recording of the scenario carries, by name: all that a replay needs of it.

    `parse_scenario` reads "scenario.yaml" back, and `scenario_plan` takes "city.json", there if the city is a file's;
    `city_json` is its content, where that is in a recording.
    """
    files = {SCENARIO_ATTACHMENT: scenario.to_yaml().encode()}
    if scenario.city.generated is None:
        content = read_city_file(scenario) if city_json is None else city_json
        files[CITY_ATTACHMENT] = _check_city_file(scenario, content)
    return files


def place(scenario: Scenario, plan: Plan) -> Placement:
    """Place a scenario's fires, civilians and brigades in its city; ScenarioError if it has not what they need."""
    ignited: list[int] = []
    later: list[tuple[int, int]] = []
    for index, fire in enumerate(scenario.fires):
        taken = [*ignited, *(building for _, building in later)]
        buildings = _ignite(scenario, plan, fire, key=f"fires.{index}", taken=taken)
        if fire.step is None:
            ignited += buildings
        else:
            later += [(fire.step, building) for building in buildings]
    ignited.sort()
    later.sort()
    people = _place_civilians(scenario, plan, ignited=ignited)
    starts = _place_brigades(scenario, plan)
    on_road = np.array([start.node for start in starts], dtype=np.int32)
    return freeze(
        Placement(
            ignited=np.array(ignited, dtype=np.int32),
            civilian_building=np.array([place.building for place in people], dtype=np.int32),
            civilian_mm=np.array([place.point_mm for place in people], dtype=np.int32).reshape(-1, 2),
            brigade_refuge=np.array([start.building for start in starts], dtype=np.int32),
            brigade_node=on_road if (on_road >= 0).any() else on_road[:0],
            later_step=np.array([step for step, _ in later], dtype=np.int64),
            later_building=np.array([building for _, building in later], dtype=np.int64),
        )
    )


def _place_brigades(scenario: Scenario, plan: Plan) -> list[Place]:
    """Return where each brigade starts: at the places that are named, else at the refuges, in turn."""
    team = scenario.brigades
    if team.at is not None:
        places = find_places(plan, team.at, refuse=partial(_refuse, scenario, "brigades.at"))
    else:
        refuges = np.flatnonzero(plan.footprints.refuge).tolist()
        if not refuges:
            hint = "try brigades.at"
            _refuse(scenario, "city", "a city with a refuge, where brigades start and fill their tanks", "none", hint)
        places = [in_building(plan, building) for building in refuges]
    return [places[brigade % len(places)] for brigade in range(team.n)]


def _check_city_file(scenario: Scenario, text: bytes) -> bytes:
    """Return the content of a city file if it is the one that the scenario was loaded with."""
    digest = hashlib.sha256(text).hexdigest()
    if digest != scenario.city_sha256:
        key = "city.file" if scenario.city.official is None else "city.official"
        _refuse(scenario, key, f"a city file of SHA-256 {scenario.city_sha256}", f"one of {digest}")
    return text


def _ignite(scenario: Scenario, plan: Plan, fire: Fire, *, key: str, taken: list[int]) -> list[int]:
    """Return the buildings that one fire sets alight, besides those that another fire has taken."""
    if fire.at is None:
        return _ignite_named(scenario, plan, fire, key=f"{key}.buildings", taken=taken)
    inflammable = plan.footprints.inflammable != 0
    inflammable[taken] = False
    free = np.flatnonzero(inflammable)
    n_buildings = fire.n_buildings or 1
    if n_buildings > len(free):
        _refuse(scenario, f"{key}.n_buildings", f"at most {len(free)}, the city's inflammable buildings", n_buildings)
    x_mm, y_mm = _locate(plan, fire.at)
    offset = plan.footprints.centroid_mm[free].astype(np.int64) - (x_mm, y_mm)
    nearest = np.argsort((offset * offset).sum(axis=1), kind="stable")[:n_buildings]
    return [int(building) for building in free[nearest]]


def _ignite_named(scenario: Scenario, plan: Plan, fire: Fire, *, key: str, taken: list[int]) -> list[int]:
    """Return the buildings that a fire names, if they can burn and no other fire has taken them."""
    buildings = _find_buildings(scenario, plan, fire.buildings or (), key=key)
    for building in buildings:
        building_id = plan.footprints.building_id[building]
        if not plan.footprints.inflammable[building]:
            _refuse(scenario, key, "inflammable buildings", f"building {building_id}, which cannot burn")
        if building in taken:
            _refuse(scenario, key, "buildings that no other fire takes", f"building {building_id}")
    return buildings


def _place_civilians(scenario: Scenario, plan: Plan, *, ignited: list[int]) -> list[Place]:
    """Return where each civilian is."""
    civilians = scenario.civilians
    if civilians.at is not None:
        return find_places(plan, civilians.at, refuse=partial(_refuse, scenario, "civilians.at"))
    if civilians.buildings is not None:
        buildings = _find_buildings(scenario, plan, civilians.buildings, key="civilians.buildings")
    else:
        buildings = _draw_buildings(scenario, plan, ignited=ignited)
    return [in_building(plan, building) for building in buildings]


def _draw_buildings(scenario: Scenario, plan: Plan, *, ignited: list[int]) -> list[int]:
    """Return the building of each of the civilians that are placed at random."""
    civilians = scenario.civilians
    n_civilians = civilians.n or 0
    if n_civilians == 0:
        return []
    places = _civilian_places(civilians, plan, ignited=ignited, center_mm=_center_of_people(scenario, plan))
    chosen: list[int] = []
    turn = 0
    while len(chosen) < n_civilians and any(places):
        queue = places[turn % len(places)]
        turn += 1
        while queue and queue[0] in chosen:
            del queue[0]
        chosen += queue[:1]
    if len(chosen) < n_civilians:
        wanted = f"at most {len(chosen)}, the unburnt inflammable buildings of that distance and direction"
        _refuse(scenario, "civilians.n", wanted, n_civilians, hint="try a greater to_m")
    return chosen


def _civilian_places(
    civilians: Civilians, plan: Plan, *, ignited: list[int], center_mm: tuple[int, int]
) -> list[list[int]]:
    """Return, for each direction, the buildings where a civilian may be, in the order of their draws."""
    eligible = plan.footprints.inflammable != 0
    eligible[ignited] = False
    offset = plan.footprints.centroid_mm.astype(np.int64) - center_mm
    square = (offset * offset).sum(axis=1)
    eligible &= square >= round(civilians.from_m * 1000) ** 2
    if civilians.to_m is not None:
        eligible &= square <= round(civilians.to_m * 1000) ** 2

    def draw(building: int) -> int:
        return draws.hash_key(civilians.seed, draws.PLACEMENT, int(plan.footprints.building_id[building]), 0)

    east, north = offset.T
    ahead_and_aside = {"N": (north, east), "E": (east, north), "S": (-north, east), "W": (-east, north)}
    places = []
    for direction in civilians.directions:
        ahead, aside = ahead_and_aside[direction]  # a quarter around the direction; diagonals belong to both
        places.append(sorted(np.flatnonzero(eligible & (ahead >= np.abs(aside))).tolist(), key=draw))
    return places


def _center_of_people(scenario: Scenario, plan: Plan) -> tuple[int, int]:
    """Return the point around which civilians are placed: as said, or the centre of the first fire."""
    fire, around = scenario.fires[0], scenario.civilians.around
    if around is not None:
        return _locate(plan, around)
    if fire.at is not None:
        return _locate(plan, fire.at)
    buildings = _find_buildings(scenario, plan, fire.buildings or (), key="fires.0.buildings")
    x_mm, y_mm = plan.footprints.centroid_mm[buildings].astype(np.int64).sum(axis=0)
    return int(x_mm) // len(buildings), int(y_mm) // len(buildings)


def _find_buildings(scenario: Scenario, plan: Plan, building_ids: Sequence[int], *, key: str) -> list[int]:
    """Return the indices of buildings by their ids."""
    return find_buildings(plan, building_ids, refuse=partial(_refuse, scenario, key))


def _locate(plan: Plan, point: Point) -> tuple[int, int]:
    """Turn fractions of the city's bounding box into a place in whole millimetres."""
    low, high = plan.footprints.outline_mm.min(axis=0), plan.footprints.outline_mm.max(axis=0)
    x_mm, y_mm = (int(low[axis]) + int(point[axis] * (int(high[axis]) - int(low[axis]))) for axis in (0, 1))
    return x_mm, y_mm


def _refuse(scenario: Scenario, key: str, wanted: str, got: object, hint: str = "") -> NoReturn:
    """Raise the error for a scenario that does not fit its city."""
    raise ScenarioError(expected(scenario.source, key, wanted, got, hint))
