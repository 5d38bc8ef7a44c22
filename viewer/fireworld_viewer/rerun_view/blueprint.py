"""The layout of the view: what a person sees who opens a recording for the first time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fireworld.records import SNAPSHOT_EVERY_STEPS, Recording
from fireworld_viewer import colors
from fireworld_viewer.rerun_view.comparison import MARK_PATH
from fireworld_viewer.rerun_view.layers import TIMELINE
from fireworld_viewer.rerun_view.legend_page import HELP_PATH, LEGEND_PATH, bounds
from fireworld_viewer.rerun_view.mapping import city_box_m
from fireworld_viewer.rerun_view.outcome_panel import OUTCOME_PATH, Outcome
from fireworld_viewer.rerun_view.plots import has_choice_values

STEPS_PER_SECOND: Final = 8.0
LAYERS: Final = ("city", "team", "civilians", "fire")
"""Entity paths of what is on a map; the air has a map of its own."""
_MARGIN_M: Final = 45.0
_FOUGHT_BUILDINGS: Final = 60
_LEAST_DISTANCE_M: Final = 100.0
_ELEVATION_DEGREES: Final = 56.0
_FIELD_OF_VIEW_DEGREES: Final = 55.0
"""Height of a fresh Rerun view's field of view."""


@dataclass(frozen=True)
class Camera:
    """Where the eye is and what it looks at, in metres."""

    eye_m: tuple[float, float, float]
    target_m: tuple[float, float, float]
    up: tuple[float, float, float] = (0.0, 0.0, 1.0)
    """What is up in the picture."""


def frame_fire(recordings: Sequence[Recording], *, aspect: float) -> Camera:
    """Look from the south, from above, at the fire while it can still be fought, or at the whole city without one.

    Args:
        recordings: runs in one city.
        aspect: width of the view by its height.
    """
    city = recordings[0].city
    low, high = city_box_m(city, margin_m=0.0)
    fought = np.zeros(len(city.building_id), dtype=bool)
    for recording in recordings:
        fought |= _fought_buildings(recording.column("/buildings", "fieryness"))
    if fought.any():
        x, y = np.asarray(city.center_x_m)[fought], np.asarray(city.center_y_m)[fought]
        low = (max(low[0], float(x.min()) - _MARGIN_M), max(low[1], float(y.min()) - _MARGIN_M))
        high = (min(high[0], float(x.max()) + _MARGIN_M), min(high[1], float(y.max()) + _MARGIN_M))
    half_width_m, half_depth_m = (high[0] - low[0]) / 2, (high[1] - low[1]) / 2
    slope = math.tan(math.radians(_FIELD_OF_VIEW_DEGREES / 2))
    up, south = math.sin(math.radians(_ELEVATION_DEGREES)), math.cos(math.radians(_ELEVATION_DEGREES))
    # The near edge of the ground is closer to the eye than its middle, and seen larger.
    far_m = (
        1.06 * max(half_width_m / (slope * aspect), half_depth_m * up / slope, _LEAST_DISTANCE_M) + half_depth_m * south
    )
    x_m, y_m = (low[0] + high[0]) / 2, (low[1] + high[1]) / 2
    return Camera(eye_m=(x_m, y_m - far_m * south, far_m * up), target_m=(x_m, y_m, 0.0))


def frame_from_above(low: tuple[float, float], high: tuple[float, float], *, aspect: float) -> Camera:
    """Look straight down on a box given by its south-west and north-east corners in metres, north up.

    Args:
        low: south-west corner.
        high: north-east corner.
        aspect: width of the view by its height.
    """
    slope = math.tan(math.radians(_FIELD_OF_VIEW_DEGREES / 2))
    half_width_m, half_depth_m = (high[0] - low[0]) / 2, (high[1] - low[1]) / 2
    far_m = 1.08 * max(half_width_m / (slope * aspect), half_depth_m / slope, _LEAST_DISTANCE_M)
    x_m, y_m = (low[0] + high[0]) / 2, (low[1] + high[1]) / 2
    return Camera(eye_m=(x_m, y_m, far_m), target_m=(x_m, y_m, 0.0), up=(0.0, 1.0, 0.0))


