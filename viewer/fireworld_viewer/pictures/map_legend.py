"""The legend of a map: what is on it, in the map's own marks, and how many of each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from fireworld.records import ACTIVITIES, FIERYNESS, CityRecord
from fireworld_viewer import colors
from fireworld_viewer.pictures.city_map import JET_EDGE, MapState, hexadecimal
from fireworld_viewer.pictures.figure_files import INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.legend import Legend

_JET: Final = "water jet"
_WAY: Final = "way to a target"
_TANK: Final = "water in the tank"
_BRIGADE: Final = "brigade"
_DOING: Final = tuple(f"brigade {activity.removeprefix('driving-').replace('-', ' ')}" for activity in ACTIVITIES)
_CIVILIAN: Final = ("civilian well", "civilian hurt", "civilian dying", "civilian dead")
"""With more than 3/4 of their health, more than 1/4, less, and none."""
_CODES: Final = tuple(name.replace("-", " ") for name in FIERYNESS)
_UPRIGHT: Final = ((-0.25, -1.0), (0.25, -1.0), (0.25, 1.0), (-0.25, 1.0), (-0.25, -1.0))
_MARKS: Final[Mapping[str, tuple[colors.Rgb, Any, float]]] = {
    **{label: (rgb, "s", 9.0) for label, rgb in zip(_CODES, colors.FIERYNESS_RGB, strict=True)},
    "refuge": (colors.REFUGE_RGB, "s", 9.0),
    "hydrant": (colors.HYDRANT_RGB, "s", 5.0),
    **{label: (rgb, "o", 6.0) for label, rgb in zip(_CIVILIAN, colors.HEALTH_RGB, strict=True)},
    "civilian dead": (colors.DEAD_RGB, "X", 6.0),
    _BRIGADE: (colors.ACTIVITY_RGB[2], "o", 10.0),
    **{label: (rgb, "o", 10.0) for label, rgb in zip(_DOING, colors.ACTIVITY_RGB, strict=True)},
    _TANK: (colors.WATER_RGB, _UPRIGHT, 11.0),
}
"""Color, shape and size."""
LABELS: Final = (*_MARKS, _JET, _WAY)  # everything that can be on a map, in the order of the legend
LEGEND_STYLE: Final[Mapping[str, Any]] = {
    "loc": "upper left", "bbox_to_anchor": (1.01, 1.0), "frameon": False, "labelcolor": INK, "borderaxespad": 0,
}  # fmt: skip
"""To the right of a map."""
_UNCOUNTED: Final = frozenset({_TANK, _JET, _WAY})


def count_marks(city: CityRecord, state: MapState) -> dict[str, int]:
    """Count what is on a map, by label; what is not there is left out."""
    outside = np.delete(np.asarray(state.fieryness, dtype=np.int64), np.asarray(city.refuge_building, dtype=np.int64))
    counts = dict(zip(_CODES, np.bincount(outside, minlength=len(_CODES)).tolist(), strict=True))
    counts |= {"refuge": len(city.refuge_building), "hydrant": len(city.hydrant_x_m)}
    hp, start = np.asarray(state.civilian_hp, dtype=np.float64), np.maximum(city.civilian_hp, 1)
    band = np.digitize(hp / start, [0.0, 0.25, 0.75], right=True)  # 0 dead, 3 well
    counts |= dict(zip(reversed(_CIVILIAN), np.bincount(band, minlength=4).tolist(), strict=True))
    brigades = state.brigades
    if brigades is not None and brigades.activity is None:
        counts[_BRIGADE] = len(brigades.xy_m)
    elif brigades is not None:
        doing = np.bincount(np.asarray(brigades.activity, dtype=np.int64), minlength=len(_DOING)).tolist()
        counts |= dict(zip(_DOING, doing, strict=True))
        counts[_TANK] = len(brigades.xy_m)
        counts[_JET] = len(brigades.with_target(ACTIVITIES.index("spraying")))
        counts[_WAY] = len(brigades.with_target(ACTIVITIES.index("driving")))
    return {label: count for label, count in counts.items() if count}


def draw_legend(axes: Axes, labels: Sequence[str], *, n_maps: int) -> Legend:
    """Draw a legend, of some of LABELS, to the right of a map; it will have counts of `n_maps` maps, 0 for none."""
    handles = [_handle(label) for label in labels]
    title = "how many: (A | B)" if n_maps > 1 else None
    return axes.legend(
        handles=handles, labels=list(labels), handlelength=1.7, fontsize=10.0, title=title, title_fontsize=10.0,
        alignment="left", **LEGEND_STYLE,
    )  # fmt: skip


def show_counts(legend: Legend, labels: Sequence[str], counts: Sequence[Mapping[str, int]]) -> None:
    """Write beside each label how many there are, on each of the maps the legend is for."""
    for text, label in zip(legend.get_texts(), labels, strict=True):
        numbers = " | ".join(str(count.get(label, 0)) for count in counts)
        text.set_text(label if label in _UNCOUNTED or not counts else f"{label} ({numbers})")


def _handle(label: str) -> Any:
    """Return the mark of a label as it is on the map."""
    from matplotlib.lines import Line2D
    from matplotlib.patheffects import Normal, Stroke

    if label == _WAY:
        return Line2D([], [], color=INK, linewidth=1.1, linestyle=(0, (3, 2)))
    if label == _JET:
        edged = [Stroke(linewidth=4.2, foreground=JET_EDGE), Normal()]
        return Line2D([], [], color=hexadecimal(colors.WATER_RGB), linewidth=2.6, path_effects=edged)
    rgb, shape, size = _MARKS[label]
    edge = "white" if label == "civilian dead" else INK
    style: dict[str, Any] = {"markerfacecolor": hexadecimal(rgb), "markeredgecolor": edge, "markersize": size}
    return Line2D([], [], linestyle="", marker=shape, **style)
