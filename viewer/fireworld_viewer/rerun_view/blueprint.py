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
from fireworld_viewer.rerun_view.brigades import positions_m
from fireworld_viewer.rerun_view.layers import TIMELINE
from fireworld_viewer.rerun_view.pages import HELP_PATH, LEGEND_PATH, OUTCOME_PATH, OutcomePage, bounds
from fireworld_viewer.rerun_view.plots import COUNTS, SCORES, has_choice_values, scale_of
from fireworld_viewer.rerun_view.run_layers import MARK_PATH
from fireworld_viewer.story.series import LABELS, recorded

STEPS_PER_SECOND: Final = 8.0  # a pace that can be followed
LAYERS: Final = ("city", "team", "civilians", "fire")
"""Entity paths of what is on a map; the air has a map of its own."""
ASPECT: Final = (2.0, 1.5)
"""Width of a map by its height, of one run and of each of two."""
_NAME_SHARE: Final = (0.08, 0.12)
"""Width of a name on such a map, on the ground, by the distance of the eye."""
LEGEND_ROOM: Final = 0.45
"""Width of the empty part of a plot, right of the last step, by that of the steps: the legend covers no curve there."""
_LANES_SHOWN: Final = 8
_CURVES_NAMED: Final = 6
"""Rows of a legend that there is room for; in larger teams a click on a curve names it."""
_MARGIN_M: Final = 25.0
_HEIGHT_M: Final = 45.0  # of what stands on the ground: houses, brigades with their gauges, names of refuges
_LEAST_DISTANCE_M: Final = 100.0
_UP, _SOUTH = math.sin(math.radians(56.0)), math.cos(math.radians(56.0))
"""The direction from the fire to the camera."""
_SLOPE: Final = math.tan(math.radians(55.0 / 2))
"""Half the height of a fresh Rerun view's field of view, by the distance."""


def single(recording: Recording, *, focus: bool, outcome: OutcomePage | None = None) -> Any:
    """Lay out one recording: map, timelines and log on the left; curves, with `focus` temperatures, on the right."""
    log = rrb.Tabs(text_view("Step: events and choices", "/log/**"), *pages(outcome), active_tab=0)
    rows, shares = [maps("Fire and brigades", "", [recording], aspect=ASPECT[0]), log], [2.5, 1.0]
    states = state_views("", "", recording)
    if states:
        n_lanes = min(len(recording.city.brigade_tank_litres), _LANES_SHOWN)
        rows.insert(1, rrb.Tabs(*states, active_tab=0))
        shares.insert(1, 0.4 + 0.2 * n_lanes)
    left = rrb.Vertical(*rows, row_shares=shares)
    plots = [counts_view("", [""], recording), *plot_tabs("", [""], recording, focus=focus)]
    right = rrb.Vertical(*plots, legend_view(), row_shares=[1.0] * len(plots) + [1.3])
    return blueprint(rrb.Horizontal(left, right, column_shares=[1.8, 1]))


def pair(first: Recording, second: Recording, *, focus: bool, outcome: OutcomePage | None = None) -> Any:
    """Lay out two recordings of one city, A and B: both maps and their difference side by side, curves below."""
    both = [first, second]
    row_of_maps = rrb.Horizontal(
        maps(f"A: {title(first)}", "/a", both, aspect=ASPECT[1]),
        maps(f"B: {title(second)}", "/b", both, aspect=ASPECT[1]),
        map_view("Difference: orange where B is worse", "/diff", frame_all(both, aspect=ASPECT[1])),
    )
    begin = None if outcome is None else outcome.first_step
    mark = [] if begin is None else [MARK_PATH]
    sides = ["/a", "/b"]
    differing = plot_view("Buildings that differ in B", ["/diff/plots/buildings", *mark], span=_span(both))
    plots = [counts_view(": A and B", sides, *both), *plot_tabs(": A and B", sides, *both, focus=focus), differing]
    logged = [path.replace("plots", "log") for path in mark]
    details = [
        rrb.Tabs(
            text_view(f"{name}, step: events and choices", f"{prefix}/log/**", *logged),
            *state_views(f": {name}", prefix, recording),
            tanks_view(f": {name}", [prefix], recording),
            active_tab=0,
        )
        for name, prefix, recording in (("A", "/a", first), ("B", "/b", second))
    ]
    words = rrb.Tabs(*pages(outcome)[:-1], legend_view(comparing=True), *pages(outcome)[-1:], active_tab=0)
    rows = [row_of_maps, rrb.Horizontal(*plots, words), rrb.Horizontal(*details)]
    shares = [2.1, 1.1, 1.1]
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
        map_view(name, prefix, frame_all(recordings, aspect=aspect)),
        map_view("From above", prefix, above),
        *([map_view(air, prefix, above, layers=("city", "air"))] if has_air else []),
        active_tab=0,
    )


