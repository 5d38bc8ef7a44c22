"""The tables of a team over its training as pixels: greedy actions by color, their values by shade."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fireworld_viewer import colors

Array = NDArray[Any]
UNSEEN_RGB: Final = (236, 234, 229)
_DARKEST: Final = 0.55


def table_pixels(action: Array, value: Array) -> Array:
    """Return (s * b, m, 3) uint8, a row for each state and table and a column for each moment.

    `action` and `value` are (s, b, m): the greedy action, -1 where the table has never been in the state, and its
    value, nan there. The more a state costs, on a logarithmic scale, the darker it is.
    """
    palette = np.array([*colors.ACTION_RGB, UNSEEN_RGB], dtype=np.float64)
    cost = np.log1p(np.abs(np.nan_to_num(value)))
    shade = 1.0 - _DARKEST * cost / max(float(cost.max(initial=0.0)), 1e-9)
    pixels = palette[action] * np.where(action < 0, 1.0, shade)[..., np.newaxis]
    n_states, n_tables, n_moments = action.shape
    found: Array = pixels.reshape(n_states * n_tables, n_moments, 3).round().astype(np.uint8)
    return found
