"""Maps in rows and columns on one figure, each with its heading, and one legend for all: marks and how many of each."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fireworld.errors import one_line
from fireworld.records import ACTIVITIES, FIERYNESS, CityRecord, Recording
from fireworld_viewer import colors
from fireworld_viewer.colors import hexadecimal
from fireworld_viewer.pictures.beside import CityInset, CountCurves, most_counted
from fireworld_viewer.pictures.city_map import JET_EDGE, WIDTH_INCHES, CityMap, MapState
from fireworld_viewer.pictures.extent import Extent, whole_extent
from fireworld_viewer.pictures.figure_files import DPI, INK, new_figure

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

_LEGEND_INCHES: Final = 2.35
_GAP_INCHES: Final = 0.14
_LINE_INCHES: Final = 0.24
_CREDIT_INCHES: Final = 0.13
_CREDIT_POINTS: Final = 7.5
_LEGEND_LINE_INCHES: Final = 0.205
_INSET_INCHES: Final = 1.9  # the longer side of the small map
_CURVES_INCHES: Final = 0.8  # height of the curves below a map, and above and below them
_ABOVE_CURVES_INCHES: Final = 0.3
_BELOW_CURVES_INCHES: Final = 0.28
_LEFT_OF_CURVES_INCHES: Final = 0.32
_FADED: Final = "#a9a5a0"
"""Of the rows of a film's legend that are about nothing at this step."""
_POINTS_WIDE: Final = 0.56  # how wide a letter is on average, of its size
_MAPS_COUNTED: Final = 2  # above this many maps, and in strips, the legend has no counts

_JET: Final = "water jet"
_WAY: Final = "way to a target"
_TANK: Final = "water in the tank"
_BRIGADE: Final = "brigade"
_DOING: Final = tuple(f"brigade {activity.removeprefix('driving-').replace('-', ' ')}" for activity in ACTIVITIES)
_CIVILIAN: Final = ("civilian well", "civilian hurt", "civilian dying", "civilian dead")
"""With more than 3/4 of their health, more than 1/4, less, and none."""
_CODES: Final = tuple(name.replace("-", " ") for name in FIERYNESS)
_UPRIGHT: Final = ((-0.25, -1.0), (0.25, -1.0), (0.25, 1.0), (-0.25, 1.0), (-0.25, -1.0))
_MARKS: Final[Mapping[str, tuple[colors.Rgb, Any, float]]] = {
    **{label: (rgb, "s", 9.0) for label, rgb in zip(_CODES, colors.FIERYNESS_RGB, strict=True)},
    "refuge": (colors.REFUGE_RGB, "s", 9.0),
    "hydrant": (colors.HYDRANT_RGB, "s", 5.0),
    **{label: (rgb, "o", 6.0) for label, rgb in zip(_CIVILIAN, colors.HEALTH_RGB, strict=True)},
    "civilian dead": (colors.DEAD_RGB, "X", 6.0),
    _BRIGADE: (colors.ACTIVITY_RGB[2], "o", 10.0),
    **{label: (rgb, "o", 10.0) for label, rgb in zip(_DOING, colors.ACTIVITY_RGB, strict=True)},
    _TANK: (colors.WATER_RGB, _UPRIGHT, 11.0),
}
"""Color, shape and size."""
LABELS: Final = (*_MARKS, _JET, _WAY)  # everything that can be on a map, in the order of the legend
OF_RUNS: Final = tuple(label for label in LABELS if label != _BRIGADE)
"""What can be on the maps of a run that was not imported: there it is known what every brigade does."""
LEGEND_STYLE: Final[Mapping[str, Any]] = {
    "loc": "upper left", "bbox_to_anchor": (1.01, 1.0), "frameon": False, "labelcolor": INK, "borderaxespad": 0,
}  # fmt: skip
"""To the right of a map."""
_UNCOUNTED: Final = frozenset({_TANK, _JET, _WAY})


@dataclass(frozen=True)
class MapCell:
    """One map of a grid."""

    city: CityRecord
    state: MapState
    title: str
    facts: str = ""  # a second line of the heading
    step: int = 0
    part: Extent | None = None  # what is shown of the city; all of it if left out. All cells show the same


