"""Reading an extract with pyosmium: the ways, relations and nodes that make a city, as plain values."""

from __future__ import annotations

import importlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from fireworld.city.formats.osm.projection import UNITS_PER_DEGREE, Place
from fireworld.errors import CityError, expected
from fireworld.files import irregular

Window = tuple[int, int, int, int]
"""West, south, east, north in units of 1e-7 degrees."""

FORMATS: Final[Mapping[str, str]] = {
    ".osm": "osm", ".osm.gz": "osm.gz", ".osm.bz2": "osm.bz2", ".pbf": "pbf", ".osm.xml": "osm",
}  # fmt: skip
FILE_BYTES_MAX: Final = 4_000_000_000
N_BUILDINGS_MAX: Final = 500_000
N_WAYS_MAX: Final = 2_000_000
TAGS: Final = (
    "access", "amenity", "area", "building", "building:levels", "building:material", "building:part", "emergency",
    "height", "highway", "indoor", "layer", "location", "tunnel", "type",
)  # fmt: skip
"""Keys that anything is read from."""
STREETS: Final = frozenset({
    "motorway", "motorway_link", "trunk", "trunk_link", "primary", "primary_link", "secondary", "secondary_link",
    "tertiary", "tertiary_link", "unclassified", "residential", "living_street", "service", "pedestrian", "road",
    "track", "busway",
})  # fmt: skip
"""What a fire engine drives on, by the tag `highway`."""
_MISSING: Final = "OpenStreetMap: pyosmium, which reads extracts, is not installed; try pip install 'fireworld[osm]'"
_NO_VERSION: Final = "without version"


@dataclass(frozen=True)
class OsmWay:
    """A way: its nodes, and where they are; None for nodes that are not in the file."""

    osm_id: int
    tags: Mapping[str, str]
    nodes: tuple[int, ...]
    places: tuple[Place | None, ...]


@dataclass(frozen=True)
class OsmRelation:
    """A relation: its members as (type, id, role)."""

    osm_id: int
    tags: Mapping[str, str]
    members: tuple[tuple[str, int, str], ...]


@dataclass(frozen=True)
class OsmNode:
    """A node with tags."""

    osm_id: int
    tags: Mapping[str, str]
    place: Place


@dataclass
class Extract:
    """What a window of an extract holds."""

    buildings: list[OsmWay] = field(default_factory=list)
    relations: list[OsmRelation] = field(default_factory=list)
    members: dict[int, OsmWay] = field(default_factory=dict)
    """Ways that relations are made of, by id."""
    streets: list[OsmWay] = field(default_factory=list)
    stations: list[OsmWay | OsmRelation | OsmNode] = field(default_factory=list)
    hydrants: list[OsmNode] = field(default_factory=list)
    n_parts: int = 0
    n_point_buildings: int = 0


