"""Frames of maps as arrays of pixels: the city is drawn once, and what changes is drawn on it frame by frame."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, cast

import numpy as np
from numpy.typing import NDArray

from fireworld.records import CityRecord, StepRecord
from fireworld_viewer.pictures.city_map import state_of
from fireworld_viewer.pictures.figure_files import drawing, plain_style
from fireworld_viewer.pictures.map_grid import OF_RUNS, MapCell, MapGrid
from fireworld_viewer.pictures.maps import facts_of

DPI: Final = 100
MAP_INCHES: Final = 6.0
"""Of one map."""
Frame = NDArray[np.uint8]  # (height, width, 3) sRGB; both even


class GridFrames:
    """Draws a grid of maps again and again."""

    def __init__(self, grid: MapGrid) -> None:
        self._grid = grid
        self._canvas = cast("Any", grid.figure.canvas)  # matplotlib has no type for it
        for _, item in grid.changing:
            item.set_animated(True)
        for row in grid.legend_rows:  # not drawn, but given their places
            row.set_alpha(0.0)
        with drawing():
            self._canvas.draw()
        self._ground = self._canvas.copy_from_bbox(grid.figure.bbox)
        self._rows: dict[tuple[int, str, Any], Any] = {}

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels, both even."""
        width, height = self._canvas.get_width_height(physical=True)
        return int(width), int(height)

    def draw(self, cells: Sequence[MapCell]) -> Frame:
        """Draw a frame; as for `MapGrid.show`. It does not depend on those before."""
        self._canvas.restore_region(self._ground)
        self._grid.show(cells)
        for axes, item in self._grid.changing:
            axes.draw_artist(item)
        self._draw_legend()
        return np.asarray(self._canvas.buffer_rgba())[..., :3].copy()

    def _draw_legend(self) -> None:
        """Draw the rows of the legend; copy those that were drawn before: letters take most of the time."""
        for index, row in enumerate(self._grid.legend_rows):
            key = index, row.get_text(), row.get_color()
            if key in self._rows:
                self._canvas.restore_region(self._rows[key])
                continue
            row.set_alpha(None)
            row.draw(self._canvas.get_renderer())
            self._rows[key] = self._canvas.copy_from_bbox(row.get_window_extent().padded(2.0))


class RunFrames:
    """Draws the steps of runs of one scenario as they come; ViewError if matplotlib is not installed.

    Args:
        city: where they take place.
        title: the heading of all.
    """

    def __init__(self, city: CityRecord, title: str) -> None:
        self._city, self._title = city, title
        self._frames: GridFrames | None = None

    def frame(self, record: StepRecord, *, note: str = "") -> Frame:
        """Draw the city after a step; `note` comes before what is known of the step."""
        facts = "   ".join([*filter(None, [note]), f"step {record.step}", *facts_of(record)])
        cell = MapCell(self._city, state_of(self._city, record), self._title, facts)
        with plain_style():
            if self._frames is None:
                self._frames = GridFrames(MapGrid([cell], map_inches=MAP_INCHES, labels=OF_RUNS, dpi=DPI))
            return self._frames.draw([cell])
