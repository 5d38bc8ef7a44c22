"""What official logs call entities and properties: numbers of two kinds, or texts; here each has one number."""

from __future__ import annotations

from typing import Final

from fireworld.errors import LogError

ROAD: Final = 2
BUILDING: Final = 4
REFUGE: Final = 5
HYDRANT: Final = 6
CIVILIAN: Final = 11
FIRE_BRIGADE: Final = 12

ENTITIES: Final = (
    "none", "world", "road", "blockade", "building", "refuge", "hydrant", "gas station", "fire station",
    "ambulance centre", "police office", "civilian", "fire brigade", "ambulance team", "police force",
)  # fmt: skip
"""Entities by their number."""

X: Final = 6
Y: Final = 7
FLOORS: Final = 10
FIERYNESS: Final = 13
BUILDING_CODE: Final = 15
GROUND_AREA: Final = 16
TOTAL_AREA: Final = 17
EDGES: Final = 19
POSITION: Final = 20
HP: Final = 24
DAMAGE: Final = 25
BURIEDNESS: Final = 26
WATER: Final = 28
TEMPERATURE: Final = 29
IMPORTANCE: Final = 30

PROPERTIES: Final = (
    "none", "start time", "longitude", "latitude", "wind force", "wind direction", "x", "y", "blockades",
    "repair cost", "floors", "building attributes", "ignition", "fieryness", "brokenness", "building code",
    "building area ground", "building area total", "apexes", "edges", "position", "direction", "position history",
    "stamina", "hp", "damage", "buriedness", "travel distance", "water quantity", "temperature", "importance",
    "capacity", "bed capacity", "occupied beds", "refill capacity", "waiting list size",
)  # fmt: skip
"""Properties by their number; the official model, of 2021 and later, has numbered them so from the start."""

READ: Final = frozenset(
    {X, Y, FLOORS, FIERYNESS, BUILDING_CODE, GROUND_AREA, TOTAL_AREA, EDGES, POSITION, HP, DAMAGE, BURIEDNESS, WATER,
     TEMPERATURE, IMPORTANCE}
)  # fmt: skip
"""Properties that are read; all others are stepped over."""

ENTITY_PREFIX: Final = 0x1100
PROPERTY_PREFIX: Final = 0x1200
"""What logs since 2022 add to the numbers."""

AREAS: Final = frozenset({ROAD, HYDRANT})
"""Entities that are driven on."""
BUILDINGS: Final = frozenset(range(BUILDING, 11)) - {HYDRANT}
"""Entities that are buildings."""
PEOPLE: Final = frozenset(range(CIVILIAN, 15))
NOT_INFLAMMABLE: Final = {
    5: "resq-fire.refuge_inflammable",
    8: "resq-fire.firestation_inflammable",
    9: "resq-fire.ambulancecenter_inflammable",
    10: "resq-fire.policeoffice_inflammable",
}
"""Buildings that do not burn unless the configuration has "true" at this key."""


def _squeezed(name: str) -> str:
    """Return the letters of a name alone, as all spellings have them."""
    return name.rpartition(":")[2].lower().replace("_", "").replace(" ", "")


_BY_NAME: Final = {
    "entity": {_squeezed(name): number for number, name in enumerate(ENTITIES)},
    "property": {_squeezed(name): number for number, name in enumerate(PROPERTIES)},
}
_PREFIXES: Final = {"entity": ENTITY_PREFIX, "property": PROPERTY_PREFIX}


def entity_number(name: int | str) -> int:
    """Return the number of an entity by whatever a log calls it: 4, 0x1104, BUILDING or urn:...:building.

    Raises:
        LogError: there is no such entity.
    """
    return _number("entity", name, len(ENTITIES))


def property_number(name: int | str) -> int:
    """Return the number of a property by whatever a log calls it; 0 for one that came later: it is not read.

    Raises:
        LogError: it is no number and no name.
    """
    return _number("property", name, None)


def _number(what: str, name: int | str, end: int | None) -> int:
    if isinstance(name, str) and not name.isdecimal():
        found = _BY_NAME[what].get(_squeezed(name), 0)
        if found == 0 and end is not None:
            raise LogError(f"{name!r} is the name of no {what}")
        return found
    number = int(name) if len(str(name)) < 10 else -1
    number -= _PREFIXES[what] if number >= _PREFIXES[what] else 0
    if number < 0 or (end is not None and not 0 < number < end):
        raise LogError(f"{name} is the number of no {what}")
    return number
