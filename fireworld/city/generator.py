"""Synthetic cities: lots in blocks between streets, one building a lot, everything in whole millimetres.

Every property of a lot is a keyed draw of its column and row, so that a larger city of the same seed begins with the
same lots.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from fireworld import draws
from fireworld.city import lot_draws
from fireworld.city.city import Array, Footprints, Int64Array, Plan, StreetMap, freeze
from fireworld.errors import CityError, expected

WIDTH, DEPTH, OFFSET_X, OFFSET_Y, FLOORS, MATERIAL, SHAPE, NOTCH_WIDTH, NOTCH_DEPTH, HYDRANT = range(10)
"""What a draw is for: the last part of its key."""

FLOORS_OF_DRAW: Final = (1, 1, 2, 3)
WOOD_PERCENT: Final = 75
STEEL_PERCENT: Final = 20
L_SHAPE_ONE_IN: Final = 2
"""One building in so many is L-shaped, if what the notch leaves still fills the lot enough."""
SPAN_MAX_MM: Final = 10_000_000

N_CORNERS: Final = 6
WHOLE: Final = 4
"""Shape of a rectangle; 0 to 3 are L-shapes, by the corner that is missing."""
_NEAR, _FAR, _INNER = range(3)
CORNER_X: Final = np.array(
    [
        [_NEAR, _INNER, _INNER, _FAR, _FAR, _NEAR],
        [_NEAR, _INNER, _INNER, _FAR, _FAR, _NEAR],
        [_NEAR, _FAR, _FAR, _INNER, _INNER, _NEAR],
        [_NEAR, _FAR, _FAR, _INNER, _INNER, _NEAR],
        [_NEAR, _FAR, _FAR, _NEAR, _NEAR, _NEAR],
    ]
)
"""By shape, where the six corners are between west, east and the notch."""
CORNER_Y: Final = np.array(
    [
        [_INNER, _INNER, _NEAR, _NEAR, _FAR, _FAR],
        [_NEAR, _NEAR, _INNER, _INNER, _FAR, _FAR],
        [_NEAR, _NEAR, _INNER, _INNER, _FAR, _FAR],
        [_NEAR, _NEAR, _FAR, _FAR, _INNER, _INNER],
        [_NEAR, _NEAR, _FAR, _FAR, _FAR, _FAR],
    ]
)
"""By shape, where they are between south, north and the notch."""


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
class _Lots:
    """All lots, row by row, south-west first; every property of each is a draw of its own."""

    layout: _Layout
    seed: int
    columns: int
    rows: int

    @property
    def n(self) -> int:
        """Number of lots."""
        return self.columns * self.rows

    @cached_property
    def keys(self) -> Int64Array:
        """(n,) the names of the lots."""
        row, column = np.divmod(np.arange(self.n), self.columns)
        return _lot_key(column, row)

    def draw(self, purpose: int, bound: int | Int64Array) -> Int64Array:
        """Draw a whole number in [0, bound) for one property of every lot, (n,)."""
        return lot_draws.below(self.seed, draws.CITY, self.keys, purpose, bound=bound)

    def footprints(self, *, fill: tuple[float, float], refuge: Array) -> Footprints:
        """Put a building on every lot; `refuge` (n,) bool."""
        corners, n_corners = self._outlines(fill)
        doubled_area, centroid = _measure(corners)
        ptr = np.concatenate([[0], np.cumsum(n_corners)])
        percent = self.draw(MATERIAL, 100)
        return Footprints(
            building_id=np.arange(self.n, dtype=np.int64),
            refuge=refuge.astype(np.uint8),
            outline_ptr=ptr.astype(np.int32),
            outline_mm=corners[np.arange(N_CORNERS) < n_corners[:, None]].astype(np.int32),
            centroid_mm=centroid.astype(np.int32),
            floors=np.array(FLOORS_OF_DRAW, dtype=np.int32)[self.draw(FLOORS, len(FLOORS_OF_DRAW))],
            material=np.searchsorted([WOOD_PERCENT, WOOD_PERCENT + STEEL_PERCENT], percent, side="right").astype(
                np.uint8
            ),
            ground_area_m2=(doubled_area // 2_000_000).astype(np.float32),
            inflammable=(~refuge).astype(np.uint8),
        )

    def _outlines(self, fill: tuple[float, float]) -> tuple[Int64Array, Int64Array]:
        """Draw the outlines, counterclockwise from the south-west corner.

        Returns the corners (n, 6, 2), of a rectangle the last one thrice, and their number (n,). Both sides lie between
        the roots of the shares of the lot, so their product lies between the shares.
        """
        side = self.layout.lot
        shortest = math.isqrt(round(side * side * fill[0])) + 1
        longest = max(shortest, math.isqrt(round(side * side * fill[1])))
        width = shortest + self.draw(WIDTH, longest - shortest + 1)
        depth = shortest + self.draw(DEPTH, longest - shortest + 1)
        # An edge is in the middle half of the slack, so that no two buildings ever touch.
        lot_x = np.array([self.layout.lot_start(0, column) for column in range(self.columns)])
        lot_y = np.array([self.layout.lot_start(1, row) for row in range(self.rows)])
        slack_x, slack_y = side - width, side - depth
        west = np.tile(lot_x, self.rows) + slack_x // 4 + self.draw(OFFSET_X, slack_x // 2 + 1)
        south = np.repeat(lot_y, self.columns) + slack_y // 4 + self.draw(OFFSET_Y, slack_y // 2 + 1)

        shape = self.draw(SHAPE, 4 * L_SHAPE_ONE_IN)  # 0 to 3: which corner of an L-shape is missing
        notch_width = width // 4 + self.draw(NOTCH_WIDTH, width // 4)
        notch_depth = depth // 4 + self.draw(NOTCH_DEPTH, depth // 4)
        whole = (shape > 3) | (width * depth - notch_width * notch_depth < shortest * shortest)
        shape = np.where(whole, WHOLE, shape)
        inner_x = np.where((shape == 1) | (shape == 2), width - notch_width, notch_width)
        inner_y = np.where((shape == 2) | (shape == 3), depth - notch_depth, notch_depth)
        lot = np.arange(self.n)[:, None]
        x = np.stack([np.zeros_like(width), width, inner_x], axis=1)[lot, CORNER_X[shape]]
        y = np.stack([np.zeros_like(depth), depth, inner_y], axis=1)[lot, CORNER_Y[shape]]
        return np.stack([west[:, None] + x, south[:, None] + y], axis=2), np.where(whole, 4, N_CORNERS)


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
    lots = _Lots(layout, seed, columns, rows)
    footprints = lots.footprints(fill=fill, refuge=_refuge_lots(layout, columns, rows, refuges))
    streets = _streets(layout, seed, columns, rows, hydrant_share)
    return freeze(Plan(name=name, footprints=footprints, streets=streets))


def _measure(corners: Int64Array) -> tuple[Int64Array, Int64Array]:
    """Return twice the area (n,) of counterclockwise outlines (n, 6, 2) and their centroids (n, 2), rounded down.

    Measured from each outline's first corner, so that all numbers fit 64 bits: a shift by whole millimetres changes no
    rounding.
    """
    away = corners - corners[:, :1]
    following = np.roll(away, -1, axis=1)
    cross = away[:, :, 0] * following[:, :, 1] - following[:, :, 0] * away[:, :, 1]
    doubled_area = cross.sum(axis=1)
    moment = ((away + following) * cross[:, :, None]).sum(axis=1)
    return doubled_area, corners[:, 0] + moment // (3 * doubled_area)[:, None]


def _refuge_lots(layout: _Layout, columns: int, rows: int, refuges: Sequence[tuple[float, float]]) -> Array:
    """Find the free lot nearest to each place, ties to the first in row order; return which lots these are, (n,)."""
    width = layout.lot_start(0, columns - 1) + layout.lot + layout.street
    height = layout.lot_start(1, rows - 1) + layout.lot + layout.street
    start_x = np.array([layout.lot_start(0, column) for column in range(columns)])
    start_y = np.array([layout.lot_start(1, row) for row in range(rows)])
    taken = np.zeros(columns * rows, dtype=np.bool_)
    for place in refuges:
        across = 2 * start_x + layout.lot - 2 * round(place[0] * width)
        along = 2 * start_y + layout.lot - 2 * round(place[1] * height)
        square = (along * along)[:, None] + across * across
        square.ravel()[taken] = np.iinfo(np.int64).max
        taken[int(np.argmin(square))] = True
    return taken


def _streets(layout: _Layout, seed: int, columns: int, rows: int, hydrant_share: float) -> StreetMap:
    """Lay streets around every block, with a node at each crossing; numbered in row order."""
    across, along = -(-columns // layout.block[0]) + 1, -(-rows // layout.block[1]) + 1
    x = [layout.street_middle(0, index) for index in range(across)]
    y = [layout.street_middle(1, index) for index in range(along)]
    x[-1] = layout.lot_start(0, columns - 1) + layout.lot + layout.street // 2  # the last block may be narrower
    y[-1] = layout.lot_start(1, rows - 1) + layout.lot + layout.street // 2
    node = np.arange(across * along)
    east, north = node[node % across + 1 < across], node[: across * (along - 1)]
    streets = np.concatenate([np.stack([east, east + 1], axis=1), np.stack([north, north + across], axis=1)])
    of_node = np.argsort(streets[:, 0], kind="stable")  # of each node first the street to the east
    keys = _lot_key(node % across, node // across)
    hydrants = lot_draws.uniforms(seed, draws.CITY, keys, HYDRANT) < hydrant_share
    return StreetMap(
        node_mm=np.stack([np.tile(x, along), np.repeat(y, across)], axis=1).astype(np.int32),
        street=streets[of_node].astype(np.int32),
        hydrant_node=np.flatnonzero(hydrants).astype(np.int32),
    )


def _lot_key(column: Int64Array, row: Int64Array) -> Int64Array:
    """Name lots (or crossings) whatever the size of the city."""
    return row << 32 | column
