"""Two policies or runs compared: differences seed by seed, a map of what differs at a step, curves of both runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fireworld.records import Array, CityRecord, StepRecord
from fireworld_viewer import colors
from fireworld_viewer.colors import hexadecimal
from fireworld_viewer.pictures.city_map import outlines_m
from fireworld_viewer.pictures.extent import Extent
from fireworld_viewer.pictures.figure_files import INK, PAIR_COLORS, label_text, new_figure, open_frame
from fireworld_viewer.pictures.map_grid import LEGEND_STYLE, mark
from fireworld_viewer.pictures.maps import draw_map
from fireworld_viewer.story.series import existing
from fireworld_viewer.story.steps import compare_damage

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

_DIFFERS: Final = hexadecimal(colors.DIFFERS_RGB)
_BRIGADE: Final = hexadecimal(colors.ACTIVITY_RGB[2])
_KINDS: Final = {
    1: ("worse in B", hexadecimal(colors.WORSE_RGB)),
    -1: ("better in B", hexadecimal(colors.BETTER_RGB)),
    0: ("a number only", "#c9c2c4"),
}
"""Of buildings that differ: label and color by the sign that `compare_damage` returns."""
BETTER: Final = hexadecimal(colors.BETTER_RGB)
WORSE: Final = hexadecimal(colors.WORSE_RGB)
EQUAL: Final = "#8a8a8a"
"""Bluish green, vermilion and grey: every eye can distinguish them; side and mark say the same."""
_INK: Final = "#222222"
_LEGEND_ROWS: Final = 8
_GOLDEN: Final = 0.6180339887498949
_SPREAD: Final = 0.3  # points lie that far above and below their line
_DIRECTIONS: Final = {True: (1, " (more is better)"), False: (-1, " (less is better)"), None: (0, "")}


@dataclass(frozen=True, kw_only=True)
class DifferencePanel:
    """One quantity."""

    label: str
    unit: str
    higher_is_better: bool | None  # None: neither is better
    lines: Mapping[str, tuple[Array, Sequence[float]]]
    """By scenario, the last over all if there are several: (seeds,) B - A; its mean, and the ends of its interval."""


def draw_paired_differences(panels: Sequence[DifferencePanel], *, title: str) -> Figure:
    """Draw a panel for each quantity, two in a row: a point for every seed, and the mean with its 95 % interval."""
    n_rows = -(-len(panels) // 2)
    height = n_rows * (1.4 + 0.5 * len(panels[0].lines))
    figure = new_figure(11.0, height, paper="white", layout="constrained")
    grid = figure.subplots(n_rows, 2, squeeze=False).ravel()
    for axes, panel in zip(grid, panels, strict=False):
        _draw_panel(axes, panel)
    for axes in grid[len(panels) :]:
        axes.remove()
    figure.suptitle(label_text(title), fontsize=12, x=0.01, ha="left")
    figure.supxlabel(
        "a point is a seed: B - A. Green, mark up: B is better; orange, mark down: A is; grey: equal. "
        "Black: mean and 95 % interval.",
        fontsize=9,
    )
    return figure


def _draw_panel(axes: Axes, panel: DifferencePanel) -> None:
    sign, direction = _DIRECTIONS[panel.higher_is_better]
    axes.axvline(0.0, color=_INK, linewidth=0.8)
    for place, (differences, (mean, low, high)) in enumerate(panel.lines.values()):
        # One point a seed, spread evenly over the height of the line in the order of the seeds.
        heights = place + _SPREAD * (2.0 * (np.arange(len(differences)) * _GOLDEN % 1.0) - 1.0)
        gain = sign * differences
        for chosen, color, shape in ((gain > 0, BETTER, "^"), (gain < 0, WORSE, "v"), (gain == 0, EQUAL, "o")):
            x, y = differences[chosen], heights[chosen]
            axes.scatter(x, y, s=14, color=color, marker=shape, linewidths=0, alpha=0.6)
        axes.plot([low, high], [place, place], color=_INK, linewidth=2.4, solid_capstyle="butt", zorder=4)
        axes.plot([mean], [place], marker="o", color="white", markeredgecolor=_INK, markersize=7, zorder=5)
    n = len(panel.lines)
    if n > 1:
        axes.axhline(n - 1.5, color="#cccccc", linewidth=0.8)
    axes.set_yticks(range(n), [*map(label_text, panel.lines)], fontsize=9)
    axes.set_ylim(n - 0.4, -0.6)
    widest = max(float(np.abs(differences).max()) for differences, _ in panel.lines.values())
    axes.set_xlim(-1.08 * (widest or 1.0), 1.08 * (widest or 1.0))
    axes.set_title(f"{panel.label}{direction}", fontsize=10, loc="left")
    axes.set_xlabel(panel.unit, fontsize=8)
    open_frame(axes)
    axes.tick_params(axis="x", labelsize=8)


def draw_difference_map(
    city: CityRecord, a: StepRecord, b: StepRecord, differing: Mapping[str, Array], *, part: Extent | None = None
) -> Figure:
    """Draw which buildings, brigades and civilians differ, and what brigades decided otherwise.

    Buildings of other codes have the color of better or worse, those that differ in a number only a light shade.
    Brigades are where they are in the second run; of one that decided otherwise a line leads to its target in each.

    Args:
        city: where it is.
        a: a step of the first run.
        b: the same step of the second.
        differing: "building", "brigade" and "civilian", (n,) bool which differ.
        part: what is shown of the city; all if left out.
    """
    from matplotlib.collections import LineCollection, PolyCollection

    figure = draw_map(
        city, civilian_hp=b.civilians.hp, title=f"what differs: step {b.step}", part=part, legend_rows=_LEGEND_ROWS
    )
    axes = figure.axes[0]
    chosen = np.flatnonzero(differing["building"])
    damage = compare_damage(a.buildings.fieryness, b.buildings.fieryness)[chosen].tolist()
    every = outlines_m(city)
    faces = [_KINDS[sign][1] for sign in damage]
    outlines = [every[index] for index in chosen]
    axes.add_collection(PolyCollection(outlines, facecolors=faces, edgecolors=INK, linewidths=0.35, zorder=3))
    moved = np.flatnonzero(differing["brigade"])
    before, now = (np.column_stack([record.brigades.x_m, record.brigades.y_m])[moved] for record in (a, b))
    axes.add_collection(LineCollection(list(np.stack([before, now], axis=1)), colors=INK, linewidths=1.2, zorder=7))
    for xy, face in ((before, "none"), (now, _BRIGADE)):
        axes.scatter(xy[:, 0], xy[:, 1], s=70, facecolors=face, edgecolors=INK, linewidths=1.4, zorder=8)
    hurt = np.flatnonzero(differing["civilian"])
    x, y = city.civilian_x_m[hurt], city.civilian_y_m[hurt]
    axes.scatter(x, y, s=120, facecolors="none", edgecolors=_DIFFERS, linewidths=1.8, zorder=8)
    entries = [
        mark(face, label=f"{label} ({damage.count(sign)})") for sign, (label, face) in _KINDS.items() if sign in damage
    ]
    if len(moved):
        entries.append(mark(_BRIGADE, "o", label=f"brigade ({len(moved)})"))
    if len(hurt):
        entries.append(mark("none", "o", edge=_DIFFERS, label=f"civilian ({len(hurt)})"))
    entries += _draw_targets(axes, city, a, b)
    entries.append(mark("none", "", label="grey: the same"))
    axes.legend(handles=entries, fontsize=10.0, **LEGEND_STYLE)
    return figure


def _draw_targets(axes: Axes, city: CityRecord, a: StepRecord, b: StepRecord) -> list[Line2D]:
    """Draw lines to the targets of the brigades that decided otherwise, and return their entries of the legend."""
    from matplotlib.patches import Polygon

    other = decided_otherwise(a, b)
    entries: list[Line2D] = []
    every = outlines_m(city)
    for record, name, color, line in zip((a, b), "AB", PAIR_COLORS, ("-", (0, (3, 2))), strict=True):
        target = existing(record.decisions.target, city)
        aimed = [brigade for brigade in other if brigade < len(target) and target[brigade] >= 0]
        for brigade in aimed:
            aim = target[brigade]
            x = record.brigades.x_m[brigade], city.center_x_m[aim]
            y = record.brigades.y_m[brigade], city.center_y_m[aim]
            axes.plot(x, y, color=color, linestyle=line, linewidth=2.2, zorder=7)
            axes.add_patch(
                Polygon(every[aim], facecolor="none", edgecolor=color, linestyle=line, linewidth=3.0, zorder=6)
            )
        if aimed:
            entries.append(mark("none", edge=color, label=f"target in {name} ({len({target[one] for one in aimed})})"))
    places = np.column_stack([b.brigades.x_m, b.brigades.y_m])[other]
    axes.scatter(places[:, 0], places[:, 1], s=150, facecolors=_BRIGADE, edgecolors=INK, linewidths=1.4, zorder=8)
    for brigade, (x, y) in zip(other, places.tolist(), strict=True):
        look: dict[str, Any] = {"ha": "center", "va": "center", "color": "white", "weight": "bold", "fontsize": 8}
        axes.annotate(str(brigade), (x, y), zorder=9, **look)
    return entries


def decided_otherwise(a: StepRecord, b: StepRecord) -> list[int]:
    """Return the brigades whose action or target is another one in the second of two runs."""
    n = len(b.brigades.x_m)
    found = np.zeros(n, dtype=bool)
    for name in ("action", "target"):
        first, second = (np.asarray(getattr(record.decisions, name)) for record in (a, b))
        if len(first) == len(second) == n:
            found |= first != second
    return np.flatnonzero(found).tolist()