class OsmFile:
    """A file of OpenStreetMap data.

    Raises:
        CityError: pyosmium is missing, the file cannot be read, or it is of another kind; also from all methods.
    """

    def __init__(self, path: Path) -> None:
        self.where = str(path)
        name = path.name.lower()
        ending = next((one for one in sorted(FORMATS, key=len, reverse=True) if name.endswith(one)), None)
        if ending is None:
            wanted = f"a file ending in {', '.join(FORMATS)}"
            raise CityError(expected(self.where, "", wanted, path.suffix or "no ending"))
        try:
            n_bytes = path.stat().st_size
            if irregular(path):
                raise CityError(expected(self.where, "", "a file of OpenStreetMap data", irregular(path)))
            with path.open("rb") as file:
                file.read(1)
        except OSError as error:
            got = error.strerror or str(error)
            raise CityError(expected(self.where, "", "a file of OpenStreetMap data", got)) from None
        if n_bytes > FILE_BYTES_MAX:
            hint = "try to cut out a part, as with `osmium extract`"
            raise CityError(expected(self.where, "", f"at most {FILE_BYTES_MAX} bytes", f"{n_bytes} bytes", hint))
        self.name, self.stem = path.name, path.name[: -len(ending)].removesuffix(".osm") or "city"
        self._osmium = _pyosmium()
        self._input: Any = self._osmium.io.File(str(path), FORMATS[ending])
        self.header_window = self._read_header(path, ending)

    def _read_header(self, path: Path, ending: str) -> Window | None:
        """Return the bounds that the file names; a file of the time before versions were said is read as one of now."""
        try:
            return self._header_window()
        except self._faults as error:
            if _NO_VERSION not in str(error) or ending != ".osm":
                raise self._complaint(error) from None
        content = path.read_bytes().replace(b"<osm>", b'<osm version="0.6">', 1)
        self._input = self._osmium.io.FileBuffer(content, "osm")
        try:
            return self._header_window()
        except self._faults as error:
            raise self._complaint(error) from None

    @property
    def _faults(self) -> tuple[type[Exception], ...]:
        """What pyosmium raises for files that make no sense."""
        return (RuntimeError, ValueError, UnicodeDecodeError, self._osmium.InvalidLocationError)

    def _header_window(self) -> Window | None:
        reader = self._osmium.io.Reader(self._input, self._osmium.osm.NOTHING)
        try:
            box = reader.header().box()
        finally:
            reader.close()
        if not box.valid():
            return None
        low, high = box.bottom_left, box.top_right
        return low.x, low.y, high.x, high.y

    def window(self) -> Window:
        """Return the bounds of the extract: those that it names, else those of its nodes."""
        if self.header_window is not None:
            return self.header_window
        places = [(one.location.x, one.location.y) for one in self._objects("NODE") if one.location.valid()]
        if not places:
            raise CityError(expected(self.where, "", "OpenStreetMap data with nodes", "none of them"))
        xs, ys = [x for x, _ in places], [y for _, y in places]
        return min(xs), min(ys), max(xs), max(ys)

    def read(self, window: Window) -> Extract:
        """Read what a city is made of, as far as it may be in a window."""
        found = Extract()
        for one in self._objects("RELATION", "building", "building:part", "amenity"):
            self._take_relation(found, one)
        for one in self._objects("NODE|WAY", "building", "building:part", "highway", "emergency", "amenity"):
            if one.is_node():
                _take_node(found, one, window)
            else:
                self._take_way(found, one, window)
        wanted = {ref for relation in found.relations for kind, ref, _ in relation.members if kind == "w"}
        wanted |= {ref for one in found.stations if isinstance(one, OsmRelation) for kind, ref, _ in one.members
                   if kind == "w"}  # fmt: skip
        if wanted:
            for one in self._objects("NODE|WAY", ids=wanted):
                found.members[one.id] = self._way(one)
        found.relations = [one for one in found.relations if _near(one, found.members, window)]
        return found

    def _objects(self, kinds: str, *keys: str, ids: set[int] | None = None) -> Iterator[Any]:
        """Yield the objects of some kinds that have one of the keys, or are ways of these ids."""
        osmium = self._osmium
        entities = osmium.osm.NOTHING
        for kind in kinds.split("|"):
            entities |= getattr(osmium.osm, kind)
        try:
            objects = osmium.FileProcessor(self._input, entities)
            if "WAY" in kinds:
                objects = objects.with_locations()
            if keys:
                objects = objects.with_filter(osmium.filter.KeyFilter(*keys))
            if ids is not None:
                objects = objects.with_filter(osmium.filter.EntityFilter(osmium.osm.WAY))
                objects = objects.with_filter(osmium.filter.IdFilter(ids))
            for one in objects:
                if one.visible:
                    yield one
        except self._faults as error:
            raise self._complaint(error) from None

    def _complaint(self, error: Exception) -> CityError:
        return CityError(expected(self.where, "", "OpenStreetMap data", str(error) or type(error).__name__))

    def _take_relation(self, found: Extract, relation: Any) -> None:
        """Keep a relation that is a building or a fire station."""
        tags = _tags(relation)
        if not _is_building(tags):
            found.n_parts += "building:part" in tags
            if tags.get("amenity") == "fire_station":
                found.stations.append(self._relation(relation, tags))
        elif tags.get("type") == "multipolygon":
            found.relations.append(self._relation(relation, tags))

    def _take_way(self, found: Extract, way: Any, window: Window) -> None:
        """Keep a way that is a building, a street or a fire station and may be in the window."""
        tags = _tags(way)
        building, street = _is_building(tags), tags.get("highway") in STREETS
        station = tags.get("amenity") == "fire_station"
        if not building and not street and not station:
            found.n_parts += "building:part" in tags and _overlaps(self._way(way), window)
            return
        made = self._way(way, tags)
        if not _overlaps(made, window):
            return
        if building:
            found.buildings.append(made)
            if len(found.buildings) > N_BUILDINGS_MAX:
                self._too_many("buildings", N_BUILDINGS_MAX)
        elif street:
            found.streets.append(made)
            if len(found.streets) > N_WAYS_MAX:
                self._too_many("streets", N_WAYS_MAX)
        else:
            found.stations.append(made)

    def _too_many(self, what: str, most: int) -> None:
        raise CityError(expected(self.where, "", f"at most {most} {what}", "more of them", "try a smaller --radius"))

    def _way(self, way: Any, tags: Mapping[str, str] | None = None) -> OsmWay:
        places = tuple((one.location.x, one.location.y) if one.location.valid() else None for one in way.nodes)
        nodes = tuple(one.ref for one in way.nodes)
        return OsmWay(way.id, _tags(way) if tags is None else tags, nodes, places)

    def _relation(self, relation: Any, tags: Mapping[str, str]) -> OsmRelation:
        members = tuple((one.type, one.ref, one.role) for one in relation.members)
        return OsmRelation(relation.id, tags, members)


