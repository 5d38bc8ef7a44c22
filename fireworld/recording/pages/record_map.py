"""The map of a city as one recorded step left it, as a PNG file."""

from __future__ import annotations

import numpy as np
from fireworld_viewer.pictures.figure_files import png_bytes
from fireworld_viewer.pictures.maps import draw_map

from fireworld.records import CityRecord, StepRecord


def draw_record(city: CityRecord, record: StepRecord, *, title: str) -> bytes:
    """Draw buildings, brigades and civilians after a step.

    Args:
        city: where it was.
        record: the step.
        title: heading of the map.

    Raises:
        ViewError: matplotlib is not installed.
    """
    figure = draw_map(
        city,
        fieryness=record.buildings.fieryness,
        brigades_xy=np.column_stack([record.brigades.x_m, record.brigades.y_m]),
        civilian_hp=record.civilians.hp,
        title=title,
    )
    return png_bytes(figure)
