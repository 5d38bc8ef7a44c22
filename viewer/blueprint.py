"""The layout of the view: what a person sees who opens a recording for the first time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fireworld.records import Recording
from viewer import colors
from viewer.legend import LEGEND_PATH
from viewer.mapping import city_box_m
from viewer.plots import COUNTS
from viewer.stage import TIMELINE

STEPS_PER_SECOND: Final = 8.0
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


def _fought_buildings(fieryness: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Buildings that burned, (n,), up to the step at which more than _FOUGHT_BUILDINGS had. (k, n) codes."""
    touched = np.logical_or.accumulate(fieryness != 0, axis=0)
    small = np.flatnonzero(touched.sum(axis=1) <= _FOUGHT_BUILDINGS)
    found: NDArray[np.bool_] = touched[small[-1] if len(small) else 0]
    return found


def single(recording: Recording, *, focus: bool) -> Any:
    """Lay out one recording: the map, the lanes and the legend on the left; curves and the log on the right."""
    import rerun.blueprint as rrb

    left = rrb.Vertical(
        map_view("Fire and brigades", "", frame_fire([recording], aspect=1.8)),
        rrb.Horizontal(lanes("What the brigades do", ""), legend_view(), column_shares=[1, 1]),
        row_shares=[2.6, 1],
    )
    curves: list[Any] = [plot_view("Temperature of the focus", "/plots/focus")] if focus else []
    curves += [plot_view("Buildings", "/plots/buildings"), plot_view("Score", "/plots/score")]
    more = rrb.Tabs(plot_view("Water in tanks (l)", "/plots/tanks"), plot_view("Reward by terms", "/plots/reward"))
    log = rrb.Tabs(text_view("Events and choices", ["+ /log/**"]), help_view())
    right = rrb.Vertical(*curves, more, log, row_shares=[1.0] * len(curves) + [1.0, 1.5])
    return blueprint(rrb.Horizontal(left, right, column_shares=[2.1, 1]))


def pair(first: Recording, second: Recording, *, focus: bool) -> Any:
    """Lay out two recordings of one city: both maps and their difference side by side, curves of both below."""
    import rerun.blueprint as rrb

    camera = frame_fire([first, second], aspect=1.25)
    maps = rrb.Horizontal(
        map_view(f"A: {title(first)}", "/a", camera),
        map_view(f"B: {title(second)}", "/b", camera),
        map_view("Difference: red where B is worse", "/diff", camera),
    )
    top = max(float(np.max(one.column("/score", name))) for one in (first, second) for name in COUNTS)
    curves = [
        plot_view("Burning, extinguished, burnt out: A", "/a/plots/buildings", top=top),
        plot_view("Burning, extinguished, burnt out: B", "/b/plots/buildings", top=top),
        plot_view("Buildings that differ", "/diff/plots/buildings"),
    ]
    details = [
        rrb.Tabs(
            text_view("Events and choices: A", ["+ /a/log/**"]),
            lanes("What the brigades do: A", "/a"),
            *([plot_view("Temperature of the focus: A", "/a/plots/focus")] if focus else []),
        ),
        rrb.Tabs(
            text_view("Events and choices: B", ["+ /b/log/**"]),
            lanes("What the brigades do: B", "/b"),
            *([plot_view("Temperature of the focus: B", "/b/plots/focus")] if focus else []),
        ),
        rrb.Tabs(legend_view(comparing=True), plot_view("Score: A and B", "/diff/plots/score"), help_view()),
    ]
    return blueprint(rrb.Vertical(maps, rrb.Horizontal(*curves), rrb.Horizontal(*details), row_shares=[2.0, 1.0, 1.0]))


def title(recording: Recording) -> str:
    """Scenario, policy and seed of a recording.

    Rerun's viewer stops at a character that its font lacks, so that names from files keep Latin letters only.
    """
    header = recording.header
    text = f"{header.scenario}, {header.policy}, seed {header.seed}"
    return "".join(letter if letter.isprintable() and ord(letter) < 256 else "?" for letter in text)


def blueprint(root: Any) -> Any:
    """Wrap a layout: only the time panel is open, and it plays the steps at a pace that can be followed."""
    import rerun.blueprint as rrb

    return rrb.Blueprint(
        root,
        rrb.TimePanel(state="collapsed", timeline=TIMELINE, fps=STEPS_PER_SECOND, play_state="paused"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
    )


def map_view(name: str, prefix: str, camera: Camera) -> Any:
    """A 3D view of one recording's map. The meshes let clicks through to the handles on the roofs."""
    import rerun.blueprint as rrb

    inert = rrb.EntityBehavior(interactive=False)
    layers = ("city", "team", "civilians", "fire")
    return rrb.Spatial3DView(
        name=name,
        origin=prefix or "/",
        contents=[f"+ {prefix}/{layer}/**" for layer in layers],
        background=colors.BACKGROUND_RGB,
        line_grid=False,
        eye_controls=rrb.EyeControls3D(position=camera.eye_m, look_target=camera.target_m, eye_up=(0.0, 0.0, 1.0)),
        overrides={f"{prefix}/city/{mesh}": inert for mesh in ("buildings", "ground", "streets")},
    )


def plot_view(name: str, origin: str, *, top: float | None = None) -> Any:
    """A view of one plot; from 0 to a top, where plots are to be compared."""
    import rerun.blueprint as rrb

    scale = None if top is None else rrb.ScalarAxis(range=(0.0, max(top, 1.0)))
    legend = rrb.PlotLegend(rrb.Corner2D.LeftTop)
    return rrb.TimeSeriesView(name=name, origin=origin, plot_legend=legend, axis_y=scale)


def lanes(name: str, prefix: str) -> Any:
    """A view of what the brigades do."""
    import rerun.blueprint as rrb

    return rrb.StateTimelineView(name=name, origin=f"{prefix}/activity")


def text_view(name: str, contents: list[str]) -> Any:
    """A view of logs: the step and the text."""
    import rerun.blueprint as rrb

    columns = rrb.TextLogColumns(timeline_columns=[TIMELINE], text_log_columns=["body"])
    return rrb.TextLogView(name=name, origin="/", contents=contents, columns=columns)


def legend_view(*, comparing: bool = False) -> Any:
    """A view of the legend; it has a row more where two runs are compared."""
    import rerun.blueprint as rrb

    bounds = rrb.VisualBounds2D(x_range=(-1.4, 13.0), y_range=(-0.4, 5.9 if comparing else 4.9))
    return rrb.Spatial2DView(
        name="Legend", origin=LEGEND_PATH, background=colors.LEGEND_BACKGROUND_RGB, visual_bounds=bounds
    )


def help_view() -> Any:
    """A view of the help text."""
    import rerun.blueprint as rrb

    return rrb.TextDocumentView(name="How to read this", origin="/help")