def counts_view(suffix: str, prefixes: Sequence[str], *recordings: Recording) -> Any:
    """Lay out how many buildings burn and so on: three curves of one run in a plot; of two runs a plot for each."""
    span = _span(recordings)
    if len(prefixes) == 1:
        return plot_view("Buildings", [f"{prefixes[0]}/plots/{path}" for path in COUNTS], span=span)
    plots = [
        plot_view(f"{LABELS[field].capitalize()}{suffix}", [f"{prefix}/plots/{path}" for prefix in prefixes], span=span)
        for path, field in COUNTS.items()
    ]
    return rrb.Tabs(*plots, active_tab=0)


def plot_tabs(suffix: str, prefixes: Sequence[str], *recordings: Recording, focus: bool) -> list[Any]:
    """Lay out curves of one or two runs in tabs: temperatures, water and values of choices, and the outcome."""
    span = _span(recordings)

    def curves(name: str, plot: str, field: str = "") -> Any:
        scale = scale_of(recordings, field) if field and span is not None else None
        paths = [f"{prefix}/plots/{plot}" for prefix in prefixes]
        return plot_view(f"{name}{suffix}", paths, span=span, scale=scale, named=not field or len(prefixes) > 1)

    heat = [curves("Degrees above ambient", "focus")] if focus else []
    outcome = [curves("Score", "score", SCORES["score"])]
    rewarded = any(recorded(one, "rewards") for one in recordings)
    outcome += [curves("Reward by terms", "reward")] if rewarded else []
    outcome += [curves("Reward, stacked", "reward_stacked")] if rewarded and len(prefixes) == 1 else []
    if all(recorded(one, SCORES["score_now"]) for one in recordings):
        outcome.append(curves("Score by today's rule", "score_now", SCORES["score_now"]))
    paths = [f"{prefix}/plots/{plot}/**" for prefix in prefixes for plot in ("values", "values_best")]
    named = _few_brigades(*recordings)
    values = plot_view(f"Values of choices; thin: best{suffix}", paths, span=span, named=named)
    chosen = [values] if any(map(has_choice_values, recordings)) else []
    if len(prefixes) > 1:
        return [rrb.Tabs(*outcome, *heat, *chosen, active_tab=0)]
    water = tanks_view(suffix, prefixes, *recordings)
    return [rrb.Tabs(*outcome, active_tab=0), rrb.Tabs(water, *heat, *chosen, active_tab=0)]


def tanks_view(suffix: str, prefixes: Sequence[str], *recordings: Recording) -> Any:
    """Return a view of the water in the tanks."""
    paths = [f"{prefix}/plots/tanks" for prefix in prefixes]
    return plot_view(f"Water in tanks (l){suffix}", paths, span=_span(recordings), named=_few_brigades(*recordings))


def _few_brigades(*recordings: Recording) -> bool:
    return max(len(one.city.brigade_tank_litres) for one in recordings) <= _CURVES_NAMED


def _span(recordings: Sequence[Recording]) -> tuple[int, int] | None:
    """Return the first and the last step; None of a run that is only at its first: more may come."""
    steps = np.concatenate([one.steps for one in recordings])
    return (int(steps.min()), int(steps.max())) if len(np.unique(steps)) > 1 else None


