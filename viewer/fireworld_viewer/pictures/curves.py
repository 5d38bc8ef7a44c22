"""Curves of one run, or of two beside each other: score, buildings, the terms of the reward, tanks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fireworld.records import Array, Recording
from fireworld_viewer.pictures.city_map import INK
from fireworld_viewer.pictures.figure_files import new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BURNING: Final = "#d9600c"
BURNT_OUT: Final = "#161414"
WATER_DAMAGED: Final = "#4f6fc4"
PEOPLE: Final = "#1e8f45"
TANKS: Final = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#161414", "#8a8a8a")
"""Repeated, dashed, when there are more brigades."""
_WIDTH_INCHES: Final = 12.0
_ROW_INCHES: Final = 2.3


@dataclass(frozen=True)
class Line:
    """A curve of a panel."""

    label: str
    steps: Array
    numbers: Array
    color: str
    style: Any = "-"
    width: float = 1.7


@dataclass(frozen=True)
class Panel:
    """What one panel shows."""

    title: str
    lines: Callable[[Recording], list[Line]]
    from_zero: bool = False
    counts: bool = False


def draw_curves(recordings: Sequence[Recording]) -> Figure:
    """Draw all panels: those of two recordings beside each other, on the same scales.

    Raises:
        ViewError: matplotlib is not installed.
    """
    pair = len(recordings) > 1
    n_rows = len(PANELS) if pair else -(-len(PANELS) // 2)
    high = n_rows * _ROW_INCHES
    figure = new_figure(_WIDTH_INCHES, high)
    # Room for the legends: right of the second column, of two columns of one run between them too.
    figure.subplots_adjust(
        left=0.075, right=0.872, bottom=0.55 / high, top=1.0 - 0.3 / high, wspace=0.12 if pair else 0.52, hspace=0.3
    )
    grid = figure.subplots(n_rows, 2, sharex=True, sharey="row" if pair else "none", squeeze=False)
    for index, panel in enumerate(PANELS):
        places = grid[index] if pair else [grid[divmod(index, 2)]]
        shown = [panel.lines(one) for one in recordings]
        alike = len({tuple(line.label for line in lines) for lines in shown}) == 1
        for axes, lines, letter in zip(places, shown, "AB", strict=False):
            named = axes is places[-1] or not alike
            _draw_panel(axes, panel, lines, letter=letter if pair else "", named=named)
        limits = _limits(panel, [line.numbers for lines in shown for line in lines])
        for axes in places:
            axes.set_ylim(limits)
    figure.text(0.475, 0.18 / high, "step (a simulated minute)", fontsize=10, color=INK, ha="center", va="center")
    return figure


def _draw_panel(axes: Axes, panel: Panel, lines: Sequence[Line], *, letter: str = "", named: bool = True) -> None:
    from matplotlib.ticker import MaxNLocator

    for line in lines:
        style: dict[str, Any] = {"color": line.color, "linestyle": line.style, "linewidth": line.width}
        axes.plot(line.steps, line.numbers, label=line.label, **style)
    axes.set_title(f"{letter}: {panel.title}" if letter else panel.title, fontsize=10.5, loc="left", color=INK)
    if named and lines:
        axes.legend(fontsize=8.5, frameon=False, labelcolor=INK, loc="center left", bbox_to_anchor=(1.0, 0.5))
    axes.yaxis.set_major_locator(MaxNLocator(6, integer=panel.counts))
    axes.margins(x=0.01)
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(axis="y", color="#e3dfd6", linewidth=0.8)
    axes.set_axisbelow(True)
    axes.set_facecolor("white")
    axes.tick_params(labelsize=9, colors=INK, labelbottom=True)
    axes.yaxis.set_major_formatter(_with_commas)


def _limits(panel: Panel, numbers: Sequence[Array]) -> tuple[float, float]:
    """Return the ends of the axis: zero is in it, and a little more than the greatest number."""
    every = np.concatenate([np.zeros(1), *(np.asarray(row, dtype=np.float64) for row in numbers)])
    low, high = float(every.min()), float(every.max())
    if panel.from_zero:
        return 0.0, 1.05 * max(1.0, high)
    return 1.05 * min(-1.0, low), 1.05 * high


def _with_commas(number: float, _: float) -> str:
    return f"{number:,.10g}"


def _line(recording: Recording, topic: str, name: str, label: str, color: str, style: str = "-") -> Line:
    return Line(label, np.asarray(recording.steps), recording.column(topic, name), color, style)


def _score(recording: Recording) -> list[Line]:
    return [
        _line(recording, "/score", "score_max", "greatest", "#9a9a9a", ":"),
        _line(recording, "/score", "score", "score", INK),
        _line(recording, "/score", "score_now", "by today's rule", "#8a6fb0", "--"),
    ]


def _buildings(recording: Recording) -> list[Line]:
    return [
        _line(recording, "/score", "n_burning", "burning", BURNING),
        _line(recording, "/score", "n_burnt_out", "burnt out", BURNT_OUT, "--"),
        _line(recording, "/score", "n_water_damaged", "water-damaged", WATER_DAMAGED, "-."),
    ]


def _reward_of_buildings(recording: Recording) -> list[Line]:
    return [
        _line(recording, "/rewards", "burning", "burning", BURNING),
        _line(recording, "/rewards", "burnt_out", "burnt out", BURNT_OUT, "--"),
        _line(recording, "/rewards", "water_damaged", "water-damaged", WATER_DAMAGED, "-."),
    ]


def _reward(recording: Recording) -> list[Line]:
    return [
        _line(recording, "/rewards", "civilians", "civilians", PEOPLE),
        _line(recording, "/rewards", "total", "all terms", INK, "--"),
    ]


def _sum_of_rewards(recording: Recording) -> list[Line]:
    return [_line(recording, "/rewards", "sum_so_far", "return", INK)]


def _tanks(recording: Recording) -> list[Line]:
    """Curves thinner and thinner: of brigades that refill together, all can be seen."""
    steps, litres = np.asarray(recording.steps), np.asarray(recording.column("/brigades", "tank_litres"))
    n = len(TANKS)
    return [
        Line(f"brigade {k}", steps, litres[:, k], TANKS[k % n], "-" if k < n else "--", 2.8 - 0.6 * (k % 4))
        for k in range(litres.shape[1])
    ]


PANELS: Final = (
    Panel("score", _score, from_zero=True),
    Panel("buildings", _buildings, from_zero=True, counts=True),
    Panel("reward of the step: buildings", _reward_of_buildings),
    Panel("reward of the step: civilians, and in all", _reward),
    Panel("reward so far (return)", _sum_of_rewards),
    Panel("water in the tanks, litres", _tanks, from_zero=True),
)
