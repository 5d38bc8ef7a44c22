"""Two policies or runs compared: differences seed by seed, a map of what differs at a step, curves of both runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from fireworld.records import Array, CityRecord, StepRecord
from fireworld_viewer import colors
from fireworld_viewer.pictures.city_map import hexadecimal, outlines_m
from fireworld_viewer.pictures.figure_files import INK, PAIR_COLORS, label_text, new_figure, open_frame
from fireworld_viewer.pictures.map_grid import LEGEND_STYLE, mark
from fireworld_viewer.pictures.maps import draw_map
from fireworld_viewer.story.steps import compare_damage

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Gaps = Sequence[float | None]  # numbers over steps; None where a run does not have the step

_VIOLET: Final = hexadecimal(colors.DIFFERS_RGB)
_BRIGADE: Final = hexadecimal(colors.ACTIVITY_RGB[2])
_KINDS: Final = {
    1: ("worse in B", hexadecimal(colors.WORSE_RGB)),
    -1: ("better in B", hexadecimal(colors.BETTER_RGB)),
    0: ("other difference", "#cec4e6"),
}
"""Of buildings that differ: label and color by the sign that `compare_damage` returns."""
BETTER: Final = "#0072b2"
WORSE: Final = "#d55e00"
EQUAL: Final = "#8a8a8a"
"""Blue, vermilion and grey: every eye can distinguish them; side and mark say the same."""
_INK: Final = "#222222"
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
        "a triangle is a seed: B - A. Blue, pointing up: B is better; orange, pointing down: A is; grey dots: equal. "
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


def draw_difference_map(city: CityRecord, a: StepRecord, b: StepRecord, differing: Mapping[str, Array]) -> Figure:
    """Draw which buildings, brigades and civilians differ; brigades where they are in the second run.

    `a` and `b` are one step of both runs; `differing`: "building", "brigade" and "civilian", (n,) bool which differ.
    """
    from matplotlib.collections import LineCollection, PolyCollection

    figure = draw_map(city, civilian_hp=b.civilians.hp, title=f"what differs: step {b.step}")
    axes = figure.axes[0]
    chosen = np.flatnonzero(differing["building"])
    damage = compare_damage(a.buildings.fieryness, b.buildings.fieryness)[chosen].tolist()
    every = outlines_m(city)
    outlines = [every[index] for index in chosen]
    faces = [_KINDS[sign][1] for sign in damage]
    axes.add_collection(PolyCollection(outlines, facecolors=faces, edgecolors=INK, linewidths=0.35, zorder=3))
    moved = np.flatnonzero(differing["brigade"])
    before, now = (np.column_stack([record.brigades.x_m, record.brigades.y_m])[moved] for record in (a, b))
    axes.add_collection(LineCollection(list(np.stack([before, now], axis=1)), colors=INK, linewidths=1.2, zorder=7))
    for xy, face in ((before, "none"), (now, _BRIGADE)):
        axes.scatter(xy[:, 0], xy[:, 1], s=70, facecolors=face, edgecolors=INK, linewidths=1.4, zorder=8)
    hurt = np.flatnonzero(differing["civilian"])
    x, y = city.civilian_x_m[hurt], city.civilian_y_m[hurt]
    axes.scatter(x, y, s=120, facecolors="none", edgecolors=_VIOLET, linewidths=1.8, zorder=8)
    entries = [
        mark(face, label=f"{label} ({damage.count(sign)})") for sign, (label, face) in _KINDS.items() if sign in damage
    ]
    if len(moved):
        entries.append(mark(_BRIGADE, "o", label=f"brigade, from A to B ({len(moved)})"))
    if len(hurt):
        entries.append(mark("none", "o", edge=_VIOLET, label=f"civilian ({len(hurt)})"))
    entries.append(mark("none", "", label="grey: the same"))
    axes.legend(handles=entries, **LEGEND_STYLE)
    return figure


def draw_difference_curves(
    steps: Sequence[int],
    curves: Mapping[str, tuple[Gaps, Gaps]],
    n_buildings: Mapping[str, Gaps],
    *,
    first_step: int | None,
) -> Figure:
    """Draw three curves of A and of B by title, those after the first counts, and how many buildings differ by label.

    All numbers are over the steps; `first_step` is that of the first difference.
    """
    figure = new_figure(12.0, 6.4, dpi=110, paper="white", layout="constrained")
    panels = figure.subplots(2, 2, sharex=True).ravel()
    for axes, (title, both) in zip(panels, curves.items(), strict=False):
        for name, curve, color, style in zip("AB", both, PAIR_COLORS, ("-", "--"), strict=True):
            numbers = np.array(curve, dtype=np.float64)  # None becomes NaN: a gap
            axes.plot(steps, numbers, color=color, linestyle=style, linewidth=1.8, label=name)
        axes.set_title(title, fontsize=11, loc="left")
    for (label, counts), color in zip(n_buildings.items(), (INK, _VIOLET), strict=True):
        panels[3].plot(steps, np.array(counts, dtype=np.float64), color=color, label=label)
    panels[3].set_title("buildings that differ", fontsize=11, loc="left")
    for axes in panels[[0, 3]]:
        axes.legend(fontsize=9, frameon=False)
    for axes in panels[1:]:  # counts
        axes.set_ylim(bottom=0, top=max(1.0, axes.get_ylim()[1]))
    for axes in panels:
        if first_step is not None:
            axes.axvline(first_step, color="#888888", linewidth=1.0, linestyle=":")
        open_frame(axes)
    figure.supxlabel("step; dotted: the first difference", fontsize=10)
    return figure
