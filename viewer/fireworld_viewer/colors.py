"""The colors of everything a viewer draws: one table for the Rerun view, the maps and the legend.

The fieryness colors follow the official viewer's: yellow, orange and dark red burn; blue-grey shades were watered or
extinguished; black is burnt out. All colors are sRGB, 0..255.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

Rgb = tuple[int, int, int]
UInt32Array = NDArray[np.uint32]

FIERYNESS_RGB: Final[tuple[Rgb, ...]] = (
    (188, 184, 176),  # 0 unburnt
    (246, 214, 60),  # 1 heating
    (238, 126, 34),  # 2 burning
    (166, 28, 28),  # 3 inferno
    (116, 168, 182),  # 4 water-damaged
    (120, 158, 214),  # 5 minor damage
    (98, 116, 190),  # 6 moderate damage
    (82, 78, 140),  # 7 severe damage
    (22, 20, 20),  # 8 burnt out
)
"""By official code 0 to 8."""

REFUGE_RGB: Final[Rgb] = (62, 168, 84)
HYDRANT_RGB: Final[Rgb] = (52, 190, 190)
STREET_RGB: Final[Rgb] = (112, 116, 122)
GROUND_RGB: Final[Rgb] = (70, 74, 80)
BACKGROUND_RGB: Final[Rgb] = (34, 37, 42)
LEGEND_BACKGROUND_RGB: Final[Rgb] = (62, 66, 72)
WATER_RGB: Final[Rgb] = (90, 190, 255)
DRIVE_RGB: Final[Rgb] = (235, 235, 235)
FREE_SIDE_RGB: Final[Rgb] = (255, 72, 140)
CLOSED_SIDE_RGB: Final[Rgb] = (150, 150, 150)
LABEL_RGB: Final[Rgb] = (225, 225, 225)
HANDLE_RGB: Final[Rgb] = (96, 94, 90)

ACTIVITY_RGB: Final[tuple[Rgb, ...]] = (
    (225, 225, 225),  # idle
    (202, 164, 255),  # driving
    (40, 140, 255),  # spraying
    (120, 220, 140),  # driving to a refuge
    (30, 150, 70),  # refilling
    (10, 10, 10),  # dead
)
"""By index into records.ACTIVITIES."""
BRIGADE_UNKNOWN_RGB: Final = ACTIVITY_RGB[2]
"""Of a brigade of which a log does not have what it does."""

ACTION_RGB: Final[tuple[Rgb, ...]] = (
    (86, 180, 233),  # easiest
    (213, 94, 0),  # nearest-to-civilian
    (240, 192, 64),  # nearest-to-center
    (0, 158, 115),  # nearest-to-me
    (176, 90, 148),  # own-target
)
"""By index into records.ACTION_NAMES: every eye can distinguish them."""
NO_CHOICE_RGB: Final[Rgb] = (70, 74, 80)


def action_rgb(action: int) -> Rgb:
    """Return the color of an action; of one that only a later version knows, that of no choice."""
    return ACTION_RGB[action] if action < len(ACTION_RGB) else NO_CHOICE_RGB


MARK_RGB: Final[Rgb] = (255, 196, 0)

AIR_RGB: Final[tuple[Rgb, ...]] = ((96, 20, 150), (232, 64, 160), (255, 236, 246))
"""From warm to hot air: shades that no building has."""

BRIGADE_RGB: Final[tuple[Rgb, ...]] = (
    (79, 147, 255),
    (230, 126, 20),
    (38, 166, 91),
    (224, 100, 190),
    (150, 124, 246),
    (180, 150, 10),
    (10, 162, 178),
    (226, 92, 82),
)
"""Colors of the brigades in plots and logs, readable on black and on white; repeated when there are more."""

TOTAL_RGB: Final[Rgb] = (196, 110, 140)
GREY_RGB: Final[Rgb] = (128, 124, 120)  # what is burnt out, and what comes second, in plots and logs

HEALTHY_RGB: Final[Rgb] = (96, 240, 120)
HURT_RGB: Final[Rgb] = (250, 250, 250)
DYING_RGB: Final[Rgb] = (225, 60, 235)
DEAD_RGB: Final[Rgb] = (10, 10, 10)
HEALTH_RGB: Final[tuple[Rgb, ...]] = (HEALTHY_RGB, HURT_RGB, DYING_RGB, DEAD_RGB)

RUN_RGB: Final[tuple[Rgb, Rgb]] = ((130, 84, 200), (150, 112, 40))
"""Of two runs or teams, A and B: purple and ochre, in every picture; blue is water, yellow to red is fire."""

BETTER_RGB: Final[Rgb] = (0, 158, 115)
WORSE_RGB: Final[Rgb] = (213, 94, 0)
DIFFERENCE_RGB: Final[tuple[Rgb, ...]] = (BETTER_RGB, FIERYNESS_RGB[0], WORSE_RGB)
"""By difference + 1: -1 less damage in the second run, 0 the same, +1 more."""

DIFFERS_RGB: Final[Rgb] = (190, 20, 130)
"""Edges of what differs between two runs."""


def packed_array(rgb: NDArray[Any]) -> UInt32Array:
    """Pack colors as 0xRRGGBBAA, opaque: (..., 3) to (...)."""
    red, green, blue = np.moveaxis(rgb.astype(np.uint32), -1, 0)
    joined: UInt32Array = red << 24 | green << 16 | blue << 8 | 0xFF
    return joined.astype(np.uint32)


def packed_table(colors: Sequence[Rgb]) -> UInt32Array:
    """Pack colors: (len(colors),) uint32, to be indexed by codes.

    Rerun is given packed colors only: it guesses at lists, and takes three numbers for one color.
    """
    return packed_array(np.array(colors).reshape(-1, 3))


def hexadecimal(rgb: Sequence[int]) -> str:
    """Write a color as #rrggbb."""
    return "#" + bytes(rgb).hex()


def single(rgb: Rgb) -> UInt32Array:
    """Pack one color for all: (1,) uint32."""
    return packed_table((rgb,))


def shaded_table(colors: Sequence[Rgb], shades_percent: Sequence[int]) -> UInt32Array:
    """Pack every color at every brightness: (len(colors), len(shades_percent)) uint32."""
    return packed_array(np.array(colors)[:, np.newaxis] * np.array(shades_percent)[:, np.newaxis] // 100)


def paler(rgb: Rgb) -> Rgb:
    """Mix a color half and half with grey: the same thing in the second of two runs, readable on any ground."""
    red, green, blue = ((part + grey) // 2 for part, grey in zip(rgb, GREY_RGB, strict=True))
    return red, green, blue


def health_rgb(hp: NDArray[Any], hp_start: NDArray[Any]) -> NDArray[np.uint8]:
    """Color people by the share of their health left: green well, white half, magenta dying, black dead.

    (..., n) health points now and (n,) at the start to (..., n, 3) sRGB.
    """
    start = np.maximum(hp_start, 1).astype(np.int64)
    share = np.clip(hp.astype(np.int64), 0, start) * 512 // start  # 0..512
    half, rest = share[..., np.newaxis] // 257, share[..., np.newaxis] % 257
    low, high = np.array([DYING_RGB, HURT_RGB])[half], np.array([HURT_RGB, HEALTHY_RGB])[half]
    mixed = (low[..., 0, :] * (256 - rest) + high[..., 0, :] * rest) // 256
    colors: NDArray[np.uint8] = np.where(hp[..., np.newaxis] > 0, mixed, np.array(DEAD_RGB)).astype(np.uint8)
    return colors
