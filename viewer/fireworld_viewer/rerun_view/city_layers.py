"""The city in Rerun: ground, streets, what changes its color, buildings and civilians, fire sites, hot air over it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import rerun
from numpy.typing import NDArray

from fireworld.errors import LogError, expected
from fireworld.records import AIR, MATERIALS, CityRecord, Recording
from fireworld_viewer import colors
from fireworld_viewer.city_mesh import SHADES_PERCENT, CityMesh, city_box_m
from fireworld_viewer.rerun_view.layers import Layers, number_columns
from fireworld_viewer.story.series import recorded

_REFUGE: Final = len(colors.FIERYNESS_RGB)  # row of a refuge in the table of building colors
_BUILDING_RGB: Final = (*colors.FIERYNESS_RGB, colors.REFUGE_RGB)
_SHADE_RGB: Final = colors.shaded_table([(255, 255, 255)], SHADES_PERCENT)[0]
_GROUND_M: Final = -0.4
_GROUND_MARGIN_M: Final = 15.0
_ABOVE_ROOFS_M: Final = 4.0
_NAME_RISE_M: Final = 28.0
HOTTEST: Final = 600.0  # degrees above ambient at which the color of air is at its end
_COLDEST: Final = 1.0
_OPACITY: Final = 0.999  # below 1, or the viewer takes the air for opaque
_ALPHA: Final = (70, 215)


def log_city(layers: Layers, city: CityRecord, mesh: CityMesh) -> None:
    """Draw what never changes: the ground, streets, refuges, hydrants, and a dot on every roof that can be clicked."""
    (west, south), (east, north) = city_box_m(city, margin_m=_GROUND_MARGIN_M)
    ground = rerun.Mesh3D(
        vertex_positions=[(x, y, _GROUND_M) for x, y in ((west, south), (east, south), (east, north), (west, north))],
        triangle_indices=[(0, 1, 2), (0, 2, 3)],
        vertex_colors=colors.packed_table([colors.GROUND_RGB] * 4),
    )
    layers.static("city/ground", ground)
    if len(city.street_from):
        node = np.column_stack([city.node_x_m, city.node_y_m, np.zeros(len(city.node_x_m))]).astype(np.float32)
        strips = np.stack([node[city.street_from], node[city.street_to]], axis=1)
        layers.static("city/streets", rerun.LineStrips3D(strips, colors=colors.single(colors.STREET_RGB), radii=[0.8]))
    if len(city.refuge_building):
        roof = mesh.roof_xyz_m[city.refuge_building] + np.array([0, 0, 3], dtype=np.float32)
        labels = [f"refuge {city.building_id[index]}" for index in city.refuge_building]
        rgb = colors.single(colors.REFUGE_RGB)
        layers.static("city/refuges", rerun.Points3D(roof, colors=rgb, radii=[3.0]))
        above = roof + np.array([0, 0, _NAME_RISE_M], dtype=np.float32)  # those of brigades are before the house
        names = rerun.Points3D(above, colors=rgb, radii=[0.1], labels=labels, show_labels=True)
        layers.static("city/refuge_names", names)
    if len(city.hydrant_x_m):
        position = np.column_stack([city.hydrant_x_m, city.hydrant_y_m, np.full(len(city.hydrant_x_m), 1.0)])
        hydrants = rerun.Points3D(position, colors=colors.single(colors.HYDRANT_RGB), radii=[1.2])
        layers.static("city/hydrants", hydrants)
    handles = mesh.roof_xyz_m + np.array([0, 0, 0.3], dtype=np.float32)
    points = rerun.Points3D(handles, colors=colors.single(colors.HANDLE_RGB), radii=[0.9])
    numbers = {name: np.asarray(getattr(city, name)) for name in ("floors", "volume_m3", "initial_fuel")}
    facts = rerun.DynamicArchetype(
        "Facts",
        components={
            "id": np.asarray(city.building_id),
            "material": [MATERIALS[code] for code in city.material],
            **{name: column for name, column in numbers.items() if len(column)},
        },
    )
    layers.static("city/handles", points, facts)


def log_buildings(layers: Layers, recording: Recording, mesh: CityMesh) -> None:
    """Color the city by fieryness, and give the handle on every roof the numbers of its building."""
    names = ("temperature", "fuel_share", "water_litres", "fieryness")
    columns = {name: recording.column("/buildings", name) for name in names if recorded(recording, f"buildings.{name}")}
    shown = columns["fieryness"].copy()
    shown[:, np.asarray(recording.city.refuge_building, dtype=np.intp)] = _REFUGE
    log_mesh(layers, mesh, shown, _BUILDING_RGB)
    layers.numbers("city/handles", "Building", columns)


def log_mesh(layers: Layers, mesh: CityMesh, codes: NDArray[np.uint8], rgb: Sequence[colors.Rgb]) -> None:
    """Send the city's mesh once, and the picture with its colors for every step in which a code changes.

    codes: (k, n) index into the colors for each building. Shades are colors of the vertices, which Rerun multiplies.
    """
    path = "city/buildings"
    width, height = mesh.picture_size
    static = rerun.Mesh3D.from_fields(
        vertex_positions=mesh.vertex_xyz_m,
        triangle_indices=mesh.triangle,
        vertex_colors=_SHADE_RGB[mesh.vertex_shade],
        vertex_texcoords=mesh.vertex_uv,
        albedo_texture_format=rerun.components.ImageFormat(
            width=width, height=height, color_model="RGB", channel_datatype="U8"
        ),
    )
    layers.static(path, static)
    table = np.array(rgb, dtype=np.uint8)
    for block in layers.blocks(3 * width * height, layers.changed(path, codes)):
        pixels = np.zeros((len(block), width * height, 3), dtype=np.uint8)
        pixels[:, : codes.shape[1]] = table[codes[block]]
        columns = rerun.Mesh3D.columns(albedo_texture_buffer=[one.tobytes() for one in pixels])
        layers.rows(path, columns, steps=layers.steps[block])


def log_civilians(layers: Layers, recording: Recording, mesh: CityMesh) -> None:
    """Draw each civilian, above the roof of the building it is in, in the color of its health."""
    city = recording.city
    n = len(city.civilian_x_m)
    if n == 0:
        return
    hp = recording.column("/civilians", "hp")
    health = colors.packed_array(colors.health_rgb(hp, np.asarray(city.civilian_hp))).reshape(-1)
    numbers = {"hp": hp}
    where = {name: recording.column("/civilians", name) for name in ("x_m", "y_m", "in_building", "buriedness")}
    if where["x_m"].shape[1]:  # they move
        position = _above_roofs(mesh, where["in_building"], where["x_m"], where["y_m"]).reshape(-1, 3)
        layers.static("civilians", rerun.Points3D.from_fields(radii=[2.6]))
        dots = rerun.Points3D.columns(positions=position, colors=health)
        numbers["buriedness"] = where["buriedness"]
    else:
        position = _above_roofs(mesh, np.asarray(city.civilian_building), city.civilian_x_m, city.civilian_y_m)
        layers.static("civilians", rerun.Points3D(position, radii=[2.6]))
        dots = rerun.Points3D.columns(colors=health)
    layers.rows("civilians", dots.partition(np.full(len(hp), n)), number_columns("Civilian", numbers))


def _above_roofs(mesh: CityMesh, inside: NDArray[Any], x_m: NDArray[Any], y_m: NDArray[Any]) -> NDArray[Any]:
    """Return where civilians are drawn, (..., 3), of the buildings they are in, -1 for none, and their positions."""
    height = np.where(inside >= 0, mesh.roof_xyz_m[inside, 2] + 3.0, 2.0)
    return np.stack([x_m, y_m, height], axis=-1)


def log_sites(layers: Layers, recording: Recording) -> None:
    """Draw a box around each fire site and thick lines along the sides over which its fire can spread."""
    count = np.array([len(row) for row in recording.ragged("/observations", "site_id")])
    if not count.any() and not layers.has("fire/sites"):
        return

    def joined(name: str) -> NDArray[Any]:
        """Return a field of the sites of all steps, one after another: (sites,)."""
        return np.concatenate(recording.ragged("/observations", f"site_{name}"))

    west, south, east, north = (joined(f"{side}_m").astype(np.float32) for side in ("west", "south", "east", "north"))
    labels = [f"fire {site}: {n} burning" for site, n in zip(joined("id"), joined("n_burning"), strict=True)]
    height = np.ones_like(west)
    boxes = rerun.Boxes3D.columns(
        centers=np.column_stack([(west + east) / 2, (south + north) / 2, height]),
        half_sizes=np.column_stack([(east - west) / 2, (north - south) / 2, height]),
        labels=labels,
    )
    style = rerun.Boxes3D.from_fields(colors=colors.single(colors.CLOSED_SIDE_RGB), radii=[0.2], show_labels=[False])
    layers.static("fire/sites", style)
    layers.rows("fire/sites", boxes.partition(count))

    # (sites, 4): N, E, S, W as in records.SIDES
    free = (joined("free_sides").astype(np.uint8)[:, np.newaxis] >> np.arange(4, dtype=np.uint8)) & 1
    corners = ((west, north), (east, north), (east, south), (west, south), (west, north))
    ring = np.stack([np.column_stack([x, y, height]) for x, y in corners], axis=1)
    strips = np.stack([ring[:, :-1], ring[:, 1:]], axis=2)  # (sites, 4, 2, 3)
    per_step = np.bincount(np.repeat(np.arange(len(count)), count), weights=free.sum(axis=1), minlength=len(count))
    chosen = strips[free.astype(bool)]
    layers.strips("fire/free_sides", chosen, per_step.astype(int), radius_m=0.9, rgb=colors.FREE_SIDE_RGB)


def log_air(layers: Layers, recording: Recording, mesh: CityMesh) -> None:
    """Send the heat of the air as a translucent layer above the highest roof: known at the steps of snapshots only.

    In between, the layer of the last one stays, with a label that names its step.
    """
    city = recording.city
    held = {one.step: one.snapshot.arrays[AIR] for one in recording if one.snapshot and AIR in one.snapshot.arrays}
    if not held or city.air_nx * city.air_ny == 0:
        return
    height_m = float(mesh.roof_xyz_m[:, 2].max(initial=0.0)) + _ABOVE_ROOFS_M
    cells = [air_cells(city, array) for array in held.values()]
    steps = np.array(list(held), dtype=np.int64)
    grid = rerun.GridMap.from_fields(
        format=rerun.components.ImageFormat(
            width=city.air_nx, height=city.air_ny, color_model="RGBA", channel_datatype="U8"
        ),
        cell_size=city.air_cell_m,
        opacity=_OPACITY,
        translation=(city.air_origin_x_m, city.air_origin_y_m, height_m),
    )
    layers.static("air/heat", grid)
    pixels = [air_pixels(one).tobytes() for one in cells]
    layers.rows("air/heat", rerun.GridMap.columns(data=pixels), steps=steps)

    corner = (city.air_origin_x_m, city.air_origin_y_m + city.air_ny * city.air_cell_m, height_m)
    style = rerun.Points3D([corner], radii=[0.1], colors=colors.single(colors.LABEL_RGB), show_labels=[True])
    layers.static("air/when", style)
    labels = [f"air after step {step}: at most {one.max():.0f} degrees" for step, one in zip(held, cells, strict=True)]
    layers.rows("air/when", rerun.Points3D.columns(labels=labels), steps=steps)


def air_cells(city: CityRecord, array: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (air_nx, air_ny) cells of a snapshot's array, which has a border, and may have more beyond it along y.

    Raises:
        LogError: the array is of other cells than the city's.
    """
    nx, ny = city.air_nx, city.air_ny
    border = (array.shape[0] - nx) // 2 if array.ndim == 2 else -1
    if min(nx, ny, border + 1) < 1 or array.shape[0] != nx + 2 * border or array.shape[1] < ny + 2 * border:
        sizes = " x ".join(map(str, array.shape))
        raise LogError(expected("/snapshot", AIR, f"an array of the city's {nx} x {ny} cells and a border", sizes))
    return array[border : border + nx, border : border + ny]


def air_pixels(cells: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Color cells, (nx, ny), as an image from north to south, (ny, nx, 4): clear where cold, paler the hotter."""
    share = np.sqrt(np.clip(cells / HOTTEST, 0.0, 1.0))
    stops = np.linspace(0.0, 1.0, len(colors.AIR_RGB))
    parts = [np.interp(share, stops, channel) for channel in zip(*colors.AIR_RGB, strict=True)]
    alpha = np.where(cells < _COLDEST, 0.0, np.interp(share, (0.0, 1.0), _ALPHA))
    image = np.stack([*parts, alpha], axis=-1).round().astype(np.uint8)
    pixels: NDArray[np.uint8] = np.ascontiguousarray(image.transpose(1, 0, 2)[::-1])
    return pixels
