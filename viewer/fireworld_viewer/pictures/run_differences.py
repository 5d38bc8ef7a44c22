"""Two runs that differ: a map of what differs at a step, and curves of both."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from fireworld.records import Array, CityRecord, StepRecord
from fireworld_viewer import colors
from fireworld_viewer.pictures.city_map import hexadecimal, outlines_m
from fireworld_viewer.pictures.figure_files import INK, PAIR_COLORS, new_figure, open_frame
from fireworld_viewer.pictures.map_grid import LEGEND_STYLE, mark
from fireworld_viewer.pictures.maps import draw_map
from fireworld_viewer.story.steps import compare_damage

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Gaps = Sequence[float | None]  # numbers over steps; None where a run does not have the step

_VIOLET: Final = "#a0209a"
_BRIGADE: Final = hexadecimal(colors.ACTIVITY_RGB[2])
_KINDS: Final = {
    1: ("worse in B", hexadecimal(colors.WORSE_RGB)),
    -1: ("better in B", hexadecimal(colors.BETTER_RGB)),
    0: ("other difference", "#cec4e6"),
}
"""Of buildings that differ: label and color by the sign that `compare_damage` returns."""


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
