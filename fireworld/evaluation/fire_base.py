"""What new fires are lit in: a city with its team, and places in it, drawn by key."""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np

from fireworld.arguments import ArgumentError, path_of
from fireworld.city.city import Plan
from fireworld.city.formats.json_plan import parse_plan
from fireworld.city.formats.official.folder import find_files, import_files
from fireworld.city.formats.official.text import city_text
from fireworld.draws import PLACEMENT, below
from fireworld.errors import ScenarioError, expected
from fireworld.evaluation.growth import FirePlace
from fireworld.kernels.arrays import Array
from fireworld.maps.fire import scenario_document
from fireworld.maps.sources import kind_of
from fireworld.scenario import Scenario, load_scenario
from fireworld.scenario.document import Civilians
from fireworld.scenario.scenario import scenario_of
from fireworld.simulation.built import CityCache
from fireworld.simulation.placement import scenario_plan

GENERATED: Final = {"columns": 24, "rows": 26}
"""The size of the city that the scenarios which come with fireworld have."""
STEPS: Final = 400
ANYWHERE: Final = [{"at": [0.5, 0.5]}]
N_CIVILIANS: Final = range(8, 12)
"""How many people are drawn for a place, where a scenario has none of its own."""
FROM_NEIGHBOR, TO_NEIGHBOR = 44, 235
"""Between which of the buildings nearest to the fire they are: 65 m and 150 m from it in generated cities."""
ROOM_FOR_EACH: Final = 3
"""Buildings for each of many people, who have more of them around the fire."""
FROM_SHARE, PEOPLE_SHARE = 14, 4
"""In small cities: not among the nearest 14th of the buildings, and in one of four at most."""
DIGITS: Final = 4
"""Of a place, as a fraction of the city."""
FIRST_FIRE, PEOPLE = 1, 3
"""What is drawn for a place, beside the second fire (4), the third (5) ..."""

AnyCity = str | os.PathLike[str] | Scenario | None