class MapGrid:
    """A figure of maps, row by row; `show` sets all of them to another step.

    The labels are the entries of the legend: what is on these maps if left out. With `curves`, the run of each map,
    there are curves below the maps, which are in one row then.
    """

    def __init__(
        self,
        cells: Sequence[MapCell],
        *,
        columns: int = 1,
        map_inches: float = WIDTH_INCHES,
        heading: str = "",
        labels: Sequence[str] = (),
        curves: Sequence[Recording] = (),
        legend_rows: int = 0,
        dpi: int = DPI,
    ) -> None:
        part = cells[0].part or whole_extent(cells[0].city)
        self._map_inches = map_inches
        map_height = min(max(map_inches * part.high / part.wide, 0.4 * map_inches), 2.0 * map_inches)
        self._labels = list(labels) or labels_on(cells)
        rows = -(-len(cells) // columns)
        n_lines = 1 + any(cell.facts for cell in cells)
        row_height = map_height + n_lines * _LINE_INCHES + _GAP_INCHES
        curves_height = _ABOVE_CURVES_INCHES + _CURVES_INCHES + _BELOW_CURVES_INCHES if curves else 0.0
        above = _GAP_INCHES / 2 + (1.7 * _LINE_INCHES if heading else 0.0)
        n_rows = max(len(self._labels), legend_rows)
        needed = above + n_lines * _LINE_INCHES + (n_rows + 1) * _LEGEND_LINE_INCHES + 2 * _GAP_INCHES
        inset_at = needed
        has_room = not heading or needed + _INSET_INCHES < above + rows * row_height  # strips are no higher for it
        inset = cells[0].part if has_room else None
        needed += _INSET_INCHES + _GAP_INCHES if inset else 0.0
        self._width = _GAP_INCHES + columns * (map_inches + _GAP_INCHES) + _LEGEND_INCHES
        credit = one_line(cells[0].city.attribution)
        below = _CREDIT_INCHES / 2 if credit else 0.0
        self._height = max(above + rows * row_height + curves_height + _GAP_INCHES, needed) + below
        self.figure: Figure = new_figure(_even(self._width, dpi), _even(self._height, dpi), dpi=dpi)
        self._maps: list[CityMap] = []
        self._insets: list[CityInset] = []
        self._curves: list[CountCurves] = []
        self._facts: list[Any] = []
        if heading:
            room = self._width - 2 * _GAP_INCHES
            self._write(_GAP_INCHES, above - 0.5 * _LINE_INCHES, heading, points=13.0, inches=room)
        for index, cell in enumerate(cells):
            row, column = divmod(index, columns)
            left = _GAP_INCHES + column * (map_inches + _GAP_INCHES)
            top = above + row * row_height + n_lines * _LINE_INCHES
            self._add(cell, left, top, map_height, alone=len(cells) == 1 and not heading, n_lines=n_lines)
        if credit:
            room = columns * (map_inches + _GAP_INCHES) - _GAP_INCHES
            self._write_credit(
                credit, _GAP_INCHES + room, above + rows * row_height - _GAP_INCHES + _CREDIT_INCHES, inches=room
            )
        if inset:
            self._add_inset(cells[0].city, inset, left=self._width - _LEGEND_INCHES, top=inset_at)
        for index, run in enumerate(curves):
            self._add_curves(curves, run, left=_GAP_INCHES + index * (map_inches + _GAP_INCHES),
                             top=above + row_height + below - _GAP_INCHES + _ABOVE_CURVES_INCHES)  # fmt: skip
        corner = self._maps[min(columns, len(self._maps)) - 1]
        self._counted = len(cells) <= _MAPS_COUNTED and not heading
        title = "how many: (A | B)" if self._counted and len(cells) > 1 else None
        self._legend = corner.axes.legend(
            handles=[_handle(label) for label in self._labels], labels=self._labels, handlelength=1.7, fontsize=10.0,
            title=title, title_fontsize=10.0, alignment="left", **LEGEND_STYLE,
        )  # fmt: skip
        self.show(cells)

    @property
    def changing(self) -> list[tuple[Any, Artist]]:
        """What `show` sets besides the legend, in the order of drawing, with the axes to draw it on."""
        on_maps = [(one.axes, item) for one in self._maps for item in one.changing]
        beside: list[tuple[Any, Artist]] = [(one.axes, one.brigades) for one in self._insets]
        beside += [(one.axes, one.cursor) for one in self._curves]
        return [*on_maps, *beside, *((self._maps[0].axes, item) for item in self._facts)]

    @property
    def legend_rows(self) -> list[Any]:
        """The words of the legend, which `show` sets too."""
        return list(self._legend.get_texts())

    def show(self, cells: Sequence[MapCell]) -> None:
        """Set every map; `cells` are as many as before, of the same cities."""
        for one, facts, cell in zip(self._maps, self._facts, cells, strict=True):
            one.show(cell.state)
            facts.set_text(cell.facts)
        for inset in self._insets:
            inset.show(cells[0].state.brigades if len(cells) == 1 else None)
        for curves, cell in zip(self._curves, cells, strict=False):
            curves.show(cell.step)
        counts = [count_marks(cell.city, cell.state) for cell in cells] if self._counted else []
        for text, label in zip(self._legend.get_texts(), self._labels, strict=True):
            numbers = [count.get(label, 0) for count in counts]
            nothing = bool(counts) and not any(numbers)
            counted = not nothing and bool(counts) and label not in _UNCOUNTED
            text.set_text(f"{label} ({' | '.join(map(str, numbers))})" if counted else label)
            text.set_color(_FADED if nothing else INK)

    def _add(self, cell: MapCell, left: float, top: float, height: float, *, alone: bool, n_lines: int) -> None:
        """Add a map whose upper left corner is there, in inches from the upper left one of the figure."""
        wide, high = self._width, self._height
        box = (left / wide, 1.0 - (top + height) / high, self._map_inches / wide, height / high)
        axes = self.figure.add_axes(box)
        n_brigades = len(cell.city.brigade_tank_litres)
        if cell.state.brigades is not None:
            n_brigades = max(n_brigades, len(cell.state.brigades.xy_m))
        self._maps.append(CityMap(axes, cell.city, inches=self._map_inches, n_brigades=n_brigades, part=cell.part))
        room = wide - 2 * _GAP_INCHES if alone else self._map_inches
        size = 13.0 if alone else 11.0
        title_at = top - (n_lines - 1) * _LINE_INCHES
        self._write(left, title_at, cell.title, points=size, inches=room)
        self._facts.append(self._write(left, top, cell.facts, points=size - 2.0, inches=room))

    def _add_inset(self, city: CityRecord, part: Extent, *, left: float, top: float) -> None:
        """Add the small map of the whole city below the legend; places are in inches from the upper left corner."""
        whole = whole_extent(city)
        scale = _INSET_INCHES / max(whole.wide, whole.high)
        wide, high = scale * whole.wide / self._width, scale * whole.high / self._height
        axes = self.figure.add_axes((left / self._width, 1.0 - top / self._height - high, wide, high))
        self._insets.append(CityInset(axes, city, part))

    def _add_curves(self, runs: Sequence[Recording], run: Recording, *, left: float, top: float) -> None:
        """Add the curves of one of the runs."""
        inches = self._map_inches - _LEFT_OF_CURVES_INCHES
        box = (
            (left + _LEFT_OF_CURVES_INCHES) / self._width, 1.0 - (top + _CURVES_INCHES) / self._height,
            inches / self._width, _CURVES_INCHES / self._height,
        )  # fmt: skip
        span = min(int(one.steps[0]) for one in runs), max(int(one.steps[-1]) for one in runs)
        axes = self.figure.add_axes(box)
        self._curves.append(CountCurves(axes, run, span=span, most=most_counted(list(runs)), inches=inches))

    def _write_credit(self, text: str, right: float, bottom: float, *, inches: float) -> None:
        """Write whom the map is by, below it in the corner; a longer text is cut."""
        room = int(inches * 72.0 / (_POINTS_WIDE * _CREDIT_POINTS))
        shown = text if len(text) <= room else f"{text[: room - 1]}…"
        place = (right / self._width, 1.0 - bottom / self._height)
        style: dict[str, Any] = {"ha": "right", "va": "baseline", "color": INK, "parse_math": False}
        self.figure.text(*place, shown, fontsize=_CREDIT_POINTS, **style)

    def _write(self, left: float, bottom: float, text: str, *, points: float, inches: float) -> Any:
        """Write a line, in smaller letters if it would be too long; names in it come from files and are no formulas."""
        fitting = inches * 72.0 / (_POINTS_WIDE * max(1, len(text)))
        place = (left / self._width, 1.0 - (bottom - 0.07) / self._height)
        style: dict[str, Any] = {"ha": "left", "va": "baseline", "color": INK, "parse_math": False}
        return self.figure.text(*place, text, fontsize=min(points, max(fitting, 6.0)), **style)


def count_marks(city: CityRecord, state: MapState) -> dict[str, int]:
    """Count what is on a map, by label; what is not there is left out."""
    outside = np.delete(np.asarray(state.fieryness, dtype=np.int64), np.asarray(city.refuge_building, dtype=np.int64))
    counts = dict(zip(_CODES, np.bincount(outside, minlength=len(_CODES)).tolist(), strict=True))
    counts |= {"refuge": len(city.refuge_building), "hydrant": len(city.hydrant_x_m)}
    hp, start = np.asarray(state.civilian_hp, dtype=np.float64), np.maximum(city.civilian_hp, 1)
    band = np.digitize(hp / start, [0.0, 0.25, 0.75], right=True)  # 0 dead, 3 well
    counts |= dict(zip(reversed(_CIVILIAN), np.bincount(band, minlength=4).tolist(), strict=True))
    brigades = state.brigades
    if brigades is not None and brigades.activity is None:
        counts[_BRIGADE] = len(brigades.xy_m)
        counts[_TANK] = 0 if brigades.tank_share is None else len(brigades.xy_m)
    elif brigades is not None:
        doing = np.bincount(np.asarray(brigades.activity, dtype=np.int64), minlength=len(_DOING)).tolist()
        counts |= dict(zip(_DOING, doing, strict=True))
        counts[_TANK] = len(brigades.xy_m)
        counts[_JET] = len(brigades.with_target(ACTIVITIES.index("spraying"))[0])
        counts[_WAY] = len(brigades.with_target(ACTIVITIES.index("driving"))[0])
    return {label: count for label, count in counts.items() if count}


def labels_on(cells: Iterable[MapCell]) -> list[str]:
    """Return the entries of a legend: what is on any of the maps."""
    there: set[str] = set().union(*(count_marks(cell.city, cell.state) for cell in cells))
    return [label for label in LABELS if label in there]


def _even(inches: float, dpi: int) -> float:
    """Return inches that are an even number of pixels, as films want it, also for who rounds them down."""
    pixels = 2 * round(inches * dpi / 2)
    fitting = pixels / dpi
    while fitting * dpi < pixels:
        fitting = math.nextafter(fitting, math.inf)
    return fitting


def mark(face: str, shape: Any = "s", size: float = 9.0, *, edge: str = INK, label: str = "") -> Line2D:
    """Return an entry of a legend."""
    from matplotlib.lines import Line2D

    style: dict[str, Any] = {"markerfacecolor": face, "markeredgecolor": edge, "markersize": size, "label": label}
    return Line2D([], [], linestyle="", marker=shape, **style)


def _handle(label: str) -> Any:
    """Return the mark of a label as it is on the map."""
    from matplotlib.lines import Line2D
    from matplotlib.patheffects import Normal, Stroke

    if label == _WAY:
        return Line2D([], [], color=INK, linewidth=1.1, linestyle=(0, (3, 2)))
    if label == _JET:
        edged = [Stroke(linewidth=4.2, foreground=JET_EDGE), Normal()]
        return Line2D([], [], color=hexadecimal(colors.WATER_RGB), linewidth=2.6, path_effects=edged)
    rgb, shape, size = _MARKS[label]
    return mark(hexadecimal(rgb), shape, size, edge="white" if label == "civilian dead" else INK)
