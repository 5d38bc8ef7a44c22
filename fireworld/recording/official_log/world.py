"""The state that an official log has, carried forward from step to step, and its records."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from fireworld import scores
from fireworld.errors import LogError, expected
from fireworld.events import (
    BRIGADE_DIED,
    BRIGADE_HURT,
    CIVILIAN_DIED,
    CIVILIAN_HURT,
    FIRE_EVENTS,
    TANK_EMPTY,
    fire_event,
    zero_against_more,
)
from fireworld.recording.official_log import names
from fireworld.recording.official_log.city import FULL_HP, Cast
from fireworld.recording.official_log.parts import Entity
from fireworld.records import (
    FIERYNESS,
    Array,
    Brigades,
    Buildings,
    Civilians,
    Decisions,
    Draws,
    Events,
    Observations,
    Rewards,
    Score,
    StepRecord,
)

NOT_RECORDED: Final = (
    "city.volume_m3", "city.initial_fuel", "city.heat_capacity", "city.ignition_point", "city.wall_area_m2",
    "city.link_ptr", "city.link_building", "city.link_share", "city.air_origin_x_m", "city.air_origin_y_m",
    "city.air_cell_m", "city.air_nx", "city.air_ny", "draws", "observations", "decisions", "brigades.activity",
    "brigades.sprayed_litres", "brigades.driven_m", "buildings.energy", "buildings.fuel_share",
    "buildings.water_litres", "rewards", "score.water_used_litres", "snapshot",
)  # fmt: skip
"""What no official log has."""

_BURNING: Final = (1, 2, 3)
_BURNT_OUT: Final = 8
_NONE: Final = np.zeros(0)
_NO_DRAWS: Final = Draws(0, 0.0, 0.0)
_NOTHING_SEEN: Final = Observations(*[_NONE] * 18)
_NOTHING_CHOSEN: Final = Decisions(_NONE, _NONE, _NONE, _NONE, 0.0, _NONE)
_NO_REWARDS: Final = Rewards(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
"""Parts of a step that a log does not have; nothing of them is written."""


class _People:
    """Some people of one kind, as arrays in their order."""

    def __init__(self, people: Sequence[Entity]) -> None:
        n = len(people)
        self.index = {one.id: k for k, one in enumerate(people)}
        self.hp = np.zeros(n, dtype=np.int32)
        self.damage = np.zeros(n, dtype=np.float64)
        self.buriedness = np.zeros(n, dtype=np.int32)
        self.water = np.zeros(n, dtype=np.int32)
        for one in people:
            if one.properties.get(names.HP) is None:
                raise LogError(expected(f"{names.ENTITIES[one.kind]} {one.id}", "hp", "health points", "none of them"))
        self.ids = [one.id for one in people]

    def take(self, entity: Entity) -> None:
        """Take the properties of one of them that are given."""
        k = self.index[entity.id]
        columns = ((names.HP, self.hp), (names.DAMAGE, self.damage), (names.BURIEDNESS, self.buriedness),
                   (names.WATER, self.water))  # fmt: skip
        for name, column in columns:
            if (value := entity.properties.get(name)) is not None:
                column[k] = _whole(entity, name, value, low=0)


class World:
    """What is known of a run after the last step that was taken.

    Args:
        entities: all of the start.
        cast: those that are recorded.
    """

    def __init__(self, entities: Sequence[Entity], cast: Cast) -> None:
        self.step = 0
        self._building = {one.id: k for k, one in enumerate(cast.buildings)}
        n = len(cast.buildings)
        self.fieryness = np.zeros(n, dtype=np.uint8)
        self.temperature = np.zeros(n, dtype=np.float32)
        self.people = {names.CIVILIAN: _People(cast.civilians), names.FIRE_BRIGADE: _People(cast.brigades)}
        self._middle = {one.id: _xy(one) for one in entities if one.kind in names.BUILDINGS | names.AREAS}
        self._place: dict[int, tuple[int, int] | None] = {}
        self._inside: dict[int, int] = {}
        self._floor_area = np.array([_floor_area(one) for one in cast.buildings], dtype=np.float64)
        for entity in entities:
            self._take(entity)
        self._before = self._watched()

    def take(self, time: int, changes: Sequence[Entity]) -> None:
        """Take the changes of a step.

        Raises:
            LogError: steps do not rise, or a number makes no sense.
        """
        if not self.step < time < 2**31:
            raise LogError(expected("updates", "time", f"a step after {self.step}", time))
        self._before = self._watched()
        self.step = time
        try:
            for entity in changes:
                self._take(entity)
        except LogError as error:
            raise LogError(f"step {time}: {error}") from None

    def civilians(self) -> dict[str, Array]:
        """Return where the civilians are: the fields x_m, y_m, in_building."""
        ids = self.people[names.CIVILIAN].ids
        inside = [self._building.get(self._inside.get(one, 0), -1) for one in ids]
        return {**self._positions(ids), "in_building": np.array(inside, dtype=np.int32)}

    def record(self, *, truncated: bool) -> StepRecord:
        """Return the step as it is recorded; `truncated`: whether it is the last one."""
        civilians, brigades = self.people[names.CIVILIAN], self.people[names.FIRE_BRIGADE]
        return StepRecord(
            step=self.step,
            draws=_NO_DRAWS,
            observations=_NOTHING_SEEN,
            decisions=_NOTHING_CHOSEN,
            brigades=Brigades(
                **self._positions(brigades.ids),
                activity=_NONE,
                tank_litres=brigades.water.copy(),
                sprayed_litres=_NONE,
                driven_m=_NONE,
                hp=brigades.hp.copy(),
                damage=brigades.damage.copy(),
            ),
            buildings=Buildings(
                temperature=self.temperature.copy(),
                energy=_NONE,
                fuel_share=_NONE,
                water_litres=_NONE,
                fieryness=self.fieryness.copy(),
            ),
            civilians=Civilians(
                hp=civilians.hp.copy(),
                damage=civilians.damage.copy(),
                **self.civilians(),
                buriedness=civilians.buriedness.copy(),
            ),
            rewards=_NO_REWARDS,
            score=self._score(),
            events=self._events(),
            terminated=False,  # an official kernel does not end because nothing burns
            truncated=truncated,
        )

    def _take(self, entity: Entity) -> None:
        """Take the properties of an entity that are given."""
        given = entity.properties
        if entity.id in self._building:
            k = self._building[entity.id]
            if (code := given.get(names.FIERYNESS)) is not None:
                self.fieryness[k] = _whole(entity, names.FIERYNESS, code, low=0, high=len(FIERYNESS) - 1)
            if (degrees := given.get(names.TEMPERATURE)) is not None:
                self.temperature[k] = _whole(entity, names.TEMPERATURE, degrees)
        elif entity.kind in names.PEOPLE:
            if (place := _xy(entity)) is not None:
                self._place[entity.id] = place
            if isinstance(where := given.get(names.POSITION), int):
                self._inside[entity.id] = where
                if place is None:  # carried by another, or only said to be in an area
                    self._place[entity.id] = None
            people = self.people.get(entity.kind)
            if people is not None and entity.id in people.index:
                people.take(entity)

    def _positions(self, ids: Sequence[int]) -> dict[str, Array]:
        """Return where people are, in metres."""
        points = np.array([self._point(one) for one in ids], dtype=np.float64).reshape(-1, 2) / 1000.0
        return {"x_m": points[:, 0].copy(), "y_m": points[:, 1].copy()}

    def _point(self, person: int) -> tuple[int, int]:
        """Return where a person is, in mm; of one who is carried, where the carrier is."""
        for _ in range(3):
            place = self._place.get(person)
            if place is not None:
                return place
            where = self._inside.get(person, 0)
            if (middle := self._middle.get(where)) is not None:
                return middle
            person = where
        raise LogError(expected(f"step {self.step}", f"person {person}", "a position", "no position"))

    def _watched(self) -> dict[str, Array]:
        """Return copies of what events follow from."""
        arrays = {"fieryness": self.fieryness}
        for kind, people in self.people.items():
            arrays |= {f"{kind}.{name}": getattr(people, name) for name in ("hp", "damage", "water")}
        return {name: array.copy() for name, array in arrays.items()}

    def _events(self) -> Events:
        """Return what happened in the step, as far as it can be seen in a log."""
        if self.step == 0:
            return _events_of([])
        before, now = self._before, self._watched()
        tank = f"{names.FIRE_BRIGADE}.water"
        found = [(TANK_EMPTY, zero_against_more(now[tank], before[tank]).nonzero()[0])]
        found += _fire_events(before["fieryness"], now["fieryness"])
        people = ((names.CIVILIAN, CIVILIAN_HURT, CIVILIAN_DIED), (names.FIRE_BRIGADE, BRIGADE_HURT, BRIGADE_DIED))
        for kind, hurt, died in people:
            damage, hp = f"{kind}.damage", f"{kind}.hp"
            found.append((hurt, zero_against_more(before[damage], now[damage]).nonzero()[0]))
            found.append((died, zero_against_more(now[hp], before[hp]).nonzero()[0]))
        return _events_of(found)

    def _score(self) -> Score:
        """Return both scores and the counts, by the rules of the model, section 6."""
        code, hp = self.fieryness, self.people[names.CIVILIAN].hp
        n, n_alive = len(hp), int(np.count_nonzero(hp > 0))
        healthy = int(hp.sum(dtype=np.int64)) / (n * FULL_HP) if n else 1.0
        saved, area = total(self._floor_area * np.array(scores.SAVED)[code]), total(self._floor_area)
        return Score(
            score=scores.paper_score(n_alive, healthy, saved, area) if area else 0.0,
            score_max=n + 1.0,
            score_now=n_alive * scores.exp_of_minus(scores.unhealth(healthy)),
            n_burning=int(np.isin(code, _BURNING).sum()),
            n_water_damaged=int(((code > _BURNING[-1]) & (code < _BURNT_OUT)).sum()),
            n_burnt_out=int((code == _BURNT_OUT).sum()),
            n_civilians_alive=n_alive,
            water_used_litres=0.0,
        )


def _fire_events(before: Array, code: Array) -> list[tuple[int, Sequence[int]]]:
    """Return what happened to buildings, by kind; `before`, `code`: (n,) fieryness."""
    changed = (code != before).nonzero()[0].tolist()
    events = {building: fire_event(int(before[building]), int(code[building])) for building in changed}
    return [(kind, [building for building, event in events.items() if event == kind]) for kind in FIRE_EVENTS]


def _events_of(found: Sequence[tuple[int, Sequence[int]]]) -> Events:
    """Return events by kind and entity as they are recorded, in the order given."""
    kinds = [kind for kind, entities in found for _ in entities]
    return Events(
        kind=np.array(kinds, dtype=np.uint8),
        entity=np.array([entity for _, entities in found for entity in entities], dtype=np.int32),
    )


def _floor_area(building: Entity) -> float:
    """Return the floor area by which the model's score goes: ground area x floors."""
    ground, floors = (building.properties.get(name) for name in (names.GROUND_AREA, names.FLOORS))
    return float(ground * floors) if isinstance(ground, int) and isinstance(floors, int) else 0.0


