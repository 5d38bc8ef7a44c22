"""What a trace's city file has of the run: fires lit, water poured, brigades and what they asked for."""

from __future__ import annotations

import json
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from fireworld.city.city import Plan
from fireworld.city.fields import Fields
from fireworld.city.formats.json_plan import COORDINATE_MAX_MM, ID_MAX, parse_plan
from fireworld.errors import CityError
from fireworld.files import read_input
from fireworld.scenario.scenario import CITY_BYTES_MAX

STEP_MAX: Final = 100_000
POURED_MAX_LITRES: Final = 1_000_000
INTEGER_MAX: Final = 2**31 - 1
NOWHERE: Final = -1


@dataclass(frozen=True)
class Placement:
    """Where a brigade is put."""

    brigade: int  # index
    x_mm: int
    y_mm: int
    refuge: int  # index of the refuge building it is at, or NOWHERE
    hydrant: int  # index of the hydrant it is at, or NOWHERE


@dataclass(frozen=True)
class Request:
    """A request to extinguish; the brigade may be one that nobody knows."""

    brigade_id: int
    target_id: int
    litres: int


@dataclass(frozen=True)
class Inputs:
    """What happens to a city from outside: mappings are by step, from 1 on, and take place before it is computed."""

    ignitions: Sequence[int]  # indices of the buildings lit before step 0 is recorded
    later_ignitions: Mapping[int, Sequence[int]]
    water: Mapping[int, Sequence[tuple[int, int]]]  # index of a building, litres
    brigade_id: Sequence[int]  # rising
    tank_litres: Sequence[int]
    start: Sequence[Placement]
    moves: Mapping[int, Sequence[Placement]]
    requests: Mapping[int, Sequence[Request]]


@dataclass(frozen=True)
class CityFile:
    """A city and what happens to it."""

    where: str
    plan: Plan
    inputs: Inputs


def load_city_file(path: Path) -> CityFile:
    """Read a city file; CityError if it makes no city, or names something that the city does not have."""
    text = read_input(path, what="a city file that can be read", n_bytes_max=CITY_BYTES_MAX, error=CityError)
    plan = parse_plan(text, where=str(path), name=path.stem)
    return CityFile(str(path), plan, _Reader(Fields(str(path), "", json.loads(text)), plan).inputs())


class _Reader:
    """Reads the inputs of one city file."""

    def __init__(self, document: Fields, plan: Plan) -> None:
        self._document = document
        footprints = plan.footprints
        self._building = {int(identifier): b for b, identifier in enumerate(footprints.building_id)}
        self._refuge = {identifier for identifier, b in self._building.items() if footprints.refuge[b]}
        hydrants = document.array("hydrants", default=[])
        self._hydrant = {hydrant["id"]: k for k, hydrant in enumerate(hydrants) if "id" in hydrant}
        self._brigade: dict[int, int] = {}

    def inputs(self) -> Inputs:
        """Read everything."""
        rows = self._rows("brigades", "id", "x", "y", "pos", "water")
        taken = [row.integer("id", low=0, high=ID_MAX) for row in rows]
        times = Counter(taken)
        for row, identifier in zip(rows, taken, strict=True):
            if times[identifier] > 1:
                row.refuse("id", "an identifier of its own", identifier)
        self._brigade = {identifier: index for index, identifier in enumerate(sorted(taken))}
        rows.sort(key=lambda row: self._brigade[row.value["id"]])
        return Inputs(
            ignitions=[self._known(self._document, f"ignitions.{k}", b) for k, b in self._array("ignitions")],
            later_ignitions=self._by_step("later_ignitions", ("id",), lambda row: self._building_of(row, "id")),
            water=self._water(),
            brigade_id=sorted(taken),
            tank_litres=[row.integer("water", low=0, high=INTEGER_MAX) for row in rows],
            start=[self._placement(row) for row in rows],
            moves=self._by_step("brigade_moves", ("id", "x", "y", "pos"), self._placement),
            requests=self._by_step("extinguish", ("brigade", "target", "litres"), self._request),
        )

    def _array(self, key: str) -> list[tuple[int, Any]]:
        """List the items of an array that may be left out, numbered."""
        return list(enumerate(self._document.array(key, default=[])))

    def _rows(self, key: str, *known: str) -> list[Fields]:
        """Read an array of objects that may be left out."""
        rows = [Fields(self._document.where, f"{key}.{k}.", item) for k, item in self._array(key)]
        for row in rows:
            row.allow_only(*known)
        return rows

    def _by_step(self, key: str, known: tuple[str, ...], read: Any) -> dict[int, list[Any]]:
        """Read an array of objects with a step `t`, in file order within a step."""
        found: dict[int, list[Any]] = defaultdict(list)
        for row in self._rows(key, "t", *known):
            found[row.integer("t", low=1, high=STEP_MAX)].append(read(row))
        return dict(found)

    def _water(self) -> dict[int, list[tuple[int, int]]]:
        """Read the rows [step, building, litres]."""
        found: dict[int, list[tuple[int, int]]] = defaultdict(list)
        for k, item in self._array("water"):
            if not isinstance(item, list) or len(item) != 3:
                self._document.refuse(f"water.{k}", "a row [step, building, litres]", item)
            row = Fields(self._document.where, f"water.{k}.", dict(zip(("t", "id", "litres"), item, strict=True)))
            litres = row.integer("litres", low=0, high=POURED_MAX_LITRES)
            found[row.integer("t", low=1, high=STEP_MAX)].append((self._building_of(row, "id"), litres))
        return dict(found)

    def _known(self, row: Fields, key: str, found: Any) -> int:
        """Return the index of a building."""
        if not isinstance(found, int) or isinstance(found, bool) or found not in self._building:
            row.refuse(key, "the id of a building of this city", found)
        return self._building[found]

    def _building_of(self, row: Fields, key: str) -> int:
        """Return the index of the building that a row names."""
        return self._known(row, key, row.get(key, None))

    def _placement(self, row: Fields) -> Placement:
        """Read where a brigade is. `pos` is a refuge, a hydrant, or any other place: null, or an id nobody knows."""
        identifier = row.integer("id", low=0, high=ID_MAX)
        if identifier not in self._brigade:
            row.refuse("id", "the id of a brigade of this city", identifier)
        place = row.get("pos", None)
        if place is not None:
            place = row.integer("pos", low=0, high=ID_MAX)
        return Placement(
            brigade=self._brigade[identifier],
            x_mm=row.integer("x", low=-COORDINATE_MAX_MM, high=COORDINATE_MAX_MM),
            y_mm=row.integer("y", low=-COORDINATE_MAX_MM, high=COORDINATE_MAX_MM),
            refuge=self._building[place] if place in self._refuge else NOWHERE,
            hydrant=self._hydrant.get(place, NOWHERE),
        )

    def _request(self, row: Fields) -> Request:
        """Read a request."""
        self._building_of(row, "target")
        return Request(
            brigade_id=row.integer("brigade", low=0, high=INTEGER_MAX),
            target_id=row.value["target"],
            litres=row.integer("litres", low=-INTEGER_MAX, high=INTEGER_MAX),
        )
