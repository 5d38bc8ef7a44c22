"""Synthetic cities: lots in blocks between streets, one building a lot, everything in whole millimetres.

Every property of a lot is a keyed draw of its column and row, so that a larger city of the same seed begins with the
same lots.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from fireworld import draws
from fireworld.city.city import Plan, StreetMap, freeze
from fireworld.city.outlines import Building, Corner, assemble, centroid_mm, doubled_area_mm2
from fireworld.errors import CityError, expected

WIDTH, DEPTH, OFFSET_X, OFFSET_Y, FLOORS, MATERIAL, SHAPE, NOTCH_WIDTH, NOTCH_DEPTH, HYDRANT = range(10)
"""What a draw is for: the last part of its key."""

FLOORS_OF_DRAW: Final = (1, 1, 2, 3)
WOOD_PERCENT: Final = 75
STEEL_PERCENT: Final = 20
L_SHAPE_ONE_IN: Final = 2
"""One building in so many is L-shaped, if what the notch leaves still fills the lot enough."""
SPAN_MAX_MM: Final = 10_000_000


@dataclass(frozen=True)
class _Layout:
    """Where lots and streets lie, mm; the south-west corner of the city is the origin."""

    lot: int
    street: int
    block: tuple[int, int]

    def lot_start(self, axis: int, index: int) -> int:
        """Return the near edge of a column (axis 0) or row (axis 1) of lots."""
        return index * self.lot + (index // self.block[axis] + 1) * self.street

    def street_middle(self, axis: int, index: int) -> int:
        """Return the middle line of a street, numbered from the near edge of the city."""
        return index * (self.block[axis] * self.lot + self.street) + self.street // 2


@dataclass(frozen=True)
class _Lot:
    """One lot, of which every property is a draw of its own."""

    layout: _Layout
    seed: int
    column: int
    row: int

    def draw(self, purpose: int, bound: int) -> int:
        """Draw a whole number in [0, bound) for one property."""
        return draws.below(self.seed, draws.CITY, _lot_key(self.column, self.row), purpose, bound=bound)

    def building(self, *, building_id: int, fill: tuple[float, float], refuge: bool) -> Building:
        """Put a building on the lot."""
        corners = self._footprint(fill)
        percent = self.draw(MATERIAL, 100)
        return Building(
            building_id=building_id,
            corners_mm=corners,
            centroid_mm=centroid_mm(corners),
            floors=FLOORS_OF_DRAW[self.draw(FLOORS, len(FLOORS_OF_DRAW))],
            material=0 if percent < WOOD_PERCENT else 1 if percent < WOOD_PERCENT + STEEL_PERCENT else 2,
            ground_area_m2=doubled_area_mm2(corners) // 2_000_000,
            inflammable=not refuge,
            refuge=refuge,
        )

    def _footprint(self, fill: tuple[float, float]) -> list[Corner]:
        """Draw an outline, counterclockwise from the south-west corner.

        Both sides lie between the roots of the shares of the lot, so their product lies between the shares.
        """
        side = self.layout.lot
        shortest = math.isqrt(round(side * side * fill[0])) + 1
        longest = max(shortest, math.isqrt(round(side * side * fill[1])))
        width = shortest + self.draw(WIDTH, longest - shortest + 1)
        depth = shortest + self.draw(DEPTH, longest - shortest + 1)
        # An edge is in the middle half of the slack, so that no two buildings ever touch.
        west = (
            self.layout.lot_start(0, self.column) + (side - width) // 4 + self.draw(OFFSET_X, (side - width) // 2 + 1)
        )
        south = self.layout.lot_start(1, self.row) + (side - depth) // 4 + self.draw(OFFSET_Y, (side - depth) // 2 + 1)
        east, north = west + width, south + depth

        shape = self.draw(SHAPE, 4 * L_SHAPE_ONE_IN)  # 0 to 3: which corner of an L-shape is missing
        notch_width = width // 4 + self.draw(NOTCH_WIDTH, width // 4)
        notch_depth = depth // 4 + self.draw(NOTCH_DEPTH, depth // 4)
        left = width * depth - notch_width * notch_depth
        if shape > 3 or left < shortest * shortest:
            return [(west, south), (east, south), (east, north), (west, north)]
        inner_x = east - notch_width if shape in {1, 2} else west + notch_width
        inner_y = north - notch_depth if shape in {2, 3} else south + notch_depth
        notches = [
            [(west, inner_y), (inner_x, inner_y), (inner_x, south)],
            [(inner_x, south), (inner_x, inner_y), (east, inner_y)],
            [(east, inner_y), (inner_x, inner_y), (inner_x, north)],
            [(inner_x, north), (inner_x, inner_y), (west, inner_y)],
        ]
        corners: list[list[Corner]] = [[(west, south)], [(east, south)], [(east, north)], [(west, north)]]
        corners[shape] = notches[shape]
        return [corner for part in corners for corner in part]


def generate_plan(
    *,
    columns: int,
    rows: int,
    seed: int,
    lot_m: float = 14.0,
    block: tuple[int, int] = (3, 2),
    street_m: float = 8.0,
    refuges: Sequence[tuple[float, float]] = ((0.15, 0.15), (0.85, 0.85)),
    fill: tuple[float, float] = (0.70, 0.97),
    hydrant_share: float = 0.0,
    name: str = "generated",
) -> Plan:
    """Make a city of columns * rows lots, of values that `GeneratedCity` allows; CityError if it is too large.

    Buildings have identifiers from 0 in row order, south-west first. Footprints are rectangles or L-shapes; floors 1,
    2, 3 come 2:1:1 and wood, steel, concrete 75:20:5, as in the official maps.
    """
    layout = _Layout(lot=round(lot_m * 1000), street=round(street_m * 1000), block=block)
    span = max(layout.lot_start(0, columns), layout.lot_start(1, rows))
    if span > SPAN_MAX_MM:
        wanted = f"a city of at most {SPAN_MAX_MM // 1000} m a side"
        raise CityError(expected(name, "columns, rows", wanted, f"{span // 1000}"))
    refuge_lots = _refuge_lots(layout, columns, rows, refuges)
    buildings = [
        _Lot(layout, seed, column, row).building(
            building_id=row * columns + column, fill=fill, refuge=(row, column) in refuge_lots
        )
        for row in range(rows)
        for column in range(columns)
    ]
    streets = _streets(layout, seed, columns, rows, hydrant_share)
    return freeze(Plan(name=name, footprints=assemble(buildings), streets=streets))


def _refuge_lots(
    layout: _Layout, columns: int, rows: int, refuges: Sequence[tuple[float, float]]
) -> set[tuple[int, int]]:
    """Find the free lot nearest to each place; ties go to the first in row order."""
    width = layout.lot_start(0, columns - 1) + layout.lot + layout.street
    height = layout.lot_start(1, rows - 1) + layout.lot + layout.street
    taken: set[tuple[int, int]] = set()
    for place in refuges:
        x, y = round(place[0] * width), round(place[1] * height)
        across = [2 * layout.lot_start(0, column) + layout.lot - 2 * x for column in range(columns)]
        along = [2 * layout.lot_start(1, row) + layout.lot - 2 * y for row in range(rows)]
        free = ((row, column) for row in range(rows) for column in range(columns) if (row, column) not in taken)
        taken.add(min(free, key=lambda lot: across[lot[1]] ** 2 + along[lot[0]] ** 2))
    return taken


def _streets(layout: _Layout, seed: int, columns: int, rows: int, hydrant_share: float) -> StreetMap:
    """Lay streets around every block, with a node at each crossing; numbered in row order."""
    across, along = -(-columns // layout.block[0]) + 1, -(-rows // layout.block[1]) + 1
    x = [layout.street_middle(0, index) for index in range(across)]
    y = [layout.street_middle(1, index) for index in range(along)]
    x[-1] = layout.lot_start(0, columns - 1) + layout.lot + layout.street // 2  # the last block may be narrower
    y[-1] = layout.lot_start(1, rows - 1) + layout.lot + layout.street // 2
    nodes = [(node_x, node_y) for node_y in y for node_x in x]
    streets = []
    for node in range(len(nodes)):
        if node % across + 1 < across:
            streets.append((node, node + 1))
        if node + across < len(nodes):
            streets.append((node, node + across))
    hydrants = [
        row * across + column
        for row in range(along)
        for column in range(across)
        if draws.uniform(seed, draws.CITY, _lot_key(column, row), HYDRANT) < hydrant_share
    ]
    return StreetMap(
        node_mm=np.array(nodes, dtype=np.int32),
        street=np.array(streets, dtype=np.int32),
        hydrant_node=np.array(hydrants, dtype=np.int32),
    )


def _lot_key(column: int, row: int) -> int:
    """Name a lot (or a crossing) whatever the size of the city."""
    return row << 32 | column
