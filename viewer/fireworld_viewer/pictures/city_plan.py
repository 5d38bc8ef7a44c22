"""A picture of a city as its map has it: buildings by material, kinds of buildings, roads, hydrants, a legend."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fireworld_viewer import colors
from fireworld_viewer.colors import hexadecimal
from fireworld_viewer.pictures.city_map import GROUND, STREET, contrasting
from fireworld_viewer.pictures.figure_files import INK, label_text, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MAP_INCHES: Final = 8.4
"""The longer side of the map."""
LEGEND_INCHES: Final = 2.5
HEAD_INCHES: Final = 0.62
FOOT_INCHES: Final = 0.34
MARGIN_SHARE: Final = 0.02
BAR_LENGTHS_M: Final = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000)

MATERIAL_RGB: Final = {"wood": (214, 170, 112), "steel": (124, 150, 178), "concrete": (168, 164, 158)}


class Kind(NamedTuple):
    """How a kind of building is shown."""

    letter: str
    label: str
    rgb: colors.Rgb


KINDS: Final = {
    "refuge": Kind("R", "refuge", colors.REFUGE_RGB),
    "firestation": Kind("F", "fire station", (196, 62, 48)),
    "policeoffice": Kind("P", "police office", (54, 92, 170)),
    "ambulancecentre": Kind("A", "ambulance centre", (236, 232, 226)),
    "gasstation": Kind("G", "gas station", (242, 200, 56)),
}


@dataclass(frozen=True, kw_only=True)
class CityPlan:
    """What is drawn of a city; lengths in metres, n buildings."""

    title: str
    subtitle: str
    attribution: str
    """Who made the map; written into a corner."""
    outlines: Sequence[NDArray[np.float64]]  # (corners, 2) each
    material: Sequence[str]  # (n,) keys of MATERIAL_RGB
    kind: Sequence[str]  # (n,) keys of KINDS; any other is a plain building
    roads: Sequence[NDArray[np.float64]]  # (corners, 2) each; empty where a city has streets only
    streets: NDArray[np.float64]  # (k, 2, 2) from, to
    hydrants: NDArray[np.float64]  # (h, 2)
    entrances: NDArray[np.float64]  # (e, 2)


def draw_plan(plan: CityPlan) -> Figure:
    """Draw a city from above, north up.

    Raises:
        ViewError: matplotlib is not installed.
    """
    (west, south), (east, north) = _box(plan)
    longer = max(east - west, north - south)
    wide, high = (MAP_INCHES * span / longer for span in (east - west, north - south))
    high = max(high, 3.6)  # the legend needs that much
    width, height = wide + LEGEND_INCHES + 0.4, high + HEAD_INCHES + FOOT_INCHES
    figure = new_figure(width, height)
    axes = figure.add_axes((0.2 / width, FOOT_INCHES / height, wide / width, high / height))
    axes.set(xlim=(west, east), ylim=(south, north), aspect="equal", xticks=[], yticks=[], facecolor=GROUND)
    axes.spines[:].set_visible(False)
    figure.text(0.2 / width, 1 - 0.26 / height, label_text(plan.title), color=INK, fontsize=15, va="center")
    figure.text(0.2 / width, 1 - 0.49 / height, label_text(plan.subtitle), color=INK, fontsize=9.5, va="center")
    metres_of_point = longer / (MAP_INCHES * 72.0)
    _draw_ways(axes, plan, metres_of_point)
    _draw_buildings(axes, plan, metres_of_point)
    _draw_hydrants(axes, plan)
    _draw_legend(figure, axes, plan, left=(wide + 0.32) / width)
    _draw_bar(figure, axes, longer)
    if plan.attribution:
        right = (0.2 + wide) / width
        text = label_text(plan.attribution)
        figure.text(right, 0.13 / height, text, color=INK, fontsize=7.5, ha="right", va="center")
    return figure


def _box(plan: CityPlan) -> NDArray[np.float64]:
    """Return the lower left and the upper right corner of what is shown, (2, 2)."""
    corners = np.concatenate([*plan.outlines, *plan.roads, plan.streets.reshape(-1, 2), plan.hydrants])
    low, high = corners.min(axis=0), corners.max(axis=0)
    margin = MARGIN_SHARE * max(float((high - low).max()), 1.0)
    return np.stack([low - margin, high + margin])


def _draw_ways(axes: Axes, plan: CityPlan, metres_of_point: float) -> None:
    """Draw roads as areas; streets as lines, as wide as streets are where there is room."""
    from matplotlib.collections import LineCollection, PolyCollection

    if len(plan.roads):
        areas = PolyCollection(list(plan.roads), facecolors=STREET, edgecolors="#c9c4ba", linewidths=0.25, zorder=1)
        axes.add_collection(areas, autolim=False)
    else:
        points = float(np.clip(4.0 / metres_of_point, 0.6, 5.0))
        lines = LineCollection(list(plan.streets), colors=STREET, linewidths=points, capstyle="round", zorder=1)
        axes.add_collection(lines, autolim=False)


def _draw_buildings(axes: Axes, plan: CityPlan, metres_of_point: float) -> None:
    from matplotlib.collections import PolyCollection

    faces = [_rgb(plan, building) for building in range(len(plan.outlines))]
    width = float(np.clip(0.35 / metres_of_point, 0.1, 0.5))
    drawn = PolyCollection(
        list(plan.outlines), facecolors=list(map(hexadecimal, faces)), edgecolors=INK, linewidths=width, zorder=2
    )
    axes.add_collection(drawn, autolim=False)
    if len(plan.entrances):
        x, y = plan.entrances.T
        axes.scatter(x, y, s=float(np.clip(2.0 / metres_of_point, 0.6, 7.0)), color=INK, linewidths=0, zorder=3)
    for building, kind in enumerate(plan.kind):
        if kind in KINDS:
            x, y = plan.outlines[building].min(axis=0) / 2 + plan.outlines[building].max(axis=0) / 2
            look = KINDS[kind]
            style = {"boxstyle": "round,pad=0.18", "facecolor": hexadecimal(look.rgb), "edgecolor": "white"}
            axes.text(
                x, y, look.letter, ha="center", va="center", color=contrasting(look.rgb), weight="bold", fontsize=7.5,
                bbox={**style, "linewidth": 0.8}, zorder=6,
            )  # fmt: skip


def _rgb(plan: CityPlan, building: int) -> colors.Rgb:
    look = KINDS.get(plan.kind[building])
    return MATERIAL_RGB[plan.material[building]] if look is None else look.rgb


def _draw_hydrants(axes: Axes, plan: CityPlan) -> None:
    if len(plan.hydrants):
        x, y = plan.hydrants.T
        axes.scatter(
            x, y, s=20, color=hexadecimal(colors.HYDRANT_RGB), marker="s", edgecolors=INK, linewidths=0.5, zorder=5
        )


def _draw_legend(figure: Figure, axes: Axes, plan: CityPlan, *, left: float) -> None:
    """List what is on the map, with how many there are."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = []
    plain = [material for material, kind in zip(plan.material, plan.kind, strict=True) if kind not in KINDS]
    for material, rgb in MATERIAL_RGB.items():
        if material in plain:
            label = f"{material} ({plain.count(material)})"
            handles.append(Patch(facecolor=hexadecimal(rgb), edgecolor=INK, linewidth=0.5, label=label))
    for kind, look in KINDS.items():
        n = list(plan.kind).count(kind)
        if n:
            face = hexadecimal(look.rgb)
            label = f"{look.letter}   {look.label} ({n})"
            handles.append(Patch(facecolor=face, edgecolor=INK, linewidth=0.5, label=label))
    mark: dict[str, Any] = {"linestyle": "none", "markeredgecolor": INK, "markeredgewidth": 0.5}
    if len(plan.hydrants):
        face = hexadecimal(colors.HYDRANT_RGB)
        label = f"hydrant ({len(plan.hydrants)})"
        handles.append(Line2D([], [], marker="s", markersize=5, markerfacecolor=face, label=label, **mark))
    if len(plan.entrances):
        label = f"entrance ({len(plan.entrances)})"
        handles.append(Line2D([], [], marker="o", markersize=3, markerfacecolor=INK, label=label, **mark))
    ways, n_ways = ("road", len(plan.roads)) if len(plan.roads) else ("street", len(plan.streets))
    handles.append(Patch(facecolor=STREET, edgecolor="#c9c4ba", label=f"{ways} ({n_ways})"))
    top = axes.get_position().y1
    figure.legend(
        handles=handles, loc="upper left", bbox_to_anchor=(left, top), frameon=False, fontsize=10, labelcolor=INK,
        borderaxespad=0.0, handlelength=1.1, handleheight=1.1, labelspacing=0.55,
    )  # fmt: skip


def _draw_bar(figure: Figure, axes: Axes, longer_m: float) -> None:
    """Draw a bar of a round length below the map, at the left."""
    from matplotlib.lines import Line2D

    length = max((step for step in BAR_LENGTHS_M if step <= max(longer_m / 5, 1)), default=1)
    start = axes.get_xlim()[0]
    height = figure.get_figheight()
    box = axes.get_position()
    of_metre = box.width / (axes.get_xlim()[1] - start)
    y = 0.15 / height
    line = Line2D(
        [box.x0, box.x0 + length * of_metre], [y, y], color=INK, linewidth=2.4, solid_capstyle="butt",
        transform=figure.transFigure,
    )  # fmt: skip
    figure.add_artist(line)
    label = f"{length} m" if length < 1000 else f"{length // 1000} km"
    figure.text(box.x0 + length * of_metre + 0.06 / figure.get_figwidth(), y, label, color=INK, fontsize=9, va="center")
