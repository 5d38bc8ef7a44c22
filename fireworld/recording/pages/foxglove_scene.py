"""`--scene foxglove`: steps as Foxglove, Lichtblick and Rerun draw them: the viewer's looks in the recorder's bytes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
from fireworld_recorder import foxglove
from fireworld_recorder.chain import SCENE_PREFIX
from fireworld_recorder.schema import Channel
from fireworld_viewer import colors
from fireworld_viewer.city_mesh import build_mesh
from fireworld_viewer.story.narration import event_lines
from numpy.typing import NDArray

from fireworld.records import ACTIVITIES, CityRecord, MemoryRecording, RunHeader, StepRecord

CITY: Final = f"{SCENE_PREFIX}city"
FIRE: Final = f"{SCENE_PREFIX}fire"
POINTS: Final = f"{SCENE_PREFIX}points"
TEAM: Final = f"{SCENE_PREFIX}team"
LOG: Final = f"{SCENE_PREFIX}log"

_LEVELS: Final = {"INFO": "INFO", "WARN": "WARNING", "ERROR": "ERROR", "CRITICAL": "FATAL"}
_ABOVE_ROOF_M: Final = 0.3
_POINT: Final = np.dtype(
    [(axis, "<f4") for axis in "xyz"]
    + [(channel, "u1") for channel in ("red", "green", "blue", "alpha")]
    + [("temperature", "<f4"), ("fuel_share", "<f4"), ("water_litres", "<i4"), ("fieryness", "u1")]
)


class FoxgloveScene:
    """Draws a run, step by step, as a `fireworld_recorder.writer.Scene`.

    Every message shows all that its topic has to show at its step: a tool that jumps to a step sees the last message of
    each topic, and nothing older.
    """

    def __init__(self, header: RunHeader, city: CityRecord) -> None:
        self._header = header
        self._city = city
        self._mesh = build_mesh(city)
        roof = self._mesh.vertex_shade == 0
        triangle = self._mesh.triangle[roof[self._mesh.triangle[:, 0]]]
        self._roof_building = self._mesh.vertex_building[triangle[:, 0]]
        self._roof_triangle = (np.cumsum(roof) - 1)[triangle]
        height = self._mesh.vertex_xyz_m[roof, 2].astype(np.float64) + _ABOVE_ROOF_M
        self._roof_xyz_m = np.column_stack([city.outline_x_m, city.outline_y_m, height])
        self._refuges = np.asarray(city.refuge_building, dtype=np.intp)
        self._shown: NDArray[np.uint8] | None = None

    @property
    def channels(self) -> list[Channel]:
        """The topics, in fixed order."""
        update = "SceneUpdate"
        roots = ((CITY, update), (POINTS, "PointCloud"), (FIRE, update), (TEAM, update), (LOG, "Log"))
        return [foxglove.channel(topic, root) for topic, root in roots]

    def messages(self, record: StepRecord) -> list[tuple[str, bytes]]:
        """Encode what is to be drawn of a step."""
        found: list[tuple[str, bytes]] = []
        if self._shown is None:
            found.append((CITY, foxglove.scene(list(self._static(record.step)))))
        found.append((POINTS, foxglove.point_cloud(record.step, self._points(record))))
        codes = np.asarray(record.buildings.fieryness, dtype=np.uint8).copy()
        codes[self._refuges] = 0
        if self._shown is None or not np.array_equal(codes, self._shown):
            found.append((FIRE, foxglove.scene([foxglove.entity(record.step, "fire", *self._fire(codes))])))
            self._shown = codes
        found.append((TEAM, foxglove.scene([foxglove.entity(record.step, "team", *self._team(record))])))
        found += [(LOG, line) for line in self._log_lines(record)]
        return found

    def _static(self, step: int) -> Iterator[bytes]:
        """The city as it stands, untouched."""
        city, mesh = self._city, self._mesh
        grey, green = colors.FIERYNESS_RGB[0], colors.REFUGE_RGB
        of_refuge = np.isin(mesh.vertex_building[mesh.triangle[:, 0]], self._refuges)
        houses = _triangles(mesh.vertex_xyz_m, mesh.triangle[~of_refuge], grey)
        refuges = _triangles(mesh.vertex_xyz_m, mesh.triangle[of_refuge], green)
        names = [f"refuge {city.building_id[index]}" for index in self._refuges]
        above = mesh.roof_xyz_m[self._refuges] + (0, 0, 8)
        labels = [foxglove.label(*one, height_m=8, rgb=green) for one in zip(above, names, strict=True)]
        yield foxglove.entity(step, "buildings", houses, refuges, *labels)
        node = np.column_stack([city.node_x_m, city.node_y_m, np.zeros(len(city.node_x_m))])
        streets = np.stack([node[np.asarray(city.street_from)], node[np.asarray(city.street_to)]], axis=1)
        yield foxglove.entity(step, "streets", foxglove.lines(streets, colors.STREET_RGB, thickness_m=1.6))
        hydrant = np.column_stack([city.hydrant_x_m, city.hydrant_y_m, np.ones(len(city.hydrant_x_m))])
        rgb = np.tile(colors.HYDRANT_RGB, (len(hydrant), 1))
        yield foxglove.entity(step, "hydrants", foxglove.spheres(hydrant, rgb, diameter_m=2.4))

    def _points(self, record: StepRecord) -> NDArray[Any]:
        """A point on each roof, with its color and numbers."""
        buildings = record.buildings
        code = np.asarray(buildings.fieryness)
        rgb = np.array(colors.FIERYNESS_RGB, dtype=np.uint8)[code]
        rgb[self._refuges] = colors.REFUGE_RGB
        points = np.zeros(len(code), dtype=_POINT)
        for place, axis in enumerate("xyz"):
            points[axis] = self._mesh.roof_xyz_m[:, place]
        for place, channel in enumerate(("red", "green", "blue")):
            points[channel] = rgb[:, place]
        points["z"] += 2 * _ABOVE_ROOF_M
        points["alpha"] = 255
        for name in ("temperature", "fuel_share", "water_litres", "fieryness"):
            points[name] = getattr(buildings, name)
        return points

    def _fire(self, codes: NDArray[np.uint8]) -> Iterator[bytes]:
        """The roofs of all buildings that are not untouched any more, in the colors of their codes."""
        for code, rgb in enumerate(colors.FIERYNESS_RGB[1:], start=1):
            yield _triangles(self._roof_xyz_m, self._roof_triangle[(codes == code)[self._roof_building]], rgb)

    def _team(self, record: StepRecord) -> Iterator[bytes]:
        """Brigades with their tanks, water on its way, civilians."""
        crew, city = record.brigades, self._city
        place = np.column_stack([crew.x_m, crew.y_m, np.full(len(crew.x_m), 6.0)])
        look = np.array(colors.ACTIVITY_RGB)[np.asarray(crew.activity)].reshape(-1, 3)
        yield foxglove.spheres(place, look, diameter_m=8.0)
        for brigade, litres in enumerate(np.asarray(crew.tank_litres).tolist()):
            text = f"{brigade} · {litres} l · {ACTIVITIES[int(crew.activity[brigade])]}"
            yield foxglove.label(place[brigade] + (0, 0, 10), text, height_m=6, rgb=colors.LABEL_RGB)
        target = np.asarray(record.decisions.target, dtype=np.intp)
        if len(target):
            sprays = np.flatnonzero((target >= 0) & (np.asarray(crew.sprayed_litres) > 0))
            jets = np.stack([place[sprays], self._mesh.roof_xyz_m[target[sprays]]], axis=1)
            yield foxglove.lines(jets, colors.WATER_RGB, thickness_m=1.2)
        inside = np.asarray(city.civilian_building, dtype=np.intp)
        height = np.where(inside >= 0, self._mesh.roof_xyz_m[inside, 2] + 3.0, 2.0)
        health = colors.health_rgb(np.asarray(record.civilians.hp), np.asarray(city.civilian_hp))
        where = np.column_stack([city.civilian_x_m, city.civilian_y_m, height])
        yield foxglove.spheres(where, health.reshape(-1, 3), diameter_m=5.2)

    def _log_lines(self, record: StepRecord) -> Iterator[bytes]:
        """A line for each event."""
        for step, level, text, _ in event_lines(MemoryRecording(self._header, self._city, [record])):
            yield foxglove.log_line(step, level=_LEVELS[level], text=text, name="fireworld")


def _triangles(xyz_m: NDArray[Any], triangle: NDArray[Any], rgb: colors.Rgb) -> bytes:
    """Triangles with the corners that they use only."""
    used, indices = np.unique(triangle, return_inverse=True)
    return foxglove.triangles(xyz_m[used], indices.reshape(-1, 3), rgb)