def total(numbers: Array) -> float:
    """Return a sum of doubles, added one after another as the kernels do: the same on every processor."""
    return float(np.add.accumulate(numbers)[-1]) if len(numbers) else 0.0


def _xy(entity: Entity) -> tuple[int, int] | None:
    x, y = (entity.properties.get(axis) for axis in (names.X, names.Y))
    if x is None or y is None:
        return None
    return _whole(entity, names.X, x), _whole(entity, names.Y, y)


def _whole(entity: Entity, name: int, value: Any, *, low: int = -(10**9), high: int = 10**9) -> int:
    """Return a number of an entity; LogError if it makes no sense."""
    if not isinstance(value, int) or not low <= value <= high:
        where = f"{names.ENTITIES[entity.kind]} {entity.id}"
        raise LogError(expected(where, names.PROPERTIES[name], f"a number from {low} to {high}", value))
    return value


def settings_text(settings: Mapping[str, str], prefixes: Sequence[str]) -> bytes:
    """Return what a configuration says of the model, as a file of keys and values; no paths, no names of machines."""
    kept = {key: text for key, text in settings.items() if key.startswith(tuple(prefixes)) and "/" not in text}
    return "".join(f"{key} : {kept[key]}\n" for key in sorted(kept) if "\n" not in key + kept[key]).encode()
