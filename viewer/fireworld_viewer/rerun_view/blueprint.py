"""The layout of the view: what a person sees who opens a recording for the first time, and from where."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import rerun.blueprint as rrb
from numpy.typing import ArrayLike, NDArray
from rerun.encodings import AbsoluteTimeRange

from fireworld.records import SNAPSHOT_EVERY_STEPS, Recording
from fireworld_viewer import colors
from fireworld_viewer.city_mesh import city_box_m
from fireworld_viewer.rerun_view.layers import TIMELINE
from fireworld_viewer.rerun_view.pages import HELP_PATH, LEGEND_PATH, OUTCOME_PATH, OutcomePage, bounds
from fireworld_viewer.rerun_view.plots import has_choice_values
from fireworld_viewer.rerun_view.run_layers import MARK_PATH
from fireworld_viewer.story.series import recorded

STEPS_PER_SECOND: Final = 8.0  # a pace that can be followed
LAYERS: Final = ("city", "team", "civilians", "fire")
"""Entity paths of what is on a map; the air has a map of its own."""
_MARGIN_M: Final = 45.0
_FOUGHT_BUILDINGS: Final = 60
_LEAST_DISTANCE_M: Final = 100.0
_UP, _SOUTH = math.sin(math.radians(56.0)), math.cos(math.radians(56.0))
"""The direction from the fire to the camera."""
_SLOPE: Final = math.tan(math.radians(55.0 / 2))
"""Half the height of a fresh Rerun view's field of view, by the distance."""


def single(recording: Recording, *, focus: bool, outcome: OutcomePage | None = None) -> Any:
    """Lay out one recording: map, timelines and log on the left; curves, with `focus` temperatures, on the right."""
    log = rrb.Tabs(text_view("Events and choices", "/log/**"), *pages(outcome), active_tab=0)
    states = state_views("", "", recording)
    below = rrb.Horizontal(rrb.Tabs(*states, active_tab=0), log, column_shares=[1, 1.4]) if states else log
    left = rrb.Vertical(maps("Fire and brigades", "", [recording], aspect=1.8), below, row_shares=[2.6, 1])
    rows = [plot_view("Buildings", ["/plots/buildings"]), *plot_tabs("", [""], recording, focus=focus), legend_view()]
    right = rrb.Vertical(*rows, row_shares=[1.0] * (len(rows) - 1) + [1.9])
    return blueprint(rrb.Horizontal(left, right, column_shares=[1.8, 1]))


def pair(first: Recording, second: Recording, *, focus: bool, outcome: OutcomePage | None = None) -> Any:
    """Lay out two recordings of one city, A and B: both maps and their difference side by side, curves below."""
    both = [first, second]
    row_of_maps = rrb.Horizontal(
        maps(f"A: {title(first)}", "/a", both, aspect=1.25),
        maps(f"B: {title(second)}", "/b", both, aspect=1.25),
        map_view("Difference: red where B is worse", "/diff", frame_fire(both, aspect=1.25)),
    )
    begin = None if outcome is None else outcome.first_step
    mark = [] if begin is None else [MARK_PATH]
    curves = [
        plot_view("Buildings: A and B", ["/a/plots/buildings", "/b/plots/buildings", *mark]),
        *plot_tabs(": A and B", ["/a", "/b"], *both, focus=focus)[:1],
        plot_view("Buildings that differ", ["/diff/plots/buildings", *mark]),
    ]
    logged = [path.replace("plots", "log") for path in mark]
    details = [
        rrb.Tabs(
            text_view(f"Events and choices: {name}", f"{prefix}/log/**", *logged),
            *state_views(f": {name}", prefix, recording),
            plot_view(f"Water in tanks (l): {name}", [f"{prefix}/plots/tanks"]),
            active_tab=0,
        )
        for name, prefix, recording in (("A", "/a", first), ("B", "/b", second))
    ]
    *outcome_page, help_page = pages(outcome)
    curves += outcome_page
    details.append(rrb.Tabs(legend_view(comparing=True), help_page, active_tab=0))
    rows = [row_of_maps, rrb.Horizontal(*curves), rrb.Horizontal(*details)]
    shares = [1.8, 1.05, 1.3]
    if outcome is not None:
        rows.insert(1, rrb.StateTimelineView(name="Are A and B the same?", origin="/diff/agreement"))
        shares.insert(1, 0.5)
    last = max(int(one.steps[-1]) for one in both)
    return blueprint(rrb.Vertical(*rows, row_shares=shares), marked=None if begin is None else (begin, last))


