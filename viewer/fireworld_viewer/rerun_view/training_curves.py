"""Curves of learning in Rerun: what a training reports, live or from its log."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from fireworld_viewer import colors

if TYPE_CHECKING:
    import rerun

LOG_PATH: Final = "log"
BANDS_PATH: Final = "bands"
SETTLED: Final = "settled"
"""The mark that is a diamond; every other is a cross."""
_FEW: Final = 6
"""Plots that stand in two columns; more stand in three."""
_COLUMNS_OF_TAB: Final = 3
_BANDS_MAX: Final = 4
"""Teams whose bands there is room for; those of more are scrolled to."""


@dataclass(frozen=True)
class LayoutTab:
    """What is drawn of one team alone, with a page of text beside it; one tab is seen at a time."""

    team: int
    plots: Mapping[str, str] = field(default_factory=dict)  # titles of its own plots by name; none: its table picture


@dataclass(frozen=True)
class TrainingLayout:
    """What is plotted of trainings."""

    title: str  # what the viewer calls it
    timeline: str  # what is counted: episodes, generations
    plots: Mapping[str, str]  # titles of the plots that all teams share, by name; marks stand in the first
    teams: Sequence[str] = ("",)  # what curves are named after; a single team needs no name
    tabs: Mapping[str, LayoutTab] = field(default_factory=dict)  # below them, by title
    bands: str = ""  # title of the bands above the plots; empty for none
    log: str = ""  # title of the log; empty for none
    n_parts: int = 0  # how many there are, all of which are then in sight; 0: more and more, and the view follows


@dataclass(frozen=True)
class TrainingPoint:
    """What is plotted of a team at one place of the timeline."""

    number: int  # its place
    values: Mapping[str, Mapping[str, float]]  # by the name of the plot, then by that of the curve in it
    team: int = 0
    band: str = ""  # what is learned in: a band lasts until the next one
    mark: str = ""  # on the first curve of the first plot: what has ended here, and how
    note: str = ""  # a line for the log
    page: str = ""  # the text of the team's page from here on, in Markdown


@dataclass(frozen=True)
class TablePixels:
    """A picture of a team's tables over its training."""

    pixels: NDArray[np.uint8]  # (rows, columns, 3); moments have equally many columns
    moments: Sequence[int]  # the place of each moment on the timeline
    page: str  # about it, in Markdown


class CurveWriter:
    """Writes points to a stream: a curve for each name that comes up in a plot."""

    def __init__(self, stream: rerun.RecordingStream, layout: TrainingLayout) -> None:
        self._stream, self._layout = stream, layout
        self._drawn: dict[str, dict[str, int]] = defaultdict(dict)
        self._bands: dict[int, str] = {}
        self._is_laid_out = False

    def write(self, points: Sequence[TrainingPoint]) -> None:
        """Write the next points."""
        if not self._is_laid_out:
            self._stream.send_blueprint(_blueprint(self._layout, points))
            self._stream.send_recording_name(self._layout.title)
            self._is_laid_out = True
        rows: dict[tuple[int, str, str], list[tuple[int, float]]] = defaultdict(list)
        marks: dict[tuple[int, str], list[tuple[int, float]]] = defaultdict(list)
        first = next(iter(self._layout.plots), "")
        for point in points:
            for plot, curves in point.values.items():
                for curve, value in curves.items():
                    rows[point.team, plot, curve].append((point.number, value))
            marked = next(iter(point.values.get(first, {}).values()), None)
            if point.mark and marked is not None:
                marks[point.team, point.mark].append((point.number, marked))
        for (team, plot, curve), row in rows.items():
            self._send_curve(team, plot, curve, row)
        for (team, mark), row in marks.items():
            self._send_curve(team, first, mark, row, marker="Diamond" if mark == SETTLED else "Cross")
        for point in points:
            self._send_words(point)

    def _send_words(self, point: TrainingPoint) -> None:
        """Send what a point says: where a band begins, a line of the log, a page."""
        import rerun

        name = self._layout.teams[point.team]
        if point.band and point.band != self._bands.get(point.team):
            self._bands[point.team] = point.band
            lane = f"{BANDS_PATH}/{_part(name or self._layout.bands)}"
            self._send(lane, [point.number], rerun.StateChange.columns(state=[point.band]))
        if point.note:
            text = ": ".join(filter(None, (name, point.note)))
            self._send(LOG_PATH, [point.number], rerun.TextLog.columns(text=[text]))
        if point.page:
            page = rerun.TextDocument.columns(text=[point.page], media_type=[rerun.MediaType.MARKDOWN])
            self._send(f"page/{point.team}", [point.number], page)

    def write_tables(self, team: int, picture: TablePixels) -> None:
        """Write a picture of tables, a line in it at the time that is looked at, and its page."""
        import rerun

        path, (height, width, _) = f"tables/{team}", picture.pixels.shape
        wide = width / max(1, len(picture.moments))
        document = rerun.TextDocument(picture.page, media_type=rerun.MediaType.MARKDOWN)
        self._stream.log(f"{path}/picture", rerun.Image(picture.pixels), static=True)
        self._stream.log(f"states/{team}", document, static=True)
        look = rerun.LineStrips2D.from_fields(colors=colors.single(colors.DRIVE_RGB), radii=[0.6])
        self._stream.log(f"{path}/now", look, static=True)
        lines = [[((k + 0.5) * wide, 0), ((k + 0.5) * wide, height)] for k in range(len(picture.moments))]
        self._send(f"{path}/now", picture.moments, rerun.LineStrips2D.columns(strips=lines))

    def _send_curve(
        self, team: int, plot: str, curve: str, row: Sequence[tuple[int, float]], *, marker: str = ""
    ) -> None:
        """Send values of a curve, as a line or as points, with its look before its first ones."""
        import rerun

        is_shared = plot in self._layout.plots
        origin = plot if is_shared else _own(team, plot)
        name = ", ".join(filter(None, (self._layout.teams[team] if is_shared else "", curve)))
        drawn = self._drawn[origin]
        path = f"{origin}/{_part(name)}"
        if name not in drawn:
            rgb = self._color(drawn, team, curve, is_shared=is_shared, marks=bool(marker))
            drawn[name] = team
            shown = name or self._layout.plots.get(plot, plot)
            style: Any = rerun.SeriesLines(names=[shown], colors=rgb, widths=[1.5])
            if marker:
                style = rerun.SeriesPoints(names=[shown], colors=rgb, markers=marker, marker_sizes=[4.0])
            self._stream.log(path, style, static=True)
        numbers, values = zip(*row, strict=True)
        self._send(path, numbers, rerun.Scalars.columns(scalars=values))

    def _color(self, drawn: Mapping[str, int], team: int, curve: str, *, is_shared: bool, marks: bool) -> Any:
        """Return the color of the next curve in a plot: its team's, paler after the first; of one team its own."""
        if is_shared and len(self._layout.teams) > 1:
            rgb = colors.BRIGADE_RGB[team % len(colors.BRIGADE_RGB)]
            return colors.single(colors.paler(rgb) if team in drawn.values() and not marks else rgb)
        if marks:
            return colors.single(colors.BRIGADE_RGB[2] if curve == SETTLED else colors.BRIGADE_RGB[1])
        return colors.single(colors.BRIGADE_RGB[len(drawn) % len(colors.BRIGADE_RGB)])

    def _send(self, path: str, numbers: Sequence[int], columns: Any) -> None:
        import rerun

        times = rerun.TimeColumn(self._layout.timeline, sequence=numbers)
        self._stream.send_columns(path, indexes=[times], columns=columns)