def _fought_buildings(fieryness: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Buildings that burned, (n,), up to the step at which more than _FOUGHT_BUILDINGS had. (k, n) codes."""
    touched = np.logical_or.accumulate(fieryness != 0, axis=0)
    small = np.flatnonzero(touched.sum(axis=1) <= _FOUGHT_BUILDINGS)
    found: NDArray[np.bool_] = touched[small[-1] if len(small) else 0]
    return found


def single(recording: Recording, *, focus: bool, outcome: Outcome | None = None) -> Any:
    """Lay out one recording: the map, the lanes and the legend on the left; curves and the log on the right.

    Args:
        recording: what is shown.
        focus: whether temperatures are plotted.
        outcome: there is a page of it if it is given.
    """
    import rerun.blueprint as rrb

    log = rrb.Tabs(text_view("Events and choices", ["+ /log/**"]), *pages(outcome), active_tab=0)
    left = rrb.Vertical(
        maps("Fire and brigades", "", [recording], aspect=1.8),
        rrb.Horizontal(lane_views("", ""), log, column_shares=[1, 1.4]),
        row_shares=[2.6, 1],
    )
    rows = [plot_view("Buildings", ["/plots/buildings"]), *plot_tabs("", [""], recording, focus=focus), legend_view()]
    right = rrb.Vertical(*rows, row_shares=[1.0] * (len(rows) - 1) + [1.9])
    return blueprint(rrb.Horizontal(left, right, column_shares=[1.8, 1]))


def pair(first: Recording, second: Recording, *, focus: bool, outcome: Outcome | None = None) -> Any:
    """Lay out two recordings of one city: both maps and their difference side by side, curves of both below.

    Args:
        first: called A.
        second: called B.
        focus: whether temperatures are plotted.
        outcome: there is a page of it, and the first difference is marked, if it is given.
    """
    import rerun.blueprint as rrb

    both = [first, second]
    row_of_maps = rrb.Horizontal(
        maps(f"A: {title(first)}", "/a", both, aspect=1.25),
        maps(f"B: {title(second)}", "/b", both, aspect=1.25),
        map_view("Difference: red where B is worse", "/diff", frame_fire(both, aspect=1.25)),
    )
    mark = [MARK_PATH] if outcome is not None and outcome.first_step is not None else []
    curves = [
        plot_view("Buildings: A and B", ["/a/plots/buildings", "/b/plots/buildings", *mark]),
        *plot_tabs(": A and B", ["/a", "/b"], *both, focus=focus)[:1],
        plot_view("Buildings that differ", ["/diff/plots/buildings", *mark]),
    ]
    said = [f"+ {MARK_PATH.replace('plots', 'log')}"] if mark else []
    details = [
        rrb.Tabs(
            text_view(f"Events and choices: {name}", [f"+ {prefix}/log/**", *said]),
            *lane_views(f": {name}", prefix).contents,
            plot_view(f"Water in tanks (l): {name}", [f"{prefix}/plots/tanks"]),
            active_tab=0,
        )
        for name, prefix in (("A", "/a"), ("B", "/b"))
    ]
    *outcome_page, help_page = pages(outcome)
    curves += outcome_page
    details.append(rrb.Tabs(legend_view(comparing=True), help_page, active_tab=0))
    rows = [row_of_maps, rrb.Horizontal(*curves), rrb.Horizontal(*details)]
    shares = [1.8, 1.05, 1.3]
    if outcome is not None:
        rows.insert(1, rrb.StateTimelineView(name="Are A and B the same?", origin="/diff/agreement"))
        shares.insert(1, 0.5)
    begin = None if outcome is None else outcome.first_step
    last = max(int(one.steps[-1]) for one in both)
    return blueprint(rrb.Vertical(*rows, row_shares=shares), marked=None if begin is None else (begin, last))


def maps(name: str, prefix: str, recordings: Sequence[Recording], *, aspect: float) -> Any:
    """The map of one run in three ways: at an angle, from straight above, and with the heat of the air."""
    import rerun.blueprint as rrb

    low, high = city_box_m(recordings[0].city, margin_m=0.0)
    above = frame_from_above(low, high, aspect=aspect)
    return rrb.Tabs(
        map_view(name, prefix, frame_fire(recordings, aspect=aspect)),
        map_view("From above", prefix, above),
        map_view(_air_title(recordings), prefix, above, layers=("city", "air")),
        active_tab=0,
    )


def _air_title(recordings: Sequence[Recording]) -> str:
    steps = [record for recording in recordings for record in recording]
    return (
        "Air"
        if len(steps) > 1 and all(record.snapshot for record in steps)
        else f"Air (every {SNAPSHOT_EVERY_STEPS} steps)"
    )


def plot_tabs(suffix: str, prefixes: Sequence[str], *recordings: Recording, focus: bool) -> list[Any]:
    """Curves of one or two runs, in tabs: outcome and temperatures, then water and values of choices."""
    import rerun.blueprint as rrb

    def curves(name: str, plot: str, corner: str) -> Any:
        return plot_view(f"{name}{suffix}", [f"{prefix}/plots/{plot}" for prefix in prefixes], corner=corner)

    single_run = len(prefixes) == 1
    heat = [curves("Degrees above ambient", "focus", "RightTop")] if focus else []
    outcome = [curves("Score", "score", "LeftBottom"), curves("Reward by terms", "reward", "LeftBottom")]
    outcome += [curves("Reward, stacked", "reward_stacked", "LeftBottom")] if single_run else []
    weighed = [f"{prefix}/plots/{plot}/**" for prefix in prefixes for plot in ("values", "values_best")]
    values = plot_view(f"Values of choices{suffix}", weighed, corner="RightBottom")
    chosen = [values] if any(map(has_choice_values, recordings)) else []
    water = [curves("Water in tanks (l)", "tanks", "RightTop")] if single_run else []
    if not single_run:
        return [rrb.Tabs(*outcome, *heat, *chosen, active_tab=0)]
    return [*heat, rrb.Tabs(*outcome, active_tab=0), rrb.Tabs(*water, *chosen, active_tab=0)]


def lane_views(suffix: str, prefix: str) -> Any:
    """What the brigades do and which action they follow, in tabs."""
    import rerun.blueprint as rrb

    return rrb.Tabs(
        rrb.StateTimelineView(name=f"What the brigades do{suffix}", origin=f"{prefix}/activity"),
        rrb.StateTimelineView(name=f"What they chose{suffix}", origin=f"{prefix}/action"),
        active_tab=0,
    )


def pages(outcome: Outcome | None) -> list[Any]:
    """The pages of text: the outcome, if there is one, and the help."""
    import rerun.blueprint as rrb

    found = [] if outcome is None else [rrb.TextDocumentView(name="Outcome", origin=OUTCOME_PATH)]
    return [*found, rrb.TextDocumentView(name="How to read this", origin=HELP_PATH)]


def title(recording: Recording) -> str:
    """Scenario, policy and seed of a recording.

    Rerun's viewer stops at a character that its font lacks, so that names from files keep Latin letters only.
    """
    header = recording.header
    text = f"{header.scenario}, {header.policy}, seed {header.seed}"
    return "".join(letter if letter.isprintable() and ord(letter) < 256 else "?" for letter in text)


def blueprint(root: Any, *, marked: tuple[int, int] | None = None) -> Any:
    """Wrap a layout: only the time panel is open, and it plays the steps at a pace that can be followed.

    Args:
        root: the layout.
        marked: first and last of the steps that are marked on the time panel.
    """
    import rerun.blueprint as rrb
    from rerun.encodings import AbsoluteTimeRange

    selection = None if marked is None else AbsoluteTimeRange(*marked)
    time = rrb.TimePanel(
        state="collapsed", timeline=TIMELINE, fps=STEPS_PER_SECOND, play_state="paused", time_selection=selection
    )
    return rrb.Blueprint(
        root, time, rrb.BlueprintPanel(state="collapsed"), rrb.SelectionPanel(state="collapsed"), auto_views=False
    )


def map_view(name: str, prefix: str, camera: Camera, *, layers: Sequence[str] = LAYERS) -> Any:
    """A 3D view of one recording's map. The meshes let clicks through to the handles on the roofs."""
    import rerun.blueprint as rrb

    inert = rrb.EntityBehavior(interactive=False)
    eye = rrb.EyeControls3D(position=camera.eye_m, look_target=camera.target_m, eye_up=camera.up)
    return rrb.Spatial3DView(
        name=name,
        origin=prefix or "/",
        contents=[f"+ {prefix}/{layer}/**" for layer in layers],
        background=colors.BACKGROUND_RGB,
        line_grid=False,
        eye_controls=eye,
        overrides={f"{prefix}/city/{mesh}": inert for mesh in ("buildings", "ground", "streets")},
    )


def plot_view(name: str, paths: Sequence[str], *, corner: str = "LeftTop") -> Any:
    """A view of the curves at some paths, all on one scale; the legend is in the corner where they seldom come."""
    import rerun.blueprint as rrb

    legend = rrb.PlotLegend(rrb.Corner2D[corner])
    contents = [f"+ {path}" for path in paths]
    return rrb.TimeSeriesView(name=name, origin="/", contents=contents, plot_legend=legend)


def text_view(name: str, contents: list[str]) -> Any:
    """A view of logs: the step and the text."""
    import rerun.blueprint as rrb

    columns = rrb.TextLogColumns(timeline_columns=[TIMELINE], text_log_columns=["body"])
    return rrb.TextLogView(name=name, origin="/", contents=contents, columns=columns)


def legend_view(*, comparing: bool = False) -> Any:
    """A view of the legend; it has a row more where two runs are compared."""
    import rerun.blueprint as rrb

    x_range, y_range = bounds(comparing=comparing)
    return rrb.Spatial2DView(
        name="Legend",
        origin=LEGEND_PATH,
        background=colors.LEGEND_BACKGROUND_RGB,
        visual_bounds=rrb.VisualBounds2D(x_range=x_range, y_range=y_range),
    )