@dataclass(frozen=True)
class FireBase:
    """A city with its team, in which fires are to be lit.

    Attributes:
        scenario: all but the fires, and the people, if they are to be drawn.
        plan: of the city.
        cities: where the city is built, once.
        n_civilians: people to be drawn around every place; None: 8 to 11. Not used where people stay.
        people_stay: the people are those of the scenario.
    """

    scenario: Scenario
    plan: Plan
    cities: CityCache
    n_civilians: int | None
    people_stay: bool

    @property
    def inflammable(self) -> Array:
        """(k,) buildings that can burn, by index."""
        return np.flatnonzero(self.plan.footprints.inflammable)

    def places(self, seed: int, *, n_places: int, n_fires: int) -> Iterator[FirePlace]:
        """Draw places of fires, each of them a building that can burn; none of them twice.

        Args:
            seed: of the draws.
            n_places: places that are drawn.
            n_fires: buildings that each of them has.
        """
        seen: set[tuple[int, ...]] = set()
        burning = self.inflammable
        for number in range(n_places):
            steps = [FIRST_FIRE, *range(PEOPLE + 1, PEOPLE + n_fires)]
            drawn = tuple(int(burning[below(seed, PLACEMENT, number, step, bound=len(burning))]) for step in steps)
            if drawn not in seen:
                seen.add(drawn)
                yield FirePlace(number + 1, tuple(map(self._point, drawn)), self._people(seed, number, drawn[0]))

    def _point(self, building: int) -> tuple[float, float]:
        """Return where a building is, as fractions of the city."""
        outlines = self.plan.footprints.outline_mm
        low, high = outlines.min(axis=0).astype(np.int64), outlines.max(axis=0).astype(np.int64)
        part = (self.plan.footprints.centroid_mm[building] - low) / (high - low)
        return round(float(part[0]), DIGITS), round(float(part[1]), DIGITS)

    def _people(self, seed: int, number: int, center: int) -> Civilians:
        """Return the people of a place: so near to the fire that it threatens them, and not yet in it."""
        if self.people_stay:
            return self.scenario.civilians
        burning = self.inflammable
        n_most = len(burning) // PEOPLE_SHARE
        n = N_CIVILIANS[below(seed, PLACEMENT, number, PEOPLE, bound=len(N_CIVILIANS))]
        n = min(n, n_most) if self.n_civilians is None else self.n_civilians
        if n == 0:
            return Civilians(n=0)
        centroid = self.plan.footprints.centroid_mm.astype(np.int64)
        offset = centroid[burning] - centroid[center]
        square_mm = np.sort((offset * offset).sum(axis=1))
        nearest = square_mm[min(FROM_NEIGHBOR, len(burning) // FROM_SHARE)]
        farthest = square_mm[min(max(TO_NEIGHBOR, FROM_NEIGHBOR + ROOM_FOR_EACH * n), len(burning) - 1)]
        from_m, to_m = math.isqrt(int(nearest)) // 1000, math.isqrt(int(farthest)) // 1000 + 1
        return msgspec.structs.replace(
            self.scenario.civilians, n=n, from_m=float(from_m), to_m=float(to_m), seed=seed, buildings=None, at=None
        )


def base_of(
    city: AnyCity, *, seed: int, brigades: int | None, civilians: int | None, values: Mapping[str, Any]
) -> FireBase:
    """Return what fires are to be lit in.

    Args:
        city: a city file; the folder of an official map, with its team and people; a scenario, of which everything
            stays but the fires; None: a generated city.
        seed: of a generated city, too.
        brigades: how many, instead of those that there are.
        civilians: the same.
        values: of keys of the scenario.

    Raises:
        ArgumentError: values of fires.
        CityError, ScenarioError: it is no city, or nothing in it can burn.
    """
    for key in values:
        if key.partition(".")[0] == "fires":
            raise ArgumentError(expected("set", key, "keys other than fires, which are looked for", key, "try counts"))
    content = None
    if isinstance(city, Scenario):
        scenario = city
    elif city is None:
        scenario = _plain({"generated": {**GENERATED, "seed": seed}})
    else:
        scenario, content = _of_path(path_of("city", city))
    stays = isinstance(city, Scenario) or (city is not None and kind_of(Path(city)) == "scenario")
    changed = dict(values) if brigades is None else {**values, "brigades.n": brigades}
    scenario = scenario.with_values(changed) if changed else scenario
    own = scenario.civilians
    if civilians is not None and own.n:
        own = msgspec.structs.replace(own, n=civilians)
        scenario = msgspec.structs.replace(scenario, civilians=own)
    plan = scenario_plan(scenario, city_json=content)
    _check_burns(plan, scenario.source)
    cities = CityCache({} if content is None else {scenario.city_sha256 or "": content})
    people_stay = bool(own.n) or (civilians is None and (stays or own.count > 0))
    return FireBase(scenario, plan, cities, civilians, people_stay)


def _of_path(path: Path) -> tuple[Scenario, bytes | None]:
    """Return the scenario of whatever names a city, and the city file, if it had to be made of a map."""
    kind = kind_of(path)
    if kind == "scenario":
        return load_scenario(path), None
    if kind == "city file":
        return _plain({"file": str(path.absolute())}, source=str(path)), None
    files = find_files(path)
    imported = import_files(files)
    content = city_text(files, imported).encode()
    plan = parse_plan(content, where=str(path), name=files.name)
    _check_burns(plan, str(path))
    digest = hashlib.sha256(content).hexdigest()
    some = plan.footprints.building_id[plan.footprints.inflammable != 0][:1].tolist()
    city = {"official": str(path.absolute()), "sha256": digest}
    document = scenario_document(files, imported, plan, fires=some, city=city)
    scenario = scenario_of({**document, "name": ""}, source=str(path), folder=None)
    return msgspec.structs.replace(scenario, city=msgspec.structs.replace(scenario.city, sha256=None)), content


def _plain(city: Mapping[str, Any], *, source: str = "Scenario") -> Scenario:
    """Return a scenario of fireworld's own in a city: four brigades, which start at the refuges."""
    return scenario_of({"city": city, "fires": ANYWHERE, "steps": STEPS}, source=source, folder=None)


def _check_burns(plan: Plan, source: str) -> None:
    if not plan.footprints.inflammable.any():
        raise ScenarioError(expected(source, "city", "buildings that can burn", "none"))