def _own(team: int, plot: str) -> str:
    """Return the path of a plot that is a team's alone."""
    return f"own/{team}/{plot}"


def _part(name: str) -> str:
    """Return a name as a part of a path."""
    import rerun

    return rerun.escape_entity_path_part(name) if name else ""


def _blueprint(layout: TrainingLayout, points: Sequence[TrainingPoint]) -> Any:
    """Lay out bands, the plots in a grid and the tabs below each other, the log beside; `points` are the first ones."""
    import rerun.blueprint as rrb

    axis = None
    if layout.n_parts:
        bounds = rrb.TimeRangeBoundary.absolute(seq=0), rrb.TimeRangeBoundary.absolute(seq=layout.n_parts)
        axis = rrb.TimeAxis(view_range=rrb.TimeRange(*bounds))
    first = next(iter(layout.plots), "")
    several = {plot for point in points for plot, curves in point.values.items() if len(curves) > 1}
    named = several if len(layout.teams) == 1 else several - {*layout.plots}

    def grid(plots: Mapping[str, str], n_columns: int, team: int | None = None) -> Any:
        views = []
        for plot, title in plots.items():
            origin = plot if team is None else _own(team, plot)
            corner = rrb.Corner2D.LeftBottom if plot == first else rrb.Corner2D.LeftTop
            legend = rrb.PlotLegend(corner, visible=plot == first or plot in named)
            views.append(rrb.TimeSeriesView(name=title, origin=f"/{origin}", plot_legend=legend, axis_x=axis))
        return rrb.Grid(*views, grid_columns=n_columns)

    rows, shares = [grid(layout.plots, 2 if len(layout.plots) <= _FEW else 3)], [8]
    if layout.bands:
        rows.insert(0, rrb.StateTimelineView(name=layout.bands, origin=f"/{BANDS_PATH}", time_view=axis))
        shares.insert(0, min(len(layout.teams), _BANDS_MAX))
    if layout.tabs:
        tabs = []
        for title, tab in layout.tabs.items():
            if tab.plots:
                shown = grid(tab.plots, _COLUMNS_OF_TAB, tab.team)
                page = rrb.TextDocumentView(name=title, origin=f"/page/{tab.team}")
            else:
                shown = rrb.Spatial2DView(name=title, origin=f"/tables/{tab.team}")
                page = rrb.TextDocumentView(name=title, origin=f"/states/{tab.team}")
            tabs.append(rrb.Horizontal(shown, page, column_shares=[3, 1 if tab.plots else 2], name=title))
        rows.append(tabs[0] if len(tabs) == 1 else rrb.Tabs(*tabs))
        shares.append(4)
    root = rows[0] if len(rows) == 1 else rrb.Vertical(*rows, row_shares=shares)
    if layout.log:
        columns = rrb.TextLogColumns(timeline_columns=[layout.timeline], text_log_columns=["body"])
        log = rrb.TextLogView(name=layout.log, origin=f"/{LOG_PATH}", columns=columns)
        root = rrb.Horizontal(root, log, column_shares=[3, 1])
    return rrb.Blueprint(
        root,
        rrb.TimePanel(
            state="collapsed", timeline=layout.timeline, play_state="paused" if layout.n_parts else "following"
        ),
        rrb.BlueprintPanel(state="collapsed" if layout.n_parts else "expanded"),
        rrb.SelectionPanel(state="collapsed"),
    )
