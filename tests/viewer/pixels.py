"""What is to be seen in a picture: how much of a color, and where."""

from __future__ import annotations

import io

import numpy as np
from fireworld_viewer import colors


def decoded(png: bytes) -> np.ndarray:
    """Return the picture in a PNG file, (height, width, 3)."""
    from matplotlib.image import imread

    return (imread(io.BytesIO(png))[..., :3] * 255).round().astype(np.uint8)


def n_near(image: np.ndarray, rgb: colors.Rgb, *, tolerance: int = 10) -> int:
    """How many pixels have about a color."""
    return int(np.all(np.abs(image.astype(int) - rgb) <= tolerance, axis=-1).sum())


def part(image: np.ndarray, *, rows: tuple[float, float], columns: tuple[float, float]) -> np.ndarray:
    """Cut a picture, by shares of its height and width."""
    height, width = image.shape[:2]
    (top, bottom), (left, right) = rows, columns
    return image[int(height * top) : int(height * bottom), int(width * left) : int(width * right)]
