"""Maps and curves of two recordings that differ, as PNG files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from fireworld_recorder.spread import differing_entities
from fireworld_viewer import colors
from fireworld_viewer.pictures.figure_files import png_bytes
from fireworld_viewer.pictures.maps import draw_map
from fireworld_viewer.rerun_view.comparison import difference as compare_damage

from fireworld.recording.pages.record_map import draw_record
from fireworld.records import Array, CityRecord, StepRecord

if TYPE_CHECKING:
    from fireworld_recorder.diff import Difference
    from fireworld_recorder.match import Rules
    from fireworld_recorder.reader import Log
    from fireworld_recorder.spread import SpreadRow
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

A_COLOR: Final = "#1f6feb"
B_COLOR: Final = "#c2571a"
_INK: Final = "#333333"
_OTHERWISE_RGB: Final[colors.Rgb] = (206, 196, 230)
"""Of a building that differs, though not in its fieryness."""
_CURVES: Final = {"score": "score", "n_burning": "burning", "n_burnt_out": "burnt out"}


def draw_all(
    logs: tuple[Log, Log], difference: Difference, rules: Rules, rows: Sequence[SpreadRow]
) -> Mapping[str, bytes]:
    """Draw what there is to see of a difference.

    Args:
        logs: both recordings.
        difference: how they differ.
        rules: by which they differ.
        rows: of every step.

    Returns:
        PNG files: "curves" if there are rows, and "first-a", "first-b", "first-difference", "last-a", "last-b",
        "last-difference": maps of the steps where they first and last differ, if they differ in a step that both have.

    Raises:
        ViewError: matplotlib is not installed.
        LogError: a recording changed since it was opened.
    """
    images: dict[str, bytes] = {}
    for moment, row in zip(("first", "last"), _ends(difference.spread.rows), strict=False):
        images |= {f"{moment}-{name}": image for name, image in _draw_maps(logs, row.step, rules).items()}
    if rows:
        images["curves"] = png_bytes(_draw_curves(rows, difference))
    return images


def _ends(rows: Sequence[SpreadRow]) -> Sequence[SpreadRow]:
    """Return the first row and the last, if they are two."""
    return [*rows[:1], *rows[1:][-1:]]


def _draw_maps(logs: tuple[Log, Log], step: int, rules: Rules) -> dict[str, bytes]:
    """Draw one step of both runs, and what of it differs."""
    city, (a, b) = logs[0].city, (log.step(step) for log in logs)
    maps = {name: _draw_run(city, record, name.upper()) for name, record in (("a", a), ("b", b))}
    return maps | {"difference": png_bytes(_draw_difference(city, a, b, differing_entities(a, b, rules, city)))}


def _draw_run(city: CityRecord, record: StepRecord, name: str) -> bytes:
    title = f"{name}: step {record.step}, score {record.score.score:.4g} of {record.score.score_max:.0f}"
    return draw_record(city, record, title=title)


def _draw_difference(city: CityRecord, a: StepRecord, b: StepRecord, differing: Mapping[str, Array]) -> Figure:
    """Draw which buildings, brigades and civilians differ; brigades where they are in the second run."""
    from matplotlib.collections import LineCollection, PolyCollection

    figure = draw_map(city, civilian_hp=b.civilians.hp, title=f"what differs: step {b.step}")
    axes = figure.axes[0]
    damage = compare_damage(a.buildings.fieryness, b.buildings.fieryness)
    chosen = np.flatnonzero(differing["building"])
    corners = np.column_stack([city.outline_x_m, city.outline_y_m])
    outlines = [corners[city.outline_ptr[index] : city.outline_ptr[index + 1]] for index in chosen]
    faces = [_unit(_building_rgb(int(damage[index]))) for index in chosen]
    axes.add_collection(PolyCollection(outlines, facecolors=faces, edgecolors=_INK, linewidths=0.35, zorder=3))
    moved = np.flatnonzero(differing["brigade"])
    before, now = (np.column_stack([record.brigades.x_m, record.brigades.y_m])[moved] for record in (a, b))
    axes.add_collection(LineCollection(list(np.stack([before, now], axis=1)), colors=_INK, linewidths=1.2, zorder=7))
    for xy, face in ((before, "none"), (now, _unit(colors.ACTIVITY_RGB[2]))):
        axes.scatter(xy[:, 0], xy[:, 1], s=70, facecolors=face, edgecolors=_INK, linewidths=1.4, zorder=8)
    hurt = np.flatnonzero(differing["civilian"])
    axes.scatter(
        city.civilian_x_m[hurt], city.civilian_y_m[hurt], s=120, facecolors="none", edgecolors="#a0209a",
        linewidths=1.8, zorder=8,
    )  # fmt: skip
    _draw_legend(axes, damage[chosen], n_brigades=len(moved), n_civilians=len(hurt))
    return figure


def _building_rgb(sign: int) -> colors.Rgb:
    """Color a building that differs by whether the second run has less damage (-1), as much, or more of it (1)."""
    return {-1: colors.BETTER_RGB, 0: _OTHERWISE_RGB, 1: colors.WORSE_RGB}[sign]


def _draw_legend(axes: Axes, damage: Array, *, n_brigades: int, n_civilians: int) -> None:
    """Name what differs, in place of the map's own legend."""
    from matplotlib.lines import Line2D

    def mark(label: str, count: int, face: Any, *, shape: str = "s", edge: str = _INK) -> Line2D:
        style: dict[str, Any] = {"markerfacecolor": face, "markeredgecolor": edge, "markersize": 9}
        return Line2D([], [], linestyle="", marker=shape, label=f"{label} ({count})", **style)

    counts = {sign: int(np.count_nonzero(damage == sign)) for sign in (1, -1, 0)}
    handles = [
        mark(label, counts[sign], _unit(_building_rgb(sign)))
        for sign, label in ((1, "worse in B"), (-1, "better in B"), (0, "differs otherwise"))
        if counts[sign]
    ]
    if n_brigades:
        handles.append(mark("brigade, from A to B", n_brigades, _unit(colors.ACTIVITY_RGB[2]), shape="o"))
    if n_civilians:
        handles.append(mark("civilian", n_civilians, "none", shape="o", edge="#a0209a"))
    handles.append(Line2D([], [], linestyle="", label="grey: the same"))
    axes.legend(
        handles=handles, loc="upper left", bbox_to_anchor=(1.01, 1.0), frameon=False, labelcolor=_INK, borderaxespad=0
    )


