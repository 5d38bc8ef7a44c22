"""A city from above on matplotlib axes: streets are drawn once, what changes is set step by step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from fireworld.records import ACTIVITIES, CityRecord, StepRecord
from fireworld_viewer import colors
from fireworld_viewer.colors import hexadecimal
from fireworld_viewer.pictures.extent import MARGIN_M, Extent, whole_extent
from fireworld_viewer.pictures.figure_files import INK
from fireworld_viewer.story.series import existing

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

STREET: Final = "#ffffff"
GROUND: Final = "#dedad2"
JET_EDGE: Final = "#174a7c"
WIDTH_INCHES: Final = 7.6
"""Of a map on which everything has its full size; on smaller ones, balls and letters are smaller too."""

_SMALLEST_SCALE: Final = 0.7
_ABREAST: Final = 8
_BALL_POINTS: Final = 14.0
_GAUGE_POINTS: Final = (3.6, 15.0)  # width and height of the gauge of a full tank
_DRIVING: Final = ACTIVITIES.index("driving")
_SPRAYING: Final = ACTIVITIES.index("spraying")


@dataclass(frozen=True, kw_only=True)
class BrigadeMarks:
    """The brigades on a map; n of them."""

    xy_m: NDArray[np.float64]  # (n, 2) positions
    activity: NDArray[Any] | None = None  # (n,) index into ACTIVITIES; unknown if left out
    tank_share: NDArray[np.float64] | None = None  # (n,) share of the tank that is full, 0..1; unknown if left out
    target: NDArray[Any] | None = None  # (n,) index of the target's building, -1 none; unknown if left out

    def with_target(self, activity: int) -> tuple[NDArray[Any], NDArray[Any]]:
        """Return the indices of the brigades that do this and have a target, and those of their targets: (k,) each."""
        if self.activity is None or self.target is None:
            return np.zeros(0, dtype=np.intp), np.zeros(0, dtype=np.intp)
        chosen = np.flatnonzero((self.activity == activity) & (self.target >= 0))
        return chosen, self.target[chosen]


@dataclass(frozen=True, kw_only=True)
class MapState:
    """What a map shows of a step."""

    fieryness: NDArray[Any]  # (n,) official codes 0..8
    civilian_hp: NDArray[Any]  # (n_civilians,) health points
    brigades: BrigadeMarks | None = None  # none are drawn if left out
    civilian_xy_m: NDArray[Any] | None = None  # (n_civilians, 2) positions; those of the start if left out


def state_of(city: CityRecord, record: StepRecord) -> MapState:
    """Return what a map shows of a step."""
    brigades, n = record.brigades, len(record.brigades.x_m)
    target = np.full(n, -1, dtype=np.int64)
    target[: len(record.decisions.target)] = existing(record.decisions.target, city)
    full = np.asarray(city.brigade_tank_litres, dtype=np.float64)
    known = len(brigades.activity) == n  # not so in imported logs
    civilians = record.civilians
    return MapState(
        fieryness=record.buildings.fieryness,
        civilian_hp=record.civilians.hp,
        brigades=BrigadeMarks(
            xy_m=np.column_stack([brigades.x_m, brigades.y_m]).astype(np.float64),
            activity=brigades.activity if known else None,
            tank_share=np.clip(brigades.tank_litres / np.maximum(full, 1.0), 0.0, 1.0) if known or full.all() else None,
            target=target if known else None,
        ),
        civilian_xy_m=np.column_stack([civilians.x_m, civilians.y_m]) if len(civilians.x_m) else None,
    )


class CityMap:
    """A map of a city, or of a part of it, on axes of a known width; `show` sets what is on it."""

    def __init__(
        self, axes: Axes, city: CityRecord, *, inches: float, n_brigades: int = 0, part: Extent | None = None
    ) -> None:
        from matplotlib.collections import LineCollection, PolyCollection

        self.axes, self.city = axes, city
        west, east, south, north = extent = part or whole_extent(city)
        self._east_m = east
        self._drawn = buildings_in(city, extent)
        outlines = outlines_m(city)
        axes.set(xlim=(west, east), ylim=(south, north), aspect="equal", xticks=[], yticks=[], facecolor=GROUND)
        axes.spines[:].set_visible(False)
        self._scale = float(np.clip(inches / WIDTH_INCHES, _SMALLEST_SCALE, 1.0))
        self._m_per_point = (east - west) / (inches * 72.0) * self._scale
        self._draw_ground()
        line: dict[str, Any] = {"capstyle": "round", "zorder": 5}
        self._way_casing = LineCollection([], colors="white", linewidths=2.6 * self._scale, **line)
        self._ways = LineCollection([], colors=INK, linewidths=1.1 * self._scale, linestyles=(0, (3, 2)), zorder=5)
        self._jet_casing = LineCollection([], colors=JET_EDGE, linewidths=4.2 * self._scale, **line)
        self._jets = LineCollection([], colors=hexadecimal(colors.WATER_RGB), linewidths=2.6 * self._scale, **line)
        self._buildings: Any = PolyCollection(
            [outlines[index] for index in self._drawn], edgecolors=INK, linewidths=0.35 * self._scale, zorder=2
        )
        bold: dict[str, Any] = {"ha": "center", "weight": "bold", "fontsize": 8 * self._scale}
        self._centers = np.column_stack([city.center_x_m, city.center_y_m])
        self._refuges = [
            axes.annotate("R", tuple(self._centers[index]), va="center", color="white", zorder=5, **bold)
            for index in np.asarray(city.refuge_building)
        ]
        self._apart_m = self._m_per_point * np.array([7.0, 7.0])
        xy = _side_by_side(np.column_stack([city.civilian_x_m, city.civilian_y_m]), self._apart_m, east)
        edge: dict[str, Any] = {"edgecolors": INK, "linewidths": 0.8 * self._scale}
        self._civilians: Any = axes.scatter(xy[:, 0], xy[:, 1], s=34 * self._scale, zorder=6, **edge)
        self._balls = axes.scatter(
            [], [], s=(_BALL_POINTS * self._scale) ** 2, edgecolors=INK, linewidths=0.8, zorder=7
        )
        self._gauges = PolyCollection([], facecolors="white", edgecolors=INK, linewidths=0.8, zorder=7)
        self._water = PolyCollection([], facecolors=hexadecimal(colors.WATER_RGB), edgecolors="none", zorder=7.1)
        self._numbers = [
            axes.text(0.0, 0.0, str(index), va="center_baseline", zorder=7.2, clip_on=True, **bold)
            for index in range(n_brigades)
        ]
        lines = self._way_casing, self._ways, self._jet_casing, self._jets
        for item in (self._buildings, *lines, self._gauges, self._water):
            axes.add_collection(item, autolim=False)

    @property
    def changing(self) -> list[Artist]:
        """What `show` sets, in the order in which it is drawn."""
        lines = (self._way_casing, self._ways, self._jet_casing, self._jets)
        return [self._buildings, *self._refuges, *lines, self._civilians, self._balls, self._gauges, self._water,
                *self._numbers]  # fmt: skip

    def show(self, state: MapState) -> None:
        """Set the map to a step."""
        faces = _unit_rgb(colors.FIERYNESS_RGB)[np.asarray(state.fieryness, dtype=np.int64)]
        faces[np.asarray(self.city.refuge_building, dtype=np.int64)] = np.array(colors.REFUGE_RGB) / 255.0
        self._buildings.set_facecolor(faces[self._drawn])
        hp = np.asarray(state.civilian_hp)
        if state.civilian_xy_m is not None:
            self._civilians.set_offsets(_side_by_side(state.civilian_xy_m, self._apart_m, self._east_m))
        self._civilians.set_facecolor(colors.health_rgb(hp, np.asarray(self.city.civilian_hp)) / 255.0)
        self._civilians.set_edgecolor(["white" if points <= 0 else INK for points in hp.tolist()])  # seen on black
        self._civilians.set_paths([_marker("X" if points <= 0 else "o") for points in hp.tolist()])
        self._show_brigades(state.brigades or BrigadeMarks(xy_m=np.zeros((0, 2))))

    def _show_brigades(self, brigades: BrigadeMarks) -> None:
        xy = _side_by_side(brigades.xy_m, self._m_per_point * np.array([21.0, 15.0]), self._east_m)
        n = len(xy)
        activity = np.full(n, _SPRAYING) if brigades.activity is None else np.asarray(brigades.activity, dtype=np.int64)
        self._balls.set_offsets(xy)
        self._balls.set_facecolor(_unit_rgb(colors.ACTIVITY_RGB)[activity])
        share = np.zeros(0) if brigades.tank_share is None else brigades.tank_share
        self._gauges.set_verts(list(self._bars(xy, np.ones(len(share)))))
        self._water.set_verts(list(self._bars(xy, share)))
        for index, number in enumerate(self._numbers):
            number.set_visible(index < n)
            if index < n:
                number.set_position(tuple(xy[index]))
                number.set_color(contrasting(colors.ACTIVITY_RGB[activity[index]]))
        casings = (self._way_casing, self._ways, _DRIVING), (self._jet_casing, self._jets, _SPRAYING)
        for casing, line, doing in casings:
            chosen, target = brigades.with_target(doing)
            segments = list(np.stack([xy[chosen], self._centers[target]], axis=1))
            casing.set_segments(segments)
            line.set_segments(segments)

    def _bars(self, xy: NDArray[np.float64], share: NDArray[np.float64]) -> NDArray[np.float64]:
        """Corners of upright bars to the right of the balls, as high as the shares: (n, 4, 2)."""
        wide, high = self._m_per_point * np.array(_GAUGE_POINTS)
        west = xy[: len(share), 0] + self._m_per_point * (_BALL_POINTS / 2 + 1.0)
        south = xy[: len(share), 1] - high / 2
        north = south + high * share
        corners = [(west, south), (west + wide, south), (west + wide, north), (west, north)]
        return np.stack([np.column_stack(corner) for corner in corners], axis=1).reshape(-1, 4, 2)

    def _draw_ground(self) -> None:
        """Draw what never changes: streets, hydrants and a bar of a round length, about a fifth of the map."""
        from matplotlib.collections import LineCollection

        axes, city = self.axes, self.city
        node = np.column_stack([city.node_x_m, city.node_y_m])
        ends = np.stack([node[city.street_from], node[city.street_to]], axis=1)
        (west, east), (south, north) = axes.get_xlim(), axes.get_ylim()
        low, high = ends.min(axis=1), ends.max(axis=1)
        seen = (low[:, 0] < east) & (high[:, 0] > west) & (low[:, 1] < north) & (high[:, 1] > south)
        lines = list(ends[seen])
        width = 3.0 * self._scale
        axes.add_collection(LineCollection(lines, colors=STREET, linewidths=width, capstyle="round", zorder=1))
        rgb = hexadecimal(colors.HYDRANT_RGB)
        axes.scatter(city.hydrant_x_m, city.hydrant_y_m, s=14 * self._scale, color=rgb, marker="s", zorder=4)
        longest = max(10.0, (east - west) / 4)
        length = max(step for step in (10, 20, 50, 100, 200, 500, 1000, 2000) if step <= longest)
        x, y = west + 0.6 * MARGIN_M, south + 0.6 * MARGIN_M
        axes.plot([x, x + length], [y, y], color=INK, linewidth=2.5, solid_capstyle="butt", zorder=8)
        axes.annotate(
            f"{length} m", (x + length, y), xytext=(4, 0), textcoords="offset points", va="center", color=INK,
            fontsize=10 * max(self._scale, 0.75), bbox={"facecolor": GROUND, "edgecolor": "none", "pad": 1.0},
        )  # fmt: skip


def outlines_m(city: CityRecord) -> list[NDArray[np.float64]]:
    """Return the corners of each building, (corners, 2) each."""
    return np.split(np.column_stack([city.outline_x_m, city.outline_y_m]), city.outline_ptr[1:-1])


def buildings_in(city: CityRecord, part: Extent) -> NDArray[np.intp]:
    """Return the indices of the buildings that are in a part of the plane, wholly or not."""
    x, y, first = (np.asarray(one) for one in (city.outline_x_m, city.outline_y_m, city.outline_ptr[:-1]))
    seen = (np.minimum.reduceat(x, first) < part.east) & (np.maximum.reduceat(x, first) > part.west)
    seen &= (np.minimum.reduceat(y, first) < part.north) & (np.maximum.reduceat(y, first) > part.south)
    return np.flatnonzero(seen)


def contrasting(rgb: Sequence[int]) -> str:
    """Return the color of letters on a ground: dark on what is light, white on what is dark."""
    red, green, blue = rgb
    return INK if 299 * red + 587 * green + 114 * blue > 140_000 else "white"


def _unit_rgb(rgb: Sequence[colors.Rgb]) -> NDArray[np.float64]:
    return np.array(rgb) / 255.0


def _side_by_side(xy: NDArray[np.float64], apart_m: NDArray[np.float64], east_m: float) -> NDArray[np.float64]:
    """Move eastward what would cover something of a lower number, into a row below where a row is full: (n, 2) both.

    A row is also full where the map ends, at `east_m`; the next one then begins further west.
    """
    placed = np.array(xy, dtype=np.float64).reshape(-1, 2)
    for index in range(1, len(placed)):
        end = min(xy[index, 0] + (_ABREAST - 0.5) * apart_m[0], max(xy[index, 0], east_m - 0.5 * apart_m[0]))
        while True:
            covers = (np.abs(placed[:index] - placed[index]) < 0.999 * apart_m).all(axis=1)
            if not covers.any():
                break
            placed[index, 0] = placed[:index][covers, 0].max() + apart_m[0]
            if placed[index, 0] > end:
                start = min(xy[index, 0], end - (_ABREAST - 1) * apart_m[0])
                placed[index] = start, placed[index, 1] - apart_m[1]
    return placed


def _marker(shape: str) -> Any:
    """Return the outline of a marker of size 1."""
    from matplotlib.markers import MarkerStyle

    style = MarkerStyle(shape)
    return style.get_path().transformed(style.get_transform())
