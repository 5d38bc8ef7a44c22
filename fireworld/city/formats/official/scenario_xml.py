"""scenario.xml: who and what is where, by the ids of buildings and roads."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Final

from fireworld.city.formats.json_plan import ID_MAX
from fireworld.city.formats.official.xml_stream import Attributes, XmlStream
from fireworld.errors import CityError, expected, nearest

SCENARIO: Final = "urn:roborescue:map:scenario"
ROOT: Final = f"{SCENARIO} scenario"
LOCATION: Final = f"{SCENARIO} location"
BUILDING_KINDS: Final = ("refuge", "gasstation", "firestation", "policeoffice", "ambulancecentre")
"""What is made of plain buildings."""
PEOPLE: Final = ("civilian", "firebrigade", "policeforce", "ambulanceteam")
ON_BUILDINGS: Final = frozenset({*BUILDING_KINDS, "fire"})
KINDS: Final = (*BUILDING_KINDS, "hydrant", "fire", *PEOPLE)
AFTERSHOCK: Final = "aftershock"
UNKNOWN_SHOWN_MAX: Final = 5


@dataclass
class ScenarioXml:
    """The elements of a scenario.xml: for each kind the ids of their places, in the order of the file."""

    where: str
    at: dict[str, list[int]] = field(default_factory=lambda: {kind: [] for kind in KINDS})
    n_aftershocks: int = 0

    @property
    def n_people(self) -> int:
        """How many people there are, of all kinds."""
        return sum(len(self.at[kind]) for kind in PEOPLE)


def read_scenario_xml(content: bytes, *, where: str) -> ScenarioXml:
    """Read the content of a scenario.xml.

    Raises:
        CityError: which begins with `where` and names the line: no XML, another root, an element that nobody knows.
    """
    stream, found = XmlStream(where), ScenarioXml(where)

    def start(name: str, attributes: Attributes) -> None:
        namespace, _, kind = name.rpartition(" ")
        if namespace == SCENARIO and kind == AFTERSHOCK:
            found.n_aftershocks += 1
        elif namespace == SCENARIO and kind in found.at:
            text = attributes.get(LOCATION, attributes.get("location"))
            found.at[kind].append(stream.whole(kind, "location", text, high=ID_MAX))
        else:
            wanted = f"one of the elements {', '.join((*KINDS, AFTERSHOCK))}"
            stream.refuse("", wanted, kind, nearest(kind, [*KINDS, AFTERSHOCK]))

    stream.read(content, root=ROOT, what="a scenario of the official program", started=start)
    return found


def check_places(found: ScenarioXml, *, buildings: Collection[int], roads: Collection[int]) -> None:
    """Raise CityError for a place that is not on the map, or no building (or road) where one is needed."""
    for kind, places in found.at.items():
        if kind in ON_BUILDINGS:
            known, wanted = [buildings], "ids of buildings of the map"
        elif kind == "hydrant":
            known, wanted = [buildings, roads], "ids of roads of the map"
        else:
            known, wanted = [buildings, roads], "ids of buildings and roads of the map"
        unknown = [place for place in dict.fromkeys(places) if not any(place in ids for ids in known)]
        if unknown:
            shown = ", ".join(str(place) for place in unknown[:UNKNOWN_SHOWN_MAX])
            raise CityError(expected(found.where, kind, wanted, f"unknown ids: {shown}"))
