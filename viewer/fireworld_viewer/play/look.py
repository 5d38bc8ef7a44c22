"""What things on the page are called, and their colors: codes, activities, health, curves and events."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

from fireworld.records import ACTIVITIES, EVENT_ENTITIES, EVENT_KINDS, FIERYNESS, MATERIALS
from fireworld_viewer import colors
from fireworld_viewer.story.series import LABELS

HEAT_MAX: Final = 1000.0
"""Degrees above ambient of the darkest shade."""


class Curve(NamedTuple):
    """A curve of a panel."""

    field: str
    """As in "score.score"."""
    rgb: colors.Rgb | None
    """None: the color of the text."""
    digits: int = 0
    dotted: bool = False
    summed: bool = False
    """The sum over all brigades or civilians is drawn."""
    label: str = ""
    """In place of that of the field."""


class Panel(NamedTuple):
    """Curves on one pair of axes."""

    title: str
    curves: tuple[Curve, ...]
    from_zero: bool = True


PANELS: Final = (
    Panel(
        "score",
        (
            Curve("score.score", None, digits=3),
            Curve("score.score_max", colors.GREY_RGB, dotted=True),
        ),
        from_zero=False,
    ),
    Panel(
        "buildings",
        (
            Curve("score.n_burning", colors.FIERYNESS_RGB[2]),
            Curve("score.n_burnt_out", None),
            Curve("score.n_water_damaged", colors.FIERYNESS_RGB[5]),
        ),
    ),
    Panel("civilians alive", (Curve("score.n_civilians_alive", colors.REFUGE_RGB),)),
    Panel(
        "water, litres",
        (
            Curve("brigades.tank_litres", colors.WATER_RGB, summed=True, label="in all tanks"),
            Curve("score.water_used_litres", None, label="used so far"),
        ),
    ),
    Panel(
        "reward of the step",
        (
            Curve("rewards.burning", colors.FIERYNESS_RGB[2]),
            Curve("rewards.burnt_out", None, dotted=True),
            Curve("rewards.water_damaged", colors.FIERYNESS_RGB[5]),
            Curve("rewards.civilians", colors.REFUGE_RGB),
            Curve("rewards.total", None),
        ),
    ),
    Panel("return: reward so far", (Curve("rewards.sum_so_far", None),)),
)

LOOKED_AT: Final = ("building", "civilian", "brigade")
"""Entities that can be looked at: events of others lead nowhere."""


def look() -> dict[str, Any]:
    """Return names and colors as the page gets them."""
    return {
        "codes": _named(FIERYNESS, colors.FIERYNESS_RGB),
        "activities": _named(ACTIVITIES, colors.ACTIVITY_RGB),
        "health": list(colors.HEALTH_RGB),
        "materials": list(MATERIALS),
        "events": [[kind.replace("-", " "), _looked_at(EVENT_ENTITIES[kind])] for kind in EVENT_KINDS],
        "heatMax": HEAT_MAX,
        "unknownBrigade": colors.BRIGADE_UNKNOWN_RGB,
        "refuge": colors.REFUGE_RGB,
        "hydrant": colors.HYDRANT_RGB,
        "water": colors.WATER_RGB,
        "differs": colors.DIFFERS_RGB,
        "pair": list(colors.RUN_RGB),
        "panels": [
            {
                "title": panel.title,
                "fromZero": panel.from_zero,
                "curves": [
                    {"field": one.field, "label": one.label or LABELS[one.field], "rgb": one.rgb, "dotted": one.dotted}
                    for one in panel.curves
                ],
            }
            for panel in PANELS
        ],
    }


def _looked_at(entity: str) -> str | None:
    return entity if entity in LOOKED_AT else None


def _named(names: tuple[str, ...], rgb: tuple[colors.Rgb, ...]) -> list[list[Any]]:
    return [[name.replace("-", " "), color] for name, color in zip(names, rgb, strict=True)]
