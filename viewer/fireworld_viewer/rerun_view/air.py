"""The heat of the air over the city, as a translucent layer: known at the steps of snapshots only.

A recording has a snapshot at every fiftieth step; in between, the layer of the last one stays, with a label that names
its step. A replay can have a snapshot at every step.
"""

from __future__ import annotations

from typing import Final

import numpy as np
import rerun
from numpy.typing import NDArray

from fireworld.records import AIR, CityRecord, Recording
from fireworld_viewer import colors
from fireworld_viewer.city_mesh import CityMesh
from fireworld_viewer.rerun_view.layers import Layers

_ABOVE_ROOFS_M: Final = 4.0
HOTTEST: Final = 600.0  # degrees above ambient at which the color is at its end
_COLDEST: Final = 1.0
_OPACITY: Final = 0.999  # below 1, or the viewer takes the layer for opaque
_ALPHA: Final = (70, 215)


def log_air(layers: Layers, recording: Recording, mesh: CityMesh) -> None:
    """Send the air of every snapshot, above the highest roof; nothing for steps without a snapshot."""
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
    """Return the (air_nx, air_ny) cells of a snapshot's array, which has a border."""
    border = (array.shape[0] - city.air_nx) // 2
    return array[border : border + city.air_nx, border : border + city.air_ny]


def air_pixels(cells: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Color cells, (nx, ny), as an image from north to south, (ny, nx, 4): clear where cold, paler the hotter."""
    share = np.sqrt(np.clip(cells / HOTTEST, 0.0, 1.0))
    stops = np.linspace(0.0, 1.0, len(colors.AIR_RGB))
    parts = [np.interp(share, stops, channel) for channel in zip(*colors.AIR_RGB, strict=True)]
    alpha = np.where(cells < _COLDEST, 0.0, np.interp(share, (0.0, 1.0), _ALPHA))
    image = np.stack([*parts, alpha], axis=-1).round().astype(np.uint8)
    pixels: NDArray[np.uint8] = np.ascontiguousarray(image.transpose(1, 0, 2)[::-1])
    return pixels
