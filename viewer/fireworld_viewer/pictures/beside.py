"""What stands beside and below a map: the whole city with the part that the map shows, and curves with a cursor."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from fireworld.records import CityRecord, Recording
from fireworld_viewer import colors
from fireworld_viewer.colors import hexadecimal
from fireworld_viewer.pictures.city_map import GROUND, BrigadeMarks, outlines_m
from fireworld_viewer.pictures.curves import COUNT_STYLES
from fireworld_viewer.pictures.extent import Extent, whole_extent
from fireworld_viewer.pictures.figure_files import INK, open_frame
from fireworld_viewer.story.series import LABELS, series

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_BUILT: Final = "#b9b5ad"
_OUTLINES_MAX: Final = 10_000
"""Buildings of which the small map has the outlines; of more it has a dot each, which is drawn faster."""
_LEAST_SHARE: Final = 0.05
"""Of the longer side of the small map: a frame that is smaller could not be seen."""
_LETTERS_INCHES: Final = 0.082  # a letter of a curve's name


class CityInset:
    """A small map of the whole city on axes: the part that is shown, and where the brigades are."""

    def __init__(self, axes: Axes, city: CityRecord, part: Extent) -> None:
        from matplotlib.collections import PolyCollection
        from matplotlib.patches import Rectangle

        west, east, south, north = whole_extent(city)
        axes.set(xlim=(west, east), ylim=(south, north), aspect="equal", anchor="NW", xticks=[], yticks=[])
        axes.set_facecolor(GROUND)
        axes.spines[:].set_visible(False)
        refuges = np.asarray(city.refuge_building, dtype=np.int64)
        if len(city.building_id) <= _OUTLINES_MAX:
            houses = PolyCollection(outlines_m(city), facecolors=_BUILT, edgecolors="none")
            axes.add_collection(houses, autolim=False)
        else:
            axes.plot(city.center_x_m, city.center_y_m, linestyle="", marker=",", color=_BUILT)
        x, y = (np.asarray(one)[refuges] for one in (city.center_x_m, city.center_y_m))
        axes.scatter(x, y, s=9.0, marker="s", color=hexadecimal(colors.REFUGE_RGB), linewidths=0)
        least = _LEAST_SHARE * max(east - west, north - south)
        wide, high = max(part.wide, least), max(part.high, least)
        corner = part.west + (part.wide - wide) / 2, part.south + (part.high - high) / 2
        frame = Rectangle(corner, wide, high, facecolor="none", edgecolor=INK, linewidth=1.4, zorder=4)
        axes.add_patch(frame)
        self.axes = axes
        self.brigades: Any = axes.scatter([], [], s=14.0, edgecolors=INK, linewidths=0.5, zorder=5)

    def show(self, brigades: BrigadeMarks | None) -> None:
        """Set the brigades to a step."""
        xy: NDArray[Any] = np.zeros((0, 2)) if brigades is None else brigades.xy_m
        self.brigades.set_offsets(xy)
        if brigades is None or brigades.activity is None:
            self.brigades.set_facecolor(hexadecimal(colors.BRIGADE_UNKNOWN_RGB))
        else:
            self.brigades.set_facecolor(np.array(colors.ACTIVITY_RGB)[brigades.activity.astype(np.int64)] / 255.0)


class CountCurves:
    """Curves of how many buildings burn, are burnt out and water-damaged, below the map of a run, and a cursor.

    Args:
        axes: to draw on.
        recording: the run.
        span: first and last step of the axis.
        most: upper end of the axis.
        inches: width of the axes.
    """

    def __init__(self, axes: Axes, recording: Recording, *, span: tuple[int, int], most: float, inches: float) -> None:
        from matplotlib.ticker import MaxNLocator

        left = 0.0
        for field, (color, line) in COUNT_STYLES.items():
            axes.plot(recording.steps, series(recording, field), color=color, linestyle=line, linewidth=1.7)
            style: dict[str, Any] = {"color": color, "fontsize": 9.5, "va": "bottom", "weight": "bold"}
            axes.text(left / inches, 1.04, LABELS[field], transform=axes.transAxes, **style)
            left += _LETTERS_INCHES * (len(LABELS[field]) + 2)
        axes.set(xlim=(span[0] - 0.5, span[1] + 0.5), ylim=(0.0, 1.08 * most), facecolor="white")
        axes.xaxis.set_major_locator(MaxNLocator(8, integer=True))
        axes.yaxis.set_major_locator(MaxNLocator(3, integer=True))
        axes.tick_params(labelsize=9, colors=INK, length=3)
        open_frame(axes)
        self.axes = axes
        self.cursor = axes.axvline(span[0], color=INK, linewidth=1.2)

    def show(self, step: int) -> None:
        """Move the cursor."""
        self.cursor.set_xdata([step, step])


def most_counted(recordings: list[Recording]) -> float:
    """Return the greatest of all counts in the curves of the runs, at least 1."""
    return max(1.0, *(float(series(one, field).max(initial=0.0)) for one in recordings for field in COUNT_STYLES))