def _pyosmium() -> Any:
    """Import pyosmium."""
    try:
        return importlib.import_module("osmium")
    except ImportError:
        raise CityError(_MISSING) from None


def _tags(one: Any) -> dict[str, str]:
    """Return the tags of an object that anything is read from."""
    found = {key: one.tags.get(key) for key in TAGS}
    return {key: text for key, text in found.items() if text is not None}


def _is_building(tags: Mapping[str, str]) -> bool:
    return tags.get("building", "no") not in {"no", "entrance"}


def _take_node(found: Extract, node: Any, window: Window) -> None:
    """Keep a node that is a hydrant or a fire station."""
    if not node.location.valid():
        return
    place = node.location.x, node.location.y
    if not (window[0] <= place[0] <= window[2] and window[1] <= place[1] <= window[3]):
        return
    tags = _tags(node)
    made = OsmNode(node.id, tags, place)
    found.n_point_buildings += _is_building(tags)
    if tags.get("emergency") == "fire_hydrant":
        found.hydrants.append(made)
    elif tags.get("amenity") == "fire_station":
        found.stations.append(made)


def _near(relation: OsmRelation, members: Mapping[int, OsmWay], window: Window) -> bool:
    """Return whether a way of a relation touches the window."""
    ways = (members[ref] for kind, ref, _ in relation.members if kind == "w" and ref in members)
    return any(_overlaps(way, window) for way in ways)


def _overlaps(way: OsmWay, window: Window) -> bool:
    """Return whether the box of a way touches the window."""
    places = [place for place in way.places if place is not None]
    if not places:
        return False
    xs, ys = [x for x, _ in places], [y for _, y in places]
    return min(xs) <= window[2] and max(xs) >= window[0] and min(ys) <= window[3] and max(ys) >= window[1]


def degrees(units: int) -> float:
    """Return units of 1e-7 degrees as degrees."""
    return units / UNITS_PER_DEGREE
