"""The legend, every color of the map with its name, and pages of text: how to read the view, and the outcome."""

from __future__ import annotations

from typing import Final

import rerun

from fireworld.records import ACTIVITIES, FIERYNESS
from fireworld_viewer import colors
from fireworld_viewer.rerun_view.outcome_page import OutcomePage

LEGEND_PATH: Final = "/legend"
HELP_PATH: Final = "/help"
OUTCOME_PATH: Final = "/outcome"

_COLUMN_WIDTH: Final = 3.9
"""Width of a name in rows; a row is as high as a dot with its name."""

HELP: Final = """\
# How to read this

**Buildings** stand as they are, 3 m a storey. Grey ones are untouched; yellow, orange and dark red ones burn; blue ones
were watered or put out; black ones are burnt out; green ones are refuges, where tanks are refilled. Click the dot on a
roof and open the panel on the right (the button at the top right) to read the building's temperature, fuel, water and
fieryness at this step.

**Brigades** are balls, colored by what they do. The blue bar above a brigade is the water in its tank; the label is
its name and the litres. A blue arc is water on its way to the target; a thin white one leads to the target that a
brigade drives to. Brigades on one spot are drawn side by side. Click a ball to read its choice and all actions' values.

**Civilians** are small dots above roofs: green when well, white when hurt, magenta when dying, black when dead.

**Fire sites** are thin boxes around what burns, as observed before the step; the fire can still spread over pink sides.

**Air**: a recording holds the heat of the air only every 50 steps. The third tab of the map shows the latest of these,
with its step; `fireworld view --air` computes every step. The air gets hotter from purple over pink to white.

**The log** lists events, and each choice that is new: the brigade's action and target, its value (Q) beside that of the
best other action, and the state that the brigade observed. A rule has no values.

The slider below moves through the steps, one simulated minute each; the space bar plays them. With two recordings the
marked part of the slider begins where they first differ.
"""


def entries(*, comparing: bool) -> list[list[tuple[str, colors.Rgb]]]:
    """Return rows of names and colors of everything on the map."""
    buildings = list(zip(FIERYNESS, colors.FIERYNESS_RGB, strict=True))
    names = [f"brigade {activity}".replace("driving-to", "to") for activity in ACTIVITIES]
    brigades = list(zip(names, colors.ACTIVITY_RGB, strict=True))
    rows = [
        buildings[:4],
        buildings[4:8],
        [buildings[8], ("refuge", colors.REFUGE_RGB), ("hydrant", colors.HYDRANT_RGB), ("hot air", colors.AIR_RGB[1])],
        [*brigades[:3], ("water", colors.WATER_RGB)],
        [*brigades[3:], ("fire can spread", colors.FREE_SIDE_RGB)],
        [
            (f"civilian, {name}", rgb)
            for name, rgb in zip(("well", "hurt", "dying", "dead"), colors.HEALTH_RGB, strict=True)
        ],
    ]
    if comparing:
        rows.append(list(zip(("B is better", "the same", "B is worse"), colors.DIFFERENCE_RGB, strict=True)))
    return rows


def bounds(*, comparing: bool) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the part of the legend's plane that is shown: its range in x and in y."""
    rows = entries(comparing=comparing)
    n_columns = max(map(len, rows))
    return (-_COLUMN_WIDTH / 2, _COLUMN_WIDTH * (n_columns - 0.5)), (-0.4, len(rows) - 0.1)


def log_legend(stream: rerun.RecordingStream, *, comparing: bool) -> None:
    """Send the legend, as dots in rows with their names below them, and the page of help."""
    rows = entries(comparing=comparing)
    place = [(_COLUMN_WIDTH * x, float(y)) for y, row in enumerate(rows) for x in range(len(row))]
    named = [entry for row in rows for entry in row]
    dots = rerun.Points2D(
        place, colors=colors.packed_table([rgb for _, rgb in named]), radii=rerun.Radius.ui_points(6.0)
    )
    # The names have points of their own: a name takes the color of its point, and black ones could not be read.
    names = rerun.Points2D(
        place,
        colors=colors.single(colors.LABEL_RGB),
        labels=[name for name, _ in named],
        show_labels=True,
        radii=rerun.Radius.ui_points(0.5),
    )
    stream.log(f"{LEGEND_PATH}/dots", dots, static=True)
    stream.log(f"{LEGEND_PATH}/names", names, static=True)
    _log_page(stream, HELP_PATH, HELP)


def log_outcome(stream: rerun.RecordingStream, page: OutcomePage) -> None:
    """Send the page of the outcome."""
    _log_page(stream, OUTCOME_PATH, page.markdown)


def _log_page(stream: rerun.RecordingStream, path: str, text: str) -> None:
    stream.log(path, rerun.TextDocument(text, media_type=rerun.MediaType.MARKDOWN), static=True)
