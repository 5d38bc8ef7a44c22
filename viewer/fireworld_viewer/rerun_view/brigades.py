"""Brigades in Rerun: balls with a gauge of their tanks, jets of water, arcs to where they drive, and their states."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import rerun
from numpy.typing import NDArray

from fireworld.records import ACTION_NAMES, ACTIONS, ACTIVITIES, Recording
from fireworld_viewer import colors
from fireworld_viewer.city_mesh import CityMesh
from fireworld_viewer.rerun_view.layers import Layers, number_columns
from fireworld_viewer.story.series import action_name, choices_of, chosen_actions, chosen_targets, recorded

_DRIVING: Final = ACTIVITIES.index("driving")
_BALL_RADIUS_M: Final = 4.0
_BALL_HEIGHT_M: Final = 6.0
_GAUGE_HEIGHT_M: Final = 20.0
_GAUGE_HALF_WIDTH_M: Final = 1.5
_NAME_BELOW_M: Final = 4.0
NAMES_APART_M: Final = 22.0  # where it is not known from how far they are seen
_QUEUE_M: Final = 8.0
_JET_POINTS: Final = 9


def log_brigades(layers: Layers, recording: Recording, *, names_apart_m: float) -> None:
    """Draw each brigade as a ball in the color of its activity, with a gauge of its tank and a name.

    Brigades that are nearer to each other than `names_apart_m` share a label.
    """
    position = positions_m(recording)
    k, n = position.shape[:2]
    if n == 0:
        return
    width = np.full(k, n)
    choices = choices_of(recording)
    numbers: dict[str, NDArray[Any]] = {
        name: recording.column("/brigades", name)
        for name in ("tank_litres", "sprayed_litres", "hp", "activity")
        if recorded(recording, f"brigades.{name}")
    }
    if recorded(recording, "decisions"):
        numbers |= {name: getattr(choices, name) for name in ("action", "target", "value")}
        values = choices.action_values
        numbers |= {f"value_{name.replace('-', '_')}": values[..., index] for index, name in enumerate(ACTIONS)}
    tank = numbers["tank_litres"]
    if "activity" in numbers:
        rgb = colors.packed_table(colors.ACTIVITY_RGB)[numbers["activity"]].reshape(-1)
    else:
        rgb = np.repeat(colors.packed_table([colors.BRIGADE_UNKNOWN_RGB]), k * n)
    balls = rerun.Points3D.columns(positions=position.reshape(-1, 3), colors=rgb)
    layers.static("team/brigades", rerun.Points3D.from_fields(radii=[_BALL_RADIUS_M]))
    layers.rows("team/brigades", balls.partition(width), number_columns("Brigade", numbers))

    _log_names(layers, position, names_apart_m)
    if not recorded(recording, "city.brigade_tank_litres"):
        return
    full = np.maximum(np.asarray(recording.city.brigade_tank_litres, dtype=np.float32), 1.0)
    half_height = np.clip(tank / full, 0.0, 1.0).astype(np.float32) * (_GAUGE_HEIGHT_M / 2)
    half_width = np.full_like(half_height, _GAUGE_HALF_WIDTH_M)
    half_sizes = np.stack([half_width, half_width, half_height], axis=-1)
    middle = position.copy()
    middle[..., 2] = position[..., 2] + _BALL_RADIUS_M + half_height
    gauges = rerun.Boxes3D.columns(centers=middle.reshape(-1, 3), half_sizes=half_sizes.reshape(-1, 3))
    style = rerun.Boxes3D.from_fields(colors=colors.single(colors.WATER_RGB), fill_mode=rerun.components.FillMode.Solid)
    layers.static("team/tanks", style)
    layers.rows("team/tanks", gauges.partition(width))


def _log_names(layers: Layers, position: NDArray[np.float32], apart_m: float) -> None:
    """Write the number of each brigade on the ground before it; those that stand together share a label."""
    leader = leaders(position[..., 0], position[..., 1], within_m=apart_m)
    places, labels, width = [], [], []
    for row, led_by in zip(position, leader, strict=True):
        groups = [np.flatnonzero(led_by == first) for first in np.unique(led_by)]
        places += [row[group].mean(axis=0) * (1, 1, 0) - (0, _NAME_BELOW_M, 0) for group in groups]
        labels += [", ".join(map(str, group)) for group in groups]
        width.append(len(groups))
    style = rerun.Points3D.from_fields(radii=[0.1], colors=colors.single(colors.LABEL_RGB), show_labels=[True])
    layers.static("team/names", style)
    names = rerun.Points3D.columns(positions=np.array(places, dtype=np.float32), labels=labels)
    layers.rows("team/names", names.partition(width))


def log_water(layers: Layers, recording: Recording, mesh: CityMesh) -> None:
    """Draw a jet from each brigade that sprays, and a thin arc from each that drives, to the target."""
    if not (recorded(recording, "decisions") and recorded(recording, "brigades.activity")):
        return
    activity, sprayed = (recording.column("/brigades", name) for name in ("activity", "sprayed_litres"))
    target = chosen_targets(recording)
    position = positions_m(recording)
    for path, shown, radius_m, rgb, rise_m in (
        ("team/water", (target >= 0) & (sprayed > 0), 0.8, colors.WATER_RGB, 14.0),
        ("team/ways", (target >= 0) & (activity == _DRIVING), 0.25, colors.DRIVE_RGB, 4.0),
    ):
        arcs = _arcs(position[shown], mesh.roof_xyz_m[target[shown]], rise_m)
        layers.strips(path, arcs, shown.sum(axis=1), radius_m=radius_m, rgb=rgb)


def log_states(layers: Layers, recording: Recording, *, complete: bool) -> None:
    """Send two timelines for each brigade: its activity, and the action that it chose.

    complete: the recording is the whole run, so that short bands are known; they get no label, for it would be cut.
    """
    activity = recording.column("/brigades", "activity")
    action = chosen_actions(recording)  # -1 is the last of the names: refilling, dead, or no fire
    codes = range(max(len(ACTION_NAMES), int(action.max(initial=-1)) + 1))
    actions, rgb = [*map(action_name, codes), "no choice"], [*map(colors.action_rgb, codes), colors.NO_CHOICE_RGB]
    for brigade in range(activity.shape[1]):
        path = f"brigade_{brigade}"
        layers.states(path, activity[:, brigade], ACTIVITIES, colors.ACTIVITY_RGB, complete=complete)
    for brigade in range(action.shape[1] if recorded(recording, "decisions") else 0):
        layers.states(f"chosen/brigade_{brigade}", action[:, brigade], actions, rgb, complete=complete)


def positions_m(recording: Recording) -> NDArray[np.float32]:
    """Return where brigades are drawn, (k, n_brigades, 3): where they are; those on one spot side by side, eastward."""
    x, y = recording.column("/brigades", "x_m"), recording.column("/brigades", "y_m")
    place = crowding(x, y, within_m=0.0)
    return np.stack([x + _QUEUE_M * place, y, np.full(x.shape, _BALL_HEIGHT_M)], axis=-1).astype(np.float32)


def leaders(x: NDArray[Any], y: NDArray[Any], *, within_m: float) -> NDArray[np.int64]:
    """Group brigades: the lowest number within a distance in x and in y that leads a group: (k, n) twice to (k, n)."""
    k, n = x.shape
    leader = np.tile(np.arange(n), (k, 1))
    for brigade in range(1, n):
        near = (np.abs(x[:, :brigade] - x[:, [brigade]]) <= within_m) & (
            np.abs(y[:, :brigade] - y[:, [brigade]]) <= within_m
        )
        leads = near & (leader[:, :brigade] == np.arange(brigade))
        leader[:, brigade] = np.where(leads.any(axis=1), leads.argmax(axis=1), brigade)
    return leader


def crowding(x: NDArray[Any], y: NDArray[Any], *, within_m: float) -> NDArray[np.int64]:
    """Count for each brigade those of lower numbers within a distance in x and in y: (k, n) and (k, n) to (k, n)."""
    near_x, near_y = (np.abs(one[:, :, np.newaxis] - one[:, np.newaxis, :]) <= within_m for one in (x, y))
    counts: NDArray[np.int64] = np.tril(near_x & near_y, k=-1).sum(axis=2)
    return counts


def _arcs(start: NDArray[np.float32], end: NDArray[np.float32], rise_m: float) -> NDArray[np.float32]:
    """Return parabolas from (m, 3) to (m, 3) that rise above the straight line: (m, _JET_POINTS, 3)."""
    along = np.linspace(0, 1, _JET_POINTS, dtype=np.float32)[np.newaxis, :, np.newaxis]
    points = start[:, np.newaxis, :] * (1 - along) + end[:, np.newaxis, :] * along
    points[..., 2] += rise_m * 4 * along[..., 0] * (1 - along[..., 0])
    return points