def state_views(suffix: str, prefix: str, recording: Recording) -> list[Any]:
    """Lay out what the brigades do and which actions they chose, as far as that is recorded."""
    lanes = [f"brigade_{brigade}" for brigade in range(len(recording.city.brigade_tank_litres))]
    views = {
        "What the brigades do": ("brigades.activity", ""),
        "What they chose": ("decisions.action", "chosen/"),
    }
    return [
        rrb.StateTimelineView(
            name=f"{name}{suffix}", origin=prefix or "/", contents=[f"+ {prefix}/{below}{lane}" for lane in lanes]
        )
        for name, (field, below) in views.items()
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


def plot_view(
    name: str,
    paths: Sequence[str],
    *,
    span: tuple[int, int] | None,
    scale: tuple[float, float] | None = None,
    named: bool = True,
) -> Any:
    """Return a view of the curves at some paths, all on one scale.

    Args:
        name: its title.
        paths: of the curves.
        span: first and last step, or None where more steps come; right of the last one is room for the legend.
        scale: ends of the vertical axis; None: from the curves.
        named: there is a legend.
    """
    axis = None
    if span is not None:
        end = span[1] + math.ceil(LEGEND_ROOM * (span[1] - span[0])) if named else span[1]
        bounds = (rrb.TimeRangeBoundary.absolute(seq=step) for step in (span[0], end))
        axis = rrb.TimeAxis(view_range=rrb.TimeRange(*bounds))
    return rrb.TimeSeriesView(
        name=name,
        origin="/",
        contents=[f"+ {path}" for path in paths],
        plot_legend=rrb.PlotLegend(rrb.Corner2D.RightTop, visible=named),
        axis_x=axis,
        axis_y=None if scale is None else rrb.ScalarAxis(range=scale),
    )


def text_view(name: str, *paths: str) -> Any:
    """Return a view of the logs at some paths; each line begins with its step."""
    step = rrb.encodings.TimelineColumn(TIMELINE, visible=False)
    columns = rrb.TextLogColumns(timeline_columns=[step], text_log_columns=["body"])
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


def frame_all(recordings: Sequence[Recording], *, aspect: float) -> Camera:
    """Look from the south, from above, at all that burns and all places of the brigades, or else at the whole city.

    aspect: width of the view by its height.
    """
    city = recordings[0].city
    corners = np.array(city_box_m(city))
    places = [place for one in recordings for place in _places_m(one)]
    if any(map(len, places)):
        every = np.concatenate(places)
        corners = np.array([every.min(axis=0) - _MARGIN_M, every.max(axis=0) + _MARGIN_M])
    (west, south), (east, north) = corners.tolist()
    x_m, half_width_m = (west + east) / 2, (east - west) / 2
    edges = [(y, z) for y in (south, north) for z in (0.0, _HEIGHT_M)]

    def distance_m(y_m: float) -> float:
        """Return how far the eye must be from a place on the ground for both edges and what stands on them."""
        far_m = [
            max(half_width_m / aspect, abs((y - y_m) * _UP + z * _SOUTH)) / _SLOPE - (y - y_m) * _SOUTH + z * _UP
            for y, z in edges
        ]
        return float(max(far_m))

    # The near edge of the ground is seen larger than the far one, so that the middle of the picture is nearer.
    y_m = min(np.linspace(south, north, 41).tolist(), key=distance_m)
    far_m = max(distance_m(y_m), _LEAST_DISTANCE_M)
    return Camera(eye_m=(x_m, y_m - far_m * _SOUTH, far_m * _UP), target_m=(x_m, y_m, 0.0))


def names_apart_m(recordings: Sequence[Recording]) -> float:
    """Return how far apart brigades must be, at the first look, for their names not to cover each other."""
    camera = frame_all(recordings, aspect=ASPECT[len(recordings) > 1])
    return math.dist(camera.eye_m, camera.target_m) * _NAME_SHARE[len(recordings) > 1]


def _places_m(recording: Recording) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the buildings that ever burn or are wet, and where brigades are drawn: (k, 2) and (m, 2)."""
    city = recording.city
    touched = np.any(recording.column("/buildings", "fieryness") != 0, axis=0)
    buildings = np.column_stack([city.center_x_m, city.center_y_m])[touched]
    return buildings, positions_m(recording)[..., :2].reshape(-1, 2).astype(np.float64)


def frame_from_above(low: ArrayLike, high: ArrayLike, *, aspect: float) -> Camera:
    """Look straight down, north up, on a box between its south-west and its north-east corner in metres."""
    (x_m, y_m), (half_width_m, half_depth_m) = _middle_and_halves(low, high)
    far_m = 1.08 * max(half_width_m / (_SLOPE * aspect), half_depth_m / _SLOPE, _LEAST_DISTANCE_M)
    return Camera(eye_m=(x_m, y_m, far_m), target_m=(x_m, y_m, 0.0), up=(0.0, 1.0, 0.0))


def _middle_and_halves(low: ArrayLike, high: ArrayLike) -> list[list[float]]:
    ends = np.array([low, high])
    return [(ends.sum(axis=0) / 2).tolist(), ((ends[1] - ends[0]) / 2).tolist()]
