"""Recording to Rerun: puts every layer of a run on the `step` timeline. `log_recording` is the way in."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from fireworld.errors import ViewError, expected
from fireworld.records import MATERIALS, CityRecord, Recording
from fireworld_viewer import colors
from fireworld_viewer.city_mesh import SHADES_PERCENT, CityMesh, build_mesh
from fireworld_viewer.rerun_view import activity_lanes as lanes
from fireworld_viewer.rerun_view import air, plots
from fireworld_viewer.rerun_view import people as crews
from fireworld_viewer.rerun_view.layers import Stage, values
from fireworld_viewer.story import narration as telling

if TYPE_CHECKING:
    import rerun

_REFUGE: Final = len(colors.FIERYNESS_RGB)
"""Row of a refuge in the table of building colors."""

_BUILDING_COLORS: Final = colors.shaded_table((*colors.FIERYNESS_RGB, colors.REFUGE_RGB), SHADES_PERCENT)


class Feed:
    """Puts one run on a Rerun stream: the city at once, then its steps as they come, one by one or all together.

    Args:
        stream: where to; its log time and log tick are left out of everything sent.
        city: where the run takes place.
        prefix: entity path to put it below, "" or like "/a".
        name: what the run is called beside another, "" where it is alone.
        focus: ids of buildings whose temperatures are plotted.

    Raises:
        ViewError: a focus that the city has no building for.
    """

    def __init__(
        self,
        stream: rerun.RecordingStream,
        city: CityRecord,
        *,
        prefix: str = "",
        name: str = "",
        focus: Sequence[int] = (),
    ) -> None:
        self._focus_index = building_indices(city, focus)
        self._stage = Stage(stream, prefix, np.zeros(0, dtype=np.int64), name=name)
        self._mesh = build_mesh(city)
        self._stage.static("", _coordinates())
        log_city(self._stage, city)
        log_handles(self._stage, city, self._mesh)

    def take(self, recording: Recording) -> None:
        """Send the steps of a recording of this city: the first ones of the run, or those after the ones sent before.

        Args:
            recording: as many steps as there are to send; a MemoryRecording of one record will do.
        """
        stage, mesh = self._stage, self._mesh
        stage.steps = recording.steps
        log_buildings(stage, recording, mesh)
        air.log_air(stage, recording, height_m=float(mesh.roof_xyz_m[:, 2].max(initial=0.0)) + air.ABOVE_ROOFS_M)
        crews.log_brigades(stage, recording)
        crews.log_water(stage, recording, mesh)
        crews.log_civilians(stage, recording, mesh)
        crews.log_sites(stage, recording)
        plots.log_plots(stage, recording, self._focus_index)
        lanes.log_lanes(stage, recording)
        telling.log_text(stage, recording)


def log_recording(
    stream: rerun.RecordingStream, recording: Recording, *, prefix: str = "", name: str = "", focus: Sequence[int] = ()
) -> None:
    """Send everything that a recording holds to a Rerun stream; the arguments are those of `Feed`.

    Raises:
        ViewError: a focus that the city has no building for.
    """
    Feed(stream, recording.city, prefix=prefix, name=name, focus=focus).take(recording)


def building_indices(city: CityRecord, focus: Sequence[int]) -> list[int]:
    """Find buildings by their ids.

    Raises:
        ViewError: the city has no such building.
    """
    index_of = {int(identifier): index for index, identifier in enumerate(city.building_id)}
    for identifier in focus:
        if identifier not in index_of:
            some = f"the first are {', '.join(map(str, list(index_of)[:3]))}"
            raise ViewError(expected("--focus", "", f"ids of buildings of city {city.name!r}", identifier, some))
    return [index_of[identifier] for identifier in focus]


def log_city(stage: Stage, city: CityRecord) -> None:
    """Draw the ground, streets, refuges and hydrants; none of them changes."""
    import rerun

    low, high = city_box_m(city, margin_m=15.0)
    corners = [(low[0], low[1], -0.4), (high[0], low[1], -0.4), (high[0], high[1], -0.4), (low[0], high[1], -0.4)]
    ground = rerun.Mesh3D(
        vertex_positions=corners,
        triangle_indices=[(0, 1, 2), (0, 2, 3)],
        vertex_colors=np.full(4, colors.packed(colors.GROUND_RGB), dtype=np.uint32),
    )
    stage.static("city/ground", ground)
    if len(city.street_from):
        node = np.column_stack([city.node_x_m, city.node_y_m, np.zeros(len(city.node_x_m))]).astype(np.float32)
        strips = np.stack([node[city.street_from], node[city.street_to]], axis=1)
        stage.static("city/streets", rerun.LineStrips3D(strips, colors=colors.single(colors.STREET_RGB), radii=[0.8]))
    if len(city.refuge_building):
        refuge = np.asarray(city.refuge_building)
        roof = np.column_stack([city.center_x_m, city.center_y_m, np.asarray(city.floors) * 3.0 + 3.0])[refuge]
        labels = [f"refuge {city.building_id[index]}" for index in refuge]
        marks = rerun.Points3D(
            roof, colors=colors.single(colors.REFUGE_RGB), radii=[3.0], labels=labels, show_labels=True
        )
        stage.static("city/refuges", marks)
    if len(city.hydrant_x_m):
        position = np.column_stack([city.hydrant_x_m, city.hydrant_y_m, np.full(len(city.hydrant_x_m), 1.0)])
        stage.static("city/hydrants", rerun.Points3D(position, colors=colors.single(colors.HYDRANT_RGB), radii=[1.2]))


def log_buildings(stage: Stage, recording: Recording, mesh: CityMesh) -> None:
    """Color the city by fieryness, and give the handle on every roof the numbers of its building."""
    city = recording.city
    fieryness = recording.column("/buildings", "fieryness")
    log_mesh(stage, mesh, shown_codes(city, fieryness), _BUILDING_COLORS)

    columns = {name: recording.column("/buildings", name) for name in ("temperature", "fuel_share", "water_litres")}
    columns["fieryness"] = fieryness
    for block in stage.blocks(13 * len(city.building_id)):
        part = {name: numbers[block] for name, numbers in columns.items()}
        stage.rows("city/handles", values("Building", part), steps=stage.steps[block])


def log_handles(stage: Stage, city: CityRecord, mesh: CityMesh) -> None:
    """Put a dot on every roof that can be clicked, with the facts of its building; one batch, never one by one."""
    import rerun

    handles = mesh.roof_xyz_m + np.array([0, 0, 0.3], dtype=np.float32)
    points = rerun.Points3D(handles, colors=colors.single(colors.HANDLE_RGB), radii=[0.9])
    facts = rerun.DynamicArchetype(
        "Facts",
        components={
            "id": np.asarray(city.building_id),
            "material": [MATERIALS[code] for code in city.material],
            "floors": np.asarray(city.floors),
            "volume_m3": np.asarray(city.volume_m3),
            "initial_fuel": np.asarray(city.initial_fuel),
        },
    )
    stage.static("city/handles", points, facts)


def log_mesh(
    stage: Stage,
    mesh: CityMesh,
    codes: NDArray[np.uint8],
    table: NDArray[np.uint32],
    path: str = "city/buildings",
) -> None:
    """Send the city's mesh once and its colors for every step in which a code changes.

    Args:
        stage: where to.
        mesh: the city's geometry.
        codes: (k, n) row of the table for each building.
        table: (codes, len(SHADES_PERCENT)) packed colors.
        path: entity path.
    """
    import rerun

    stage.static(path, rerun.Mesh3D(vertex_positions=mesh.vertex_xyz_m, triangle_indices=mesh.triangle))
    changed = stage.changed(path, codes)
    entry = codes.astype(np.intp) * table.shape[1]
    flat = table.reshape(-1)
    n_vertices = len(mesh.vertex_building)
    for block in stage.blocks(4 * n_vertices, changed):
        vertex_colors = flat[entry[block][:, mesh.vertex_building] + mesh.vertex_shade]
        columns = rerun.Mesh3D.columns(vertex_colors=vertex_colors.reshape(-1))
        stage.rows(path, columns.partition(np.full(len(block), n_vertices)), steps=stage.steps[block])


def shown_codes(city: CityRecord, fieryness: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Row of each building in the table of colors: its code, or a refuge's own row. (k, n) to (k, n)."""
    shown = fieryness.copy()
    shown[:, np.asarray(city.refuge_building, dtype=np.intp)] = _REFUGE
    return shown


def city_box_m(city: CityRecord, margin_m: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """South-west and north-east corner of the city with a margin."""
    x, y = np.asarray(city.outline_x_m), np.asarray(city.outline_y_m)
    return (
        (float(x.min()) - margin_m, float(y.min()) - margin_m),
        (float(x.max()) + margin_m, float(y.max()) + margin_m),
    )


def _coordinates() -> object:
    import rerun

    return rerun.ViewCoordinates.RIGHT_HAND_Z_UP