def maps(name: str, prefix: str, recordings: Sequence[Recording], *, aspect: float) -> Any:
    """Lay out the map of one run in three ways: at an angle, from straight above, and with the heat of the air."""
    above = frame_from_above(*city_box_m(recordings[0].city), aspect=aspect)
    every_step = all(record.snapshot for recording in recordings for record in recording)
    n_steps = sum(len(recording.steps) for recording in recordings)
    air = "Air" if every_step and n_steps > 1 else f"Air (every {SNAPSHOT_EVERY_STEPS} steps)"
    has_air = any(recorded(recording, "snapshot") for recording in recordings)
    return rrb.Tabs(
        map_view(name, prefix, frame_fire(recordings, aspect=aspect)),
        map_view("From above", prefix, above),
        *([map_view(air, prefix, above, layers=("city", "air"))] if has_air else []),
        active_tab=0,
    )


def plot_tabs(suffix: str, prefixes: Sequence[str], *recordings: Recording, focus: bool) -> list[Any]:
    """Lay out curves of one or two runs in tabs: outcome and temperatures, then water and values of choices."""

    def curves(name: str, plot: str, corner: str) -> Any:
        return plot_view(f"{name}{suffix}", [f"{prefix}/plots/{plot}" for prefix in prefixes], corner=corner)

    heat = [curves("Degrees above ambient", "focus", "RightTop")] if focus else []
    outcome = [curves("Score", "score", "LeftBottom")]
    rewarded = any(recorded(one, "rewards") for one in recordings)
    outcome += [curves("Reward by terms", "reward", "LeftBottom")] if rewarded else []
    paths = [f"{prefix}/plots/{plot}/**" for prefix in prefixes for plot in ("values", "values_best")]
    values = plot_view(f"Values of choices{suffix}", paths, corner="RightBottom")
    chosen = [values] if any(map(has_choice_values, recordings)) else []
    if len(prefixes) > 1:
        return [rrb.Tabs(*outcome, *heat, *chosen, active_tab=0)]
    outcome += [curves("Reward, stacked", "reward_stacked", "LeftBottom")] if rewarded else []
    water = curves("Water in tanks (l)", "tanks", "RightTop")
    return [*heat, rrb.Tabs(*outcome, active_tab=0), rrb.Tabs(water, *chosen, active_tab=0)]


def state_views(suffix: str, prefix: str, recording: Recording) -> list[Any]:
    """Lay out what the brigades do and which actions they chose, as far as that is recorded."""
    titles = {
        "activity": ("What the brigades do", "brigades.activity"),
        "action": ("What they chose", "decisions.action"),
    }
    return [
        rrb.StateTimelineView(name=f"{name}{suffix}", origin=f"{prefix}/{path}")
        for path, (name, field) in titles.items()
        if recorded(recording, field)
    ]


def pages(outcome: OutcomePage | None) -> list[Any]:
    """Lay out the pages of text: the outcome, if there is one, and the help."""
    found = [] if outcome is None else [rrb.TextDocumentView(name="Outcome", origin=OUTCOME_PATH)]
    return [*found, rrb.TextDocumentView(name="How to read this", origin=HELP_PATH)]


def title(recording: Recording) -> str:
    """Return scenario, policy and seed of a recording.

    Rerun's viewer stops at a character that its font lacks, so that names from files keep Latin letters only.
    """
    text = recording.header.title
    return "".join(letter if letter.isprintable() and ord(letter) < 256 else "?" for letter in text)


def blueprint(root: Any, *, marked: tuple[int, int] | None = None) -> Any:
    """Wrap a layout: only the time panel is open; steps from the first to the last of `marked` are marked on it."""
    time = rrb.TimePanel(
        state="collapsed",
        timeline=TIMELINE,
        fps=STEPS_PER_SECOND,
        play_state="paused",
        time_selection=None if marked is None else AbsoluteTimeRange(*marked),
    )
    others = rrb.BlueprintPanel(state="collapsed"), rrb.SelectionPanel(state="collapsed")
    return rrb.Blueprint(root, time, *others, auto_views=False)


def following(layout: Any, *, listed: bool) -> Any:
    """Keep the time cursor of a layout at the newest step; `listed` opens the list of recordings. Return the layout."""
    layout.time_panel.play_state = "following"
    if listed:
        layout.blueprint_panel = rrb.BlueprintPanel(state="expanded")
    return layout


