"""Curves of one run or two, timelines of what the brigades chose and did, and curves of how teams learned."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fireworld.records import ACTIVITIES, Array, Recording
from fireworld_viewer import colors
from fireworld_viewer.colors import hexadecimal
from fireworld_viewer.pictures.figure_files import INK, PAIR_COLORS, label_text, new_figure, open_frame
from fireworld_viewer.story.series import LABELS, action_name, chosen_actions, recorded, series

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TANKS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#161414", "#8a8a8a")
"""Repeated, dashed, when there are more brigades."""
_WIDTH_INCHES: Final = 12.0
_PANEL_INCHES: Final = 2.3
_BURNING: Final = ("#d9600c", "-")
_BURNT_OUT: Final = ("#161414", "--")
_WATER_DAMAGED: Final = ("#4f6fc4", "-.")
COUNT_STYLES: Final[Mapping[str, tuple[str, str]]] = {
    "score.n_burning": _BURNING,
    "score.n_burnt_out": _BURNT_OUT,
    "score.n_water_damaged": _WATER_DAMAGED,
}
"""Color and line of the counts of buildings, by field."""


@dataclass(frozen=True)
class Panel:
    """What one panel shows."""

    title: str
    styles: Mapping[str, tuple[str, str]] | None  # color and style of each field; None for the tanks
    from_zero: bool = False
    counts: bool = False

    def curves(self, recording: Recording) -> list[tuple[Array, str, str, str, float]]:
        """Return the numbers of each curve, its label, color, line and width."""
        if self.styles is not None:
            return [
                (series(recording, field), LABELS[field], *look, 1.7)
                for field, look in self.styles.items()
                if recorded(recording, field)
            ]
        n, tanks = len(TANKS), series(recording, "brigades.tank_litres").T
        return [  # thinner and thinner: of brigades that refill together, all can be seen
            (litres, f"brigade {k}", TANKS[k % n], "-" if k < n else "--", 2.8 - 0.6 * (k % 4))
            for k, litres in enumerate(tanks)
        ]


_SCORE_STYLES: Final = {"score.score_max": ("#9a9a9a", ":"), "score.score": (INK, "-")}
_RETURN_STYLES: Final = {"rewards.sum_so_far": (INK, "-")}
PANELS: Final = (
    Panel("score", _SCORE_STYLES),
    Panel("buildings", COUNT_STYLES, from_zero=True, counts=True),
    Panel(
        "reward of the step: buildings",
        {"rewards.burning": _BURNING, "rewards.burnt_out": _BURNT_OUT, "rewards.water_damaged": _WATER_DAMAGED},
    ),
    Panel(
        "reward of the step: civilians, and in all",
        {"rewards.civilians": ("#1e8f45", "-"), "rewards.total": (INK, "--")},
    ),
    Panel("reward so far (return)", _RETURN_STYLES),
    Panel("water in the tanks, litres", None, from_zero=True),
)
"""Of one run."""
PAIR_PANELS: Final = (
    Panel("score", _SCORE_STYLES),
    *(Panel(f"buildings {LABELS[field]}", {field: look}, from_zero=True, counts=True)
      for field, look in COUNT_STYLES.items()),
    Panel("reward of the step", {"rewards.total": (INK, "-")}),
    Panel("reward so far (return)", _RETURN_STYLES),
)  # fmt: skip
"""Of two runs, laid over each other: a panel for each quantity."""


def draw_curves(recordings: Sequence[Recording]) -> Figure:
    """Draw all panels of one recording, or those of two with the curves of both, in two columns."""
    if len(recordings) > 1:
        return draw_pair_curves(recordings)
    panels = [panel for panel in PANELS if panel.styles is None or panel.curves(recordings[0])]
    figure, grid = _two_columns(len(panels), between=0.52)
    for axes, panel in zip(grid, panels, strict=False):
        curves = panel.curves(recordings[0])
        for numbers, label, color, line, width in curves:
            axes.plot(recordings[0].steps, numbers, label=label, color=color, linestyle=line, linewidth=width)
        _dress_panel(axes, panel.title, counts=panel.counts, named=bool(curves))
        axes.set_ylim(_limits(panel, [numbers for numbers, *_ in curves]))
    return figure


def draw_pair_curves(
    recordings: Sequence[Recording],
    *,
    more: Mapping[str, Mapping[str, tuple[Sequence[int], Sequence[float | None]]]] = {},
    first_step: int | None = None,
) -> Figure:
    """Draw the curves of two recordings over each other, A and B in their colors, B dashed.

    Args:
        recordings: two.
        more: further panels by title, of counts: by label the steps and the numbers, None where there is none.
        first_step: that of the first difference, a dotted line.
    """
    panels = [panel for panel in PAIR_PANELS if any(map(panel.curves, recordings))]
    figure, grid = _two_columns(len(panels) + len(more), between=0.2)
    for axes, panel in zip(grid, panels, strict=False):
        numbers = []
        for recording, name, color, dashes in zip(recordings, "AB", PAIR_COLORS, ("-", (0, (4, 2))), strict=True):
            curves = panel.curves(recording)
            for values, label, own, line, width in curves:
                is_greatest = label == LABELS["score.score_max"]
                look = {"color": own, "linestyle": line} if is_greatest else {"color": color, "linestyle": dashes}
                shown = (label if name == "A" else None) if is_greatest else name
                axes.plot(recording.steps, values, label=shown, linewidth=width, **look)
                numbers.append(values)
        _dress_panel(axes, panel.title, counts=panel.counts, named=False)
        axes.set_ylim(_limits(panel, numbers))
    handles, labels = grid[0].get_legend_handles_labels()
    grid[min(1, len(panels) - 1)].legend(handles, labels, **_BESIDE)
    for axes, (title, curves_of) in zip(grid[len(panels) :], more.items(), strict=False):
        for (label, (steps, counts)), color in zip(curves_of.items(), (_DIFFERS, INK), strict=False):
            axes.plot(steps, np.array(counts, dtype=np.float64), label=label, color=color, linewidth=1.7)
        _dress_panel(axes, title, counts=True, named=False)
        axes.legend(fontsize=8.5, frameon=False, labelcolor=INK, loc="best")
        axes.set_ylim(0.0, 1.05 * max(1.0, axes.get_ylim()[1]))
    for axes in grid[: len(panels) + len(more)] if first_step is not None else ():
        axes.axvline(first_step, color="#888888", linewidth=1.0, linestyle=":")
    return figure


_DIFFERS: Final = hexadecimal(colors.DIFFERS_RGB)
_BESIDE: Final[Mapping[str, Any]] = {
    "fontsize": 8.5, "frameon": False, "labelcolor": INK, "loc": "center left", "bbox_to_anchor": (1.0, 0.5),
}  # fmt: skip
"""Of a legend right of its panel."""


def _two_columns(n: int, *, between: float) -> tuple[Figure, Any]:
    """Return a figure with room for legends right of the columns, and its axes in order; those too many are hidden."""
    n_rows = -(-n // 2)
    high = n_rows * _PANEL_INCHES
    figure = new_figure(_WIDTH_INCHES, high)
    figure.subplots_adjust(
        left=0.075, right=0.872, bottom=0.55 / high, top=1.0 - 0.3 / high, wspace=between, hspace=0.3
    )
    grid = figure.subplots(n_rows, 2, sharex=True, squeeze=False).ravel()
    for axes in grid[n:]:
        axes.set_visible(False)
    figure.text(0.475, 0.18 / high, "step (a simulated minute)", fontsize=10, color=INK, ha="center", va="center")
    return figure, grid


def _dress_panel(axes: Axes, title: str, *, counts: bool, named: bool) -> None:
    """Set title, legend, ticks and grid of a panel."""
    from matplotlib.ticker import MaxNLocator

    axes.set_title(title, fontsize=10.5, loc="left", color=INK)
    if named:
        axes.legend(**_BESIDE)
    axes.yaxis.set_major_locator(MaxNLocator(6, integer=counts))
    axes.xaxis.set_major_locator(MaxNLocator(8, integer=True))
    axes.margins(x=0.01)
    open_frame(axes)
    axes.grid(axis="y", color="#e3dfd6", linewidth=0.8)
    axes.set_axisbelow(True)
    axes.set_facecolor("white")
    axes.tick_params(labelsize=9, colors=INK, labelbottom=True)
    axes.yaxis.set_major_formatter(lambda number, _: f"{number:,.10g}")


def _limits(panel: Panel, numbers: Sequence[Array]) -> tuple[float, float]:
    """Return the ends of the axis: zero is in it, but for scores, and a little more than the greatest number.

    A good run loses some hundredths of its score: on an axis from zero its curve would be a flat line.
    """
    every = np.concatenate([np.zeros(0), *(np.asarray(row, dtype=np.float64) for row in numbers)])
    low, high = float(every.min(initial=0.0)), float(every.max(initial=0.0))
    if panel.styles is _SCORE_STYLES and len(every):
        margin = max(0.06 * (high - float(every.min())), 1e-3 * max(1.0, high))
        return float(every.min()) - margin, high + margin
    return (0.0, 1.05 * max(1.0, high)) if panel.from_zero else (1.05 * min(-1.0, low), 1.05 * high)


_ROW_INCHES: Final = 0.42
_MARGIN_INCHES: Final = 0.75  # of a panel: its title above the rows and the steps below them
_LEGEND_INCHES: Final = 0.75
_LEFT: Final = 0.085
_BANDS: Final = ((-0.38, 0.44), (0.12, 0.22))
"""Top and height of the actions and of the activities in a row, which is 1 high."""


def draw_timeline(recordings: Sequence[Recording]) -> Figure:
    """Draw a panel for each recording, in it two bands for each brigade."""
    heights = [_MARGIN_INCHES + _ROW_INCHES * max(1, len(one.city.brigade_tank_litres)) for one in recordings]
    total = sum(heights) + _LEGEND_INCHES
    figure = new_figure(_WIDTH_INCHES, total)
    span = min(int(one.steps[0]) for one in recordings), max(int(one.steps[-1]) for one in recordings)
    bottom = total
    for one, height, letter in zip(recordings, heights, "AB", strict=False):
        bottom -= height
        axes = figure.add_axes((_LEFT, (bottom + 0.42) / total, 0.985 - _LEFT, (height - _MARGIN_INCHES) / total))
        _draw_bands(axes, one, span)
        name = "" if len(recordings) == 1 else f"{letter}: "
        axes.set_title(f"{name}above what a brigade chose, below what it did", loc="left", fontsize=10, color=INK)
    _draw_codes(figure, recordings, total)
    return figure


def _tables(recording: Recording) -> tuple[Array, Array]:
    """Return what was chosen and what was done, (k, n_brigades) each; -1 is no choice."""
    return chosen_actions(recording), np.asarray(recording.column("/brigades", "activity"), dtype=np.int64)


def _draw_bands(axes: Axes, recording: Recording, span: tuple[int, int]) -> None:
    n, steps = len(recording.city.brigade_tank_litres), np.asarray(recording.steps)
    palettes: Sequence[Callable[[int], colors.Rgb]] = colors.action_rgb, colors.ACTIVITY_RGB.__getitem__
    for table, color, (top, height) in zip(_tables(recording), palettes, _BANDS, strict=True):
        for brigade in range(n):
            for start, end, code in _bands(steps, table[:, brigade]):
                style: dict[str, Any] = {"facecolors": hexadecimal(color(code)), "edgecolors": "none", "linewidth": 0}
                axes.broken_barh([(start, end - start)], (brigade + top, height), **style)
    axes.set_xlim(span[0] - 0.5, span[1] + 0.5)
    axes.set_ylim(max(n, 1) - 0.5, -0.5)
    axes.set_yticks(range(n), [f"brigade {index}" for index in range(n)], fontsize=9)
    axes.set_xlabel("step", fontsize=9, labelpad=1, color=INK)
    axes.tick_params(labelsize=9, colors=INK, length=3)
    axes.set_facecolor("white")
    axes.spines[["top", "right", "left"]].set_visible(False)


def _bands(steps: Array, codes: Array) -> list[tuple[float, float, int]]:
    """Join steps with one code: start, end and code of each band; a step reaches half a step to either side."""
    starts = np.flatnonzero(np.concatenate([[True], codes[1:] != codes[:-1]]))
    ends = np.concatenate([starts[1:], [len(codes)]]) - 1
    bounds = zip(steps[starts].tolist(), steps[ends].tolist(), codes[starts].tolist(), strict=True)
    return [(low - 0.5, high + 0.5, int(code)) for low, high, code in bounds if code >= 0]


def _draw_codes(figure: Figure, recordings: Sequence[Recording], total: float) -> None:
    """Name the actions and the activities that occur."""
    from matplotlib.patches import Patch

    kinds: Sequence[tuple[str, Callable[[int], str], Callable[[int], colors.Rgb]]] = (
        ("chose:", action_name, colors.action_rgb),
        ("did:", ACTIVITIES.__getitem__, colors.ACTIVITY_RGB.__getitem__),
    )
    for row, (heading, name, color) in enumerate(kinds):
        occurring = {int(code) for one in recordings for code in np.unique(_tables(one)[row]) if code >= 0}
        look: dict[str, Any] = {"edgecolor": INK, "linewidth": 0.4}
        handles = [
            Patch(facecolor=hexadecimal(color(code)), label=name(code).replace("-", " "), **look)
            for code in sorted(occurring)
        ]
        height = (0.57 - 0.3 * row) / total
        figure.text(_LEFT, height, heading, fontsize=9, color=INK, va="center", weight="bold")
        figure.legend(
            handles=handles, loc="center left", bbox_to_anchor=(0.13, height), ncols=max(1, len(handles)),
            frameon=False, fontsize=9, labelcolor=INK, borderaxespad=0, columnspacing=1.4, handlelength=1.3,
        )  # fmt: skip


_PANELS_ACROSS: Final = 4  # of learning curves


@dataclass(frozen=True, kw_only=True)
class LearningPanel:
    """What one panel shows."""

    title: str
    curves: Mapping[str, Sequence[Array]]
    """By team, one or two: (episodes,) numbers of each repetition; repetitions may differ in length."""
    marks: Mapping[str, float]
    """Episodes where dotted lines stand: by team, in its color, or by another word, in grey."""


def draw_learning_curves(panels: Sequence[LearningPanel], *, label: str, mark: str, shares: bool = False) -> Figure:
    """Draw the panels in rows of four.

    `label` says what the numbers are, `shares` that they are from 0 to 1, `mark` what the dotted lines are.
    """
    from matplotlib.lines import Line2D

    n_rows = -(-len(panels) // _PANELS_ACROSS)
    figure = new_figure(12.0, 2.8 + 1.4 * n_rows, dpi=110, paper="white", layout="constrained")
    grid = figure.subplots(n_rows, _PANELS_ACROSS, sharex=True, squeeze=False).ravel()
    color_of = dict(zip(dict.fromkeys(team for panel in panels for team in panel.curves), PAIR_COLORS, strict=False))
    for axes, panel in zip(grid, panels, strict=False):
        for team, repetitions in panel.curves.items():
            if len(repetitions) > 1:
                for curve in repetitions:
                    axes.plot(curve, color=color_of[team], linewidth=0.5, alpha=0.25)
            axes.plot(_mean_curve(repetitions), color=color_of[team], linewidth=1.8 if len(repetitions) > 1 else 1.1)
        for whose, episode in panel.marks.items():
            axes.axvline(episode, color=color_of.get(whose, "#555555"), linewidth=1.0, linestyle=":")
        axes.set_title(label_text(panel.title), fontsize=10, loc="left")
        open_frame(axes)
        axes.tick_params(labelsize=8)
        if shares:
            axes.set_ylim(-0.04, 1.04)
    for axes in grid[len(panels) :]:
        axes.set_visible(False)
    handles = [Line2D([], [], color=color, linewidth=1.8, label=label_text(team)) for team, color in color_of.items()]
    handles.append(Line2D([], [], color="#555555", linewidth=1.0, linestyle=":", label=mark))
    figure.legend(handles=handles, loc="outside upper left", ncols=3, fontsize=8, frameon=False)
    figure.supxlabel("episode", fontsize=10)
    figure.supylabel(label, fontsize=10)
    return figure


def _mean_curve(repetitions: Sequence[Array]) -> Array:
    """Return the mean over the repetitions that last as long: (longest,)."""
    longest = np.array([*zip_longest(*repetitions, fillvalue=np.nan)], order="F").T
    means: Array = np.nanmean(longest, axis=0)
    return means
