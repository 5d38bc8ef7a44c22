"""Curves of learning in Rerun: what a training reports from time to time."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from fireworld_viewer import colors

if TYPE_CHECKING:
    import rerun

LOG_PATH: Final = "log"
_FEW: Final = 6
"""Plots that stand in two columns; more stand in three."""
_COLUMNS_OF_TAB: Final = 3


@dataclass(frozen=True)
class LayoutTab:
    """Plots with a page of text beside them; one tab is seen at a time."""

    plots: Mapping[str, str]  # titles by name
    page: str  # its name
    picture: str = ""  # the name of a picture beside it; empty for none


@dataclass(frozen=True)
class TrainingLayout:
    """What is plotted of a training."""

    title: str  # what the viewer calls it
    timeline: str  # what is counted: episodes, generations
    plots: Mapping[str, str]  # titles of the plots that are always seen, by name
    tabs: Mapping[str, LayoutTab] = field(default_factory=dict)  # below them, by title
    log: str = ""  # title of the log; empty for none
    n_parts: int = 0  # how many there are, all of which are then in sight; 0: more and more, and the view follows


@dataclass(frozen=True)
class TrainingPoint:
    """What is plotted at one place of the timeline."""

    number: int  # its place
    values: Mapping[str, Mapping[str, float]]  # by the name of the plot, then by that of the curve in it
    marks: Mapping[str, Mapping[str, float]] = field(default_factory=dict)  # points in a plot, by name, then by kind
    note: str = ""  # a line for the log; empty for none
    pages: Mapping[str, str] = field(default_factory=dict)  # text of pages from here on, in Markdown, by their names


class CurveWriter:
    """Writes points to a stream: a curve for each name that comes up in a plot, in a color of its own there."""

    def __init__(self, stream: rerun.RecordingStream, layout: TrainingLayout) -> None:
        self._stream, self._layout = stream, layout
        self._drawn: dict[str, list[str]] = defaultdict(list)

    def write(self, points: Sequence[TrainingPoint]) -> None:
        """Write the next points."""
        import rerun

        if not self._drawn:
            self._stream.send_blueprint(_blueprint(self._layout))
            self._stream.send_recording_name(self._layout.title)
        for plot, named in _rows((point.number, point.values) for point in points).items():
            for curve, row in named.items():
                self._send_curve(plot, curve, row, points=False)
        for plot, named in _rows((point.number, point.marks) for point in points).items():
            for curve, row in named.items():
                self._send_curve(plot, curve, row, points=True)
        for point in points:
            if point.note:
                self._send(LOG_PATH, [point.number], rerun.TextLog.columns(text=[point.note]))
            for name, text in point.pages.items():
                page = rerun.TextDocument.columns(text=[text], media_type=[rerun.MediaType.MARKDOWN])
                self._send(name, [point.number], page)

    def _send_curve(self, plot: str, curve: str, row: Sequence[tuple[int, float]], *, points: bool) -> None:
        """Send values of a curve, as a line or as points, with its look before its first ones."""
        import rerun

        drawn = self._drawn[plot]
        if curve not in drawn:
            rgb = colors.single(colors.BRIGADE_RGB[len(drawn) % len(colors.BRIGADE_RGB)])
            drawn.append(curve)
            style: Any = rerun.SeriesLines(names=[curve or plot.replace("_", " ")], colors=rgb, widths=[1.5])
            if points:
                style = rerun.SeriesPoints(names=[curve], colors=rgb, markers="Diamond", marker_sizes=[4.0])
            self._stream.log(f"{plot}/{curve}", style, static=True)
        numbers, values = zip(*row, strict=True)
        self._send(f"{plot}/{curve}", numbers, rerun.Scalars.columns(scalars=values))

    def write_picture(self, name: str, pixels: NDArray[np.uint8], page: str, text: str) -> None:
        """Write a picture, (rows, columns, 3), that stays the same, and a page about it in Markdown."""
        import rerun

        self._stream.log(name, rerun.Image(pixels), static=True)
        self._stream.log(page, rerun.TextDocument(text, media_type=rerun.MediaType.MARKDOWN), static=True)

    def _send(self, path: str, numbers: Sequence[int], columns: Any) -> None:
        import rerun

        times = rerun.TimeColumn(self._layout.timeline, sequence=numbers)
        self._stream.send_columns(path, indexes=[times], columns=columns)


def _rows(
    points: Iterable[tuple[int, Mapping[str, Mapping[str, float]]]],
) -> dict[str, dict[str, list[tuple[int, float]]]]:
    """Return numbers and values by plot and curve."""
    rows: dict[str, dict[str, list[tuple[int, float]]]] = {}
    for number, plots in points:
        for plot, curves in plots.items():
            for curve, value in curves.items():
                rows.setdefault(plot, {}).setdefault(curve, []).append((number, value))
    return rows


def _blueprint(layout: TrainingLayout) -> Any:
    """Lay out the plots in a grid, the tabs below them, the log beside."""
    import rerun.blueprint as rrb

    axis = None
    if layout.n_parts:
        bounds = rrb.TimeRangeBoundary.absolute(seq=0), rrb.TimeRangeBoundary.absolute(seq=layout.n_parts)
        axis = rrb.TimeAxis(view_range=rrb.TimeRange(*bounds))

    def grid(plots: Mapping[str, str], n_columns: int) -> Any:
        legend = rrb.PlotLegend(rrb.Corner2D.LeftTop)
        views = [
            rrb.TimeSeriesView(name=title, origin=f"/{name}", plot_legend=legend, axis_x=axis)
            for name, title in plots.items()
        ]
        return rrb.Grid(*views, grid_columns=n_columns)

    root = grid(layout.plots, 2 if len(layout.plots) <= _FEW else 3)
    if layout.tabs:
        tabs = []
        for title, tab in layout.tabs.items():
            page = rrb.TextDocumentView(name=title, origin=f"/{tab.page}")
            shown = [grid(tab.plots, _COLUMNS_OF_TAB)] if tab.plots else []
            if tab.picture:
                shown.append(rrb.Spatial2DView(name=title, origin=f"/{tab.picture}"))
            shares = [3] * len(shown) + [1 if tab.plots else 2]
            tabs.append(rrb.Horizontal(*shown, page, column_shares=shares, name=title))
        root = rrb.Vertical(root, tabs[0] if len(tabs) == 1 else rrb.Tabs(*tabs), row_shares=[2, 1])
    if layout.log:
        columns = rrb.TextLogColumns(timeline_columns=[layout.timeline], text_log_columns=["body"])
        log = rrb.TextLogView(name=layout.log, origin=f"/{LOG_PATH}", columns=columns)
        root = rrb.Horizontal(root, log, column_shares=[3, 1])
    return rrb.Blueprint(
        root,
        rrb.TimePanel(
            state="collapsed", timeline=layout.timeline, play_state="paused" if layout.n_parts else "following"
        ),
        rrb.BlueprintPanel(state="expanded"),
        rrb.SelectionPanel(state="collapsed"),
    )
