"""City: the read-only arrays of a city, built once and shared by every world that runs in it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from fireworld.errors import one_line

Float64Array = NDArray[np.float64]
Float32Array = NDArray[np.float32]
Int64Array = NDArray[np.int64]
Int32Array = NDArray[np.int32]
UInt8Array = NDArray[np.uint8]
Array = NDArray[Any]
T = TypeVar("T")

ATTRIBUTION_MAX = 200
"""Letters of an attribution that are recorded and shown."""


@dataclass(frozen=True)
class Footprints:
    """The n buildings of a map. Lengths in whole millimetres, as in official files."""

    building_id: Int64Array  # (n,)
    refuge: UInt8Array  # (n,) 1 where tanks are refilled
    outline_ptr: Int32Array  # (n+1,) start of each building's corners
    outline_mm: Int32Array  # (corners, 2) x, y, as listed: corners may be repeated, and the first one at the end
    centroid_mm: Int32Array  # (n, 2)
    floors: Int32Array  # (n,)
    material: UInt8Array  # (n,) 0 wood, 1 steel, 2 concrete
    ground_area_m2: Float32Array  # (n,)
    inflammable: UInt8Array  # (n,)


@dataclass(frozen=True)
class StreetMap:
    """The streets of a map: a graph with m nodes and k streets."""

    node_mm: Int32Array  # (m, 2)
    street: Int32Array  # (k, 2) the two nodes of each street; straight between them
    hydrant_node: Int32Array  # (h,) nodes with a hydrant
    entrance_node: Int32Array = field(default_factory=lambda: np.zeros(0, dtype=np.int32))
    """(n,) the node where each building is entered; -1, or empty for all: the nearest point of any street."""


@dataclass(frozen=True)
class RoadMap:
    """Roads as official maps have them: r areas, and the p edges by which one gets from an area into another.

    Nodes of the streets that are made of it: the r centroids, then the middles of the passages (`city.roads`).
    """

    road_id: Int64Array  # (r,)
    outline_ptr: Int32Array  # (r+1,) start of each road's corners
    outline_mm: Int32Array  # (corners, 2) as listed
    centroid_mm: Int32Array  # (r, 2)
    passage_area: Int64Array  # (p, 2) ids of the two areas, roads before buildings
    passage_mm: Int32Array  # (p, 4) x1, y1, x2, y2 of the edge between them; a point where they only touch


@dataclass(frozen=True)
class Plan:
    """A city as drawn: what a generator makes and a city file holds. `build_city` turns it into a City."""

    name: str
    footprints: Footprints
    streets: StreetMap
    roads: RoadMap | None = None
    """What the streets were made of, where they come from an official map."""
    kind: UInt8Array | None = None
    """(n,) index of each building's type in `json_plan.BUILDING_TYPES`; None: refuges and plain buildings."""
    links: Links | None = None
    """Radiation links measured elsewhere; None: rays are sent."""
    source_id: tuple[str, ...] = ()
    """What each building is called in its source, n texts; empty where they have no such names."""
    source: Mapping[str, Any] | None = None
    """Where it comes from: anything that JSON can hold. Nothing is computed from it."""
    notes: tuple[str, ...] = ()
    """What whoever reads the map should know of it, a sentence each; nothing is computed from them."""

    @property
    def attribution(self) -> str:
        """Whom the map is by, to be named wherever it is shown: `attribution` of its source; "" where there is none."""
        said = (self.source or {}).get("attribution")
        return one_line(said)[:ATTRIBUTION_MAX] if isinstance(said, str) else ""


@dataclass(frozen=True)
class AirCells:
    """The air grid and how much of which cell each building covers (CSR over buildings)."""

    origin_mm: tuple[int, int]
    cell_mm: int
    shape: tuple[int, int]  # cells along x, along y
    ptr: Int32Array  # (n+1,)
    x: Int32Array  # (covers,) x outer, y inner within a building
    y: Int32Array  # (covers,)
    percent: Int32Array  # (covers,) 1..100


@dataclass(frozen=True)
class Links:
    """A relation between buildings as CSR; neighbours in rising order."""

    ptr: Int32Array  # (n+1,)
    building: Int32Array  # (links,)
    share: Float32Array  # (links,) radiation: share of the rays; neighbourhood: all 1


@dataclass(frozen=True)
class Streets:
    """The street graph ready for driving, all in whole millimetres; ways are looked for when somebody drives them.

    A building is reached from the point of a street that is nearest to its centroid.
    """

    node_mm: Int32Array  # (m, 2)
    street: Int32Array  # (k, 2)
    street_length_mm: Int64Array  # (k,) at least 1
    hydrant_node: Int32Array  # (h,)
    access_street: Int32Array  # (n,) street from which each building is reached
    access_offset_mm: Int64Array  # (n,) way from that street's first node to the access point
    access_mm: Int32Array  # (n, 2) the access point


@dataclass(frozen=True)
class City:
    """A city ready to burn: n buildings with their physics, air cells, radiation links and streets."""

    name: str
    footprints: Footprints
    volume_m3: Float32Array  # (n,)
    heat_capacity: Float32Array  # (n,) energy per degree
    initial_fuel: Float32Array  # (n,) energy
    ignition_point: Float32Array  # (n,) degrees above ambient
    wall_area_m2: Float64Array  # (n,) without the wall from the last corner listed to the first
    order: Int32Array  # (n,) in which the official program visits the buildings
    air: AirCells
    links: Links
    near: Links  # pairs of one fire site: linked in either direction or outlines closer than 30 m
    streets: Streets
    attribution: str = ""
    """Whom its map is by, to be named wherever it is shown."""

    @property
    def n_buildings(self) -> int:
        """Number of buildings."""
        return len(self.footprints.building_id)

    @property
    def middle_mm(self) -> tuple[float, float]:
        """Centre of the bounding box of all buildings, x and y."""
        low, high = self.footprints.outline_mm.min(axis=0), self.footprints.outline_mm.max(axis=0)
        return (int(low[0]) + int(high[0])) / 2, (int(low[1]) + int(high[1])) / 2

    @property
    def half_diagonal_mm(self) -> float:
        """Half the diagonal of the bounding box of all buildings."""
        low, high = self.footprints.outline_mm.min(axis=0), self.footprints.outline_mm.max(axis=0)
        width, height = int(high[0]) - int(low[0]), int(high[1]) - int(low[1])
        return float(np.sqrt(float(width * width + height * height))) / 2


def freeze(value: T) -> T:
    """Make every array in a dataclass, and in the dataclasses in it, read-only; return the same object."""
    if isinstance(value, np.ndarray):
        value.setflags(write=False)
    elif is_dataclass(value):
        for item in fields(value):
            freeze(getattr(value, item.name))
    return value