def map_view(name: str, prefix: str, camera: Camera, *, layers: Sequence[str] = LAYERS) -> Any:
    """Return a 3D view of one recording's map. The meshes let clicks through to the handles on the roofs."""
    inert = rrb.EntityBehavior(interactive=False)
    return rrb.Spatial3DView(
        name=name,
        origin=prefix or "/",
        contents=[f"+ {prefix}/{layer}/**" for layer in layers],
        background=colors.BACKGROUND_RGB,
        line_grid=False,
        eye_controls=rrb.EyeControls3D(position=camera.eye_m, look_target=camera.target_m, eye_up=camera.up),
        overrides={f"{prefix}/city/{mesh}": inert for mesh in ("buildings", "ground", "streets")},
    )


def plot_view(name: str, paths: Sequence[str], *, corner: str = "LeftTop") -> Any:
    """Return a view of the curves at some paths, all on one scale; the legend is where curves seldom come."""
    legend = rrb.PlotLegend(rrb.Corner2D[corner])
    return rrb.TimeSeriesView(name=name, origin="/", contents=[f"+ {path}" for path in paths], plot_legend=legend)


def text_view(name: str, *paths: str) -> Any:
    """Return a view of the logs at some paths: the step and the text."""
    columns = rrb.TextLogColumns(timeline_columns=[TIMELINE], text_log_columns=["body"])
    return rrb.TextLogView(name=name, origin="/", contents=[f"+ {path}" for path in paths], columns=columns)


def legend_view(*, comparing: bool = False) -> Any:
    """Return a view of the legend; it has a row more where two runs are compared."""
    x_range, y_range = bounds(comparing=comparing)
    return rrb.Spatial2DView(
        name="Legend",
        origin=LEGEND_PATH,
        background=colors.LEGEND_BACKGROUND_RGB,
        visual_bounds=rrb.VisualBounds2D(x_range=x_range, y_range=y_range),
    )


@dataclass(frozen=True)
class Camera:
    """Where the eye is and what it looks at, in metres."""

    eye_m: tuple[float, float, float]
    target_m: tuple[float, float, float]
    up: tuple[float, float, float] = (0.0, 0.0, 1.0)  # what is up in the picture


def frame_fire(recordings: Sequence[Recording], *, aspect: float) -> Camera:
    """Look from the south, from above, at the fire while it can still be fought, or at the whole city without one.

    aspect: width of the view by its height.
    """
    city = recordings[0].city
    low, high = map(np.array, city_box_m(city))
    fought = np.any([_fought_buildings(one.column("/buildings", "fieryness")) for one in recordings], axis=0)
    if fought.any():
        center = np.column_stack([city.center_x_m, city.center_y_m])[fought]
        low = np.maximum(low, center.min(axis=0) - _MARGIN_M)
        high = np.minimum(high, center.max(axis=0) + _MARGIN_M)
    (x_m, y_m), (half_width_m, half_depth_m) = _middle_and_halves(low, high)
    # The near edge of the ground is closer to the eye than its middle, and seen larger.
    seen_m = max(half_width_m / (_SLOPE * aspect), half_depth_m * _UP / _SLOPE, _LEAST_DISTANCE_M)
    far_m = 1.06 * seen_m + half_depth_m * _SOUTH
    return Camera(eye_m=(x_m, y_m - far_m * _SOUTH, far_m * _UP), target_m=(x_m, y_m, 0.0))


def frame_from_above(low: ArrayLike, high: ArrayLike, *, aspect: float) -> Camera:
    """Look straight down, north up, on a box between its south-west and its north-east corner in metres."""
    (x_m, y_m), (half_width_m, half_depth_m) = _middle_and_halves(low, high)
    far_m = 1.08 * max(half_width_m / (_SLOPE * aspect), half_depth_m / _SLOPE, _LEAST_DISTANCE_M)
    return Camera(eye_m=(x_m, y_m, far_m), target_m=(x_m, y_m, 0.0), up=(0.0, 1.0, 0.0))


def _middle_and_halves(low: ArrayLike, high: ArrayLike) -> list[list[float]]:
    ends = np.array([low, high])
    return [(ends.sum(axis=0) / 2).tolist(), ((ends[1] - ends[0]) / 2).tolist()]


def _fought_buildings(fieryness: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Return which buildings burned, (n,), up to the step at which more than _FOUGHT_BUILDINGS had. (k, n) codes."""
    touched = np.logical_or.accumulate(fieryness != 0, axis=0)
    small = np.flatnonzero(touched.sum(axis=1) <= _FOUGHT_BUILDINGS)
    found: NDArray[np.bool_] = touched[small[-1] if len(small) else 0]
    return found
