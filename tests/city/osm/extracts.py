"""Made-up extracts: written as OpenStreetMap XML, in metres around a place of nobody's."""

from __future__ import annotations

import math
from pathlib import Path
from xml.sax.saxutils import quoteattr

from fireworld.city.formats.osm.projection import Projection

LATITUDE, LONGITUDE = 48.5, -31.25  # in the Atlantic
MIDDLE = Projection(485_000_000, -312_500_000)


def place_of(x_m: float, y_m: float) -> tuple[float, float]:
    """Latitude and longitude of a place, seven digits: to a centimetre where it should be."""
    sin2 = math.sin(math.radians(LATITUDE)) ** 2
    e2 = 0.00669437999
    meridian = 6_378_137 * (1 - e2) / (1 - e2 * sin2) ** 1.5
    latitude = LATITUDE + math.degrees(y_m / meridian)
    sin2 = math.sin(math.radians(latitude)) ** 2
    parallel = 6_378_137 / math.sqrt(1 - e2 * sin2) * math.cos(math.radians(latitude))
    return round(latitude, 7), round(LONGITUDE + math.degrees(x_m / parallel), 7)


class Drawing:
    """An extract that grows: nodes, ways and relations, all by ids of their own."""

    def __init__(self, *, bounds_m: float | None = 300.0) -> None:
        self._bounds_m = bounds_m
        self._parts: dict[str, list[str]] = {"node": [], "way": [], "relation": []}
        self._at: dict[tuple[float, float], int] = {}
        self._next = 5_000_000_000  # more than 32 bits hold

    def node(self, x_m: float, y_m: float, *, new: bool = False, **tags: str) -> int:
        """Add a node, or return the one that is there."""
        if (x_m, y_m) in self._at and not new and not tags:
            return self._at[x_m, y_m]
        self._next += 1
        latitude, longitude = place_of(x_m, y_m)
        self._at[x_m, y_m] = self._next
        self._add("node", self._next, f'lat="{latitude:.7f}" lon="{longitude:.7f}"', "", tags)
        return self._next

    def way(self, *corners: tuple[float, float] | int, osm_id: int | None = None, **tags: str) -> int:
        """Add a way along places in metres; a number is a node that is not in the extract."""
        nodes = [self.node(*one) if isinstance(one, tuple) else one for one in corners]
        self._next += 1
        osm_id = osm_id or self._next
        self._add("way", osm_id, "", "".join(f'<nd ref="{node}"/>' for node in nodes), tags)
        return osm_id

    def ring(self, *corners: tuple[float, float], osm_id: int | None = None, **tags: str) -> int:
        """Add a closed way."""
        return self.way(*corners, corners[0], osm_id=osm_id, **tags)

    def box(self, west: float, south: float, east: float, north: float, osm_id: int | None = None, **tags: str) -> int:
        """Add a rectangle, a building unless tags say otherwise."""
        corners = ((west, south), (east, south), (east, north), (west, north))
        return self.ring(*corners, osm_id=osm_id, **(tags or {"building": "yes"}))

    def relation(self, members: list[tuple[int, str]], osm_id: int | None = None, **tags: str) -> int:
        """Add a multipolygon of ways with roles."""
        self._next += 1
        osm_id = osm_id or self._next
        inside = "".join(f'<member type="way" ref="{ref}" role="{role}"/>' for ref, role in members)
        self._add("relation", osm_id, "", inside, {"type": "multipolygon", **tags})
        return osm_id

    def _add(self, kind: str, osm_id: int, attributes: str, inside: str, tags: dict[str, str]) -> None:
        named = {key.replace("__", ":"): value for key, value in tags.items()}
        written = "".join(f"<tag k={quoteattr(key)} v={quoteattr(value)}/>" for key, value in named.items())
        self._parts[kind].append(f'<{kind} id="{osm_id}" version="1" {attributes}>{inside}{written}</{kind}>')

    @property
    def text(self) -> str:
        """The XML."""
        bounds = ""
        if self._bounds_m is not None:
            (south, west), (north, east) = (place_of(k * self._bounds_m, k * self._bounds_m) for k in (-1, 1))
            bounds = f'<bounds minlat="{south}" minlon="{west}" maxlat="{north}" maxlon="{east}"/>'
        parts = "\n".join(part for kind in self._parts.values() for part in kind)
        return f'<?xml version="1.0" encoding="UTF-8"?>\n<osm version="0.6">\n{bounds}\n{parts}\n</osm>\n'

    def write(self, path: Path) -> Path:
        """Write the extract as XML."""
        path.write_text(self.text, encoding="utf-8")
        return path


def town(n: int = 4) -> Drawing:
    """n by n houses of 12 m by 10 m, 20 m apart, with streets around each block of them, a station and a hydrant."""
    drawing = Drawing()
    half = n * 10.0
    for row in range(n):
        for column in range(n):
            west, south = column * 20 - half + 4, row * 20 - half + 5
            tags = {"building": "house", "building__levels": "2"}
            drawing.box(west, south, west + 12, south + 10, **tags)
    for k in range(n + 1):
        line = k * 20 - half
        stops = [m * 20 - half for m in range(n + 1)]
        drawing.way(*((stop, line) for stop in stops), highway="residential")
        drawing.way(*((line, stop) for stop in stops), highway="residential")
    drawing.node(4 - half + 6, 5 - half + 5, amenity="fire_station")
    drawing.node(half - 10, half - 1, emergency="fire_hydrant")
    return drawing