def _draw_curves(rows: Sequence[SpreadRow], difference: Difference) -> Figure:
    """Draw score, burning and burnt out of both runs, and how many buildings differ."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 6.4), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(2, 2, sharex=True).ravel()
    steps = [row.step for row in rows]
    for panel, (name, label) in zip(panels, _CURVES.items(), strict=False):
        for side, color, style in (("a", A_COLOR, "-"), ("b", B_COLOR, "--")):
            curve = [getattr(getattr(row, name), side) for row in rows]
            panel.plot(steps, _with_gaps(curve), color=color, linestyle=style, linewidth=1.8, label=side.upper())
        panel.set_title(label, fontsize=11, loc="left")
    panels[0].legend(fontsize=9, frameon=False)
    panels[3].plot(steps, _with_gaps([row.n_buildings for row in rows]), color=_INK, label="in anything")
    panels[3].plot(steps, _with_gaps([row.n_states for row in rows]), color="#a0209a", label="in fieryness")
    panels[3].set_title("buildings that differ", fontsize=11, loc="left")
    panels[3].legend(fontsize=9, frameon=False)
    for panel in panels[1:]:  # counts
        panel.set_ylim(bottom=0, top=max(1.0, panel.get_ylim()[1]))
    for panel in panels:
        if difference.first is not None and difference.first.step is not None:
            panel.axvline(difference.first.step, color="#888888", linewidth=1.0, linestyle=":")
        panel.spines[["top", "right"]].set_visible(False)
    figure.supxlabel("step; dotted: the first difference", fontsize=10)
    return figure


def _with_gaps(curve: Sequence[float | None]) -> Array:
    """(k,) float64: NaN where a run does not have the step."""
    return np.array([np.nan if number is None else number for number in curve], dtype=np.float64)


def _unit(rgb: colors.Rgb) -> tuple[float, float, float]:
    """Return a color as matplotlib wants it, 0..1."""
    red, green, blue = rgb
    return red / 255, green / 255, blue / 255
