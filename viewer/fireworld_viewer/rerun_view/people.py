"""People and water: brigades with their tanks, jets and ways, civilians by health, and the fire sites they fight."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fireworld.records import ACTIONS, ACTIVITIES, Recording
from fireworld_viewer import colors
from fireworld_viewer.city_mesh import CityMesh
from fireworld_viewer.rerun_view.layers import Stage, values
from fireworld_viewer.story.choices import choices_of, per_brigade

DRIVING: Final = ACTIVITIES.index("driving")
SPRAYING: Final = ACTIVITIES.index("spraying")

_BRIGADE_RADIUS_M: Final = 4.0
_BRIGADE_HEIGHT_M: Final = 6.0
_GAUGE_HEIGHT_M: Final = 20.0
_GAUGE_HALF_WIDTH_M: Final = 1.5
_NAME_RISE_M: Final = 31.0
_NAME_STACK_M: Final = 12.0
_CROWD_M: Final = 22.0
_QUEUE_M: Final = 8.0
_JET_POINTS: Final = 9


def log_brigades(stage: Stage, recording: Recording) -> None:
    """Draw each brigade as a ball in the color of its activity, with a gauge of its tank and a label."""
    import rerun

    position = brigade_positions_m(recording)
    k, n = position.shape[:2]
    if n == 0:
        return
    width = np.full(k, n)
    tank = recording.column("/brigades", "tank_litres")
    activity = recording.column("/brigades", "activity")
    named_so = "" if stage.name else "brigade "  # there is less room beside another map
    labels = [f"{named_so}{index} · {litres} l" for row in tank.tolist() for index, litres in enumerate(row)]
    ball = rerun.Points3D.columns(
        positions=position.reshape(-1, 3),
        colors=colors.packed_table(colors.ACTIVITY_RGB)[activity].reshape(-1),
    )
    rise = _NAME_RISE_M + _NAME_STACK_M * crowding(position[..., 0], position[..., 1], within_m=_CROWD_M)
    named = position.copy()
    named[..., 2] += rise
    names = rerun.Points3D.columns(positions=named.reshape(-1, 3), labels=labels)
    chosen = choices_of(recording)
    numbers: dict[str, NDArray[Any]] = {
        "tank_litres": tank,
        "sprayed_litres": recording.column("/brigades", "sprayed_litres"),
        "hp": recording.column("/brigades", "hp"),
        "activity": activity,
        "action": chosen.action,
        "target": chosen.target,
        "value": chosen.chosen,
        **{f"value_{name.replace('-', '_')}": chosen.values[..., index] for index, name in enumerate(ACTIONS)},
    }
    stage.static("team/brigades", rerun.Points3D.from_fields(radii=[_BRIGADE_RADIUS_M]))
    stage.rows("team/brigades", ball.partition(width), values("Brigade", numbers))
    style = rerun.Points3D.from_fields(radii=[0.1], colors=colors.single(colors.LABEL_RGB), show_labels=[True])
    stage.static("team/names", style)
    stage.rows("team/names", names.partition(width))

    full = np.maximum(np.asarray(recording.city.brigade_tank_litres, dtype=np.float32), 1.0)
    half_height = np.clip(tank / full, 0.0, 1.0).astype(np.float32) * (_GAUGE_HEIGHT_M / 2)
    base = position[..., 2] + _BRIGADE_RADIUS_M
    gauge = rerun.Boxes3D.columns(
        centers=np.stack([position[..., 0], position[..., 1], base + half_height], axis=-1).reshape(-1, 3),
        half_sizes=_gauge_half_sizes(half_height).reshape(-1, 3),
    )
    style = rerun.Boxes3D.from_fields(colors=colors.single(colors.WATER_RGB), fill_mode=rerun.components.FillMode.Solid)
    stage.static("team/tanks", style)
    stage.rows("team/tanks", gauge.partition(width))


def brigade_positions_m(recording: Recording) -> NDArray[np.float32]:
    """Where brigades are drawn, (k, n_brigades, 3): where they are, those on one spot side by side, eastward."""
    x, y = recording.column("/brigades", "x_m"), recording.column("/brigades", "y_m")
    place = crowding(x, y, within_m=0.0)
    return np.stack([x + _QUEUE_M * place, y, np.full(x.shape, _BRIGADE_HEIGHT_M)], axis=-1).astype(np.float32)


def crowding(x: NDArray[Any], y: NDArray[Any], *, within_m: float) -> NDArray[np.int64]:
    """How many brigades of lower numbers are as near as told, in x and in y: (k, n) and (k, n) to (k, n)."""
    near = (np.abs(x[:, :, np.newaxis] - x[:, np.newaxis, :]) <= within_m) & (
        np.abs(y[:, :, np.newaxis] - y[:, np.newaxis, :]) <= within_m
    )
    counts: NDArray[np.int64] = np.tril(near, k=-1).sum(axis=2)
    return counts


def log_water(stage: Stage, recording: Recording, mesh: CityMesh) -> None:
    """Draw a jet from each brigade that sprays, and a thin line from each that drives, to the target."""
    activity = recording.column("/brigades", "activity")
    sprayed = recording.column("/brigades", "sprayed_litres")
    target = per_brigade(recording, "target", missing=-1)
    position = brigade_positions_m(recording)
    jets = (target >= 0) & (sprayed > 0)
    drives = (target >= 0) & (activity == DRIVING)
    for path, shown, radius_m, rgb, rise_m in (
        ("team/water", jets, 0.8, colors.WATER_RGB, 14.0),
        ("team/ways", drives, 0.25, colors.DRIVE_RGB, 4.0),
    ):
        start, end = position[shown], mesh.roof_xyz_m[target[shown]]
        _log_strips(stage, path, _arcs(start, end, rise_m), shown.sum(axis=1), radius_m=radius_m, rgb=rgb)


def log_civilians(stage: Stage, recording: Recording, mesh: CityMesh) -> None:
    """Draw each civilian, above the roof of the building it is in, in the color of its health."""
    import rerun

    city = recording.city
    n = len(city.civilian_x_m)
    if n == 0:
        return
    inside = np.asarray(city.civilian_building)
    height = np.where(inside >= 0, mesh.roof_xyz_m[inside, 2] + 3.0, 2.0)
    position = np.column_stack([city.civilian_x_m, city.civilian_y_m, height])
    if not stage.has("civilians"):
        stage.static("civilians", rerun.Points3D(position, radii=[2.6]))
    hp = recording.column("/civilians", "hp")
    health = colors.packed_array(colors.health_rgb(hp, np.asarray(city.civilian_hp)))
    look = rerun.Points3D.columns(colors=health.reshape(-1))
    stage.rows("civilians", look.partition(np.full(len(hp), n)), values("Civilian", {"hp": hp}))


def log_sites(stage: Stage, recording: Recording) -> None:
    """Draw a box around each fire site and thick lines along the sides over which its fire can spread."""
    import rerun

    topic = "/observations"
    ids, sides = recording.ragged(topic, "site_id"), recording.ragged(topic, "site_free_sides")
    count = np.array([len(row) for row in ids])
    if not count.any() and not stage.has("fire/sites"):
        return
    west, south, east, north = (
        np.concatenate([np.asarray(row, dtype=np.float32) for row in recording.ragged(topic, f"site_{side}_m")])
        for side in ("west", "south", "east", "north")
    )
    burning = np.concatenate([np.asarray(row) for row in recording.ragged(topic, "site_n_burning")])
    site = np.concatenate([np.asarray(row) for row in ids])
    labels = [f"fire {number}: {n} burning" for number, n in zip(site.tolist(), burning.tolist(), strict=True)]
    height = np.full(len(west), 1.0, dtype=np.float32)
    boxes = rerun.Boxes3D.columns(
        centers=np.column_stack([(west + east) / 2, (south + north) / 2, height]),
        half_sizes=np.column_stack([(east - west) / 2, (north - south) / 2, height]),
        labels=labels,
    )
    style = rerun.Boxes3D.from_fields(colors=colors.single(colors.CLOSED_SIDE_RGB), radii=[0.2], show_labels=[False])
    stage.static("fire/sites", style)
    stage.rows("fire/sites", boxes.partition(count))

    bits = np.concatenate([np.asarray(row, dtype=np.uint8) for row in sides])
    free = (bits[:, np.newaxis] >> np.arange(4, dtype=np.uint8)) & 1  # (sites, 4): N, E, S, W as in records.SIDES
    corner = {"NW": (west, north), "NE": (east, north), "SE": (east, south), "SW": (west, south)}
    ends = (("NW", "NE"), ("NE", "SE"), ("SE", "SW"), ("SW", "NW"))
    strips = np.stack([np.stack([_at(corner[a], height), _at(corner[b], height)], axis=1) for a, b in ends], axis=1)
    per_step = np.bincount(np.repeat(np.arange(len(count)), count), weights=free.sum(axis=1), minlength=len(count))
    chosen = strips[free.astype(bool)]
    _log_strips(stage, "fire/free_sides", chosen, per_step.astype(int), radius_m=0.9, rgb=colors.FREE_SIDE_RGB)


def _log_strips(
    stage: Stage, path: str, strips: NDArray[np.float32], per_step: NDArray[Any], *, radius_m: float, rgb: colors.Rgb
) -> None:
    """Send line strips, (strips, points, 3), `per_step` of them for each step; nothing if there never were any."""
    import rerun

    if len(strips) == 0 and not stage.has(path):
        return
    stage.static(path, rerun.LineStrips3D.from_fields(radii=[radius_m], colors=colors.single(rgb)))
    stage.rows(path, rerun.LineStrips3D.columns(strips=strips).partition(per_step))


def _arcs(start: NDArray[np.float32], end: NDArray[np.float32], rise_m: float) -> NDArray[np.float32]:
    """Parabolas from (m, 3) to (m, 3) that rise above the straight line: (m, _JET_POINTS, 3)."""
    along = np.linspace(0, 1, _JET_POINTS, dtype=np.float32)[np.newaxis, :, np.newaxis]
    points = start[:, np.newaxis, :] * (1 - along) + end[:, np.newaxis, :] * along
    points[..., 2] += rise_m * 4 * along[..., 0] * (1 - along[..., 0])
    return points


def _at(xy: tuple[NDArray[np.float32], NDArray[np.float32]], z: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.column_stack([*xy, z])


def _gauge_half_sizes(half_height: NDArray[np.float32]) -> NDArray[np.float32]:
    wide = np.full_like(half_height, _GAUGE_HALF_WIDTH_M)
    return np.stack([wide, wide, half_height], axis=-1)
