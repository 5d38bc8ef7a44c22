"""The legend, every color of the map with its name, and pages of text: how to read the view, and the outcome."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from fireworld.errors import one_line
from fireworld.records import ACTIVITIES, FIERYNESS
from fireworld_viewer import colors

if TYPE_CHECKING:
    import rerun

LEGEND_PATH: Final = "/legend"
HELP_PATH: Final = "/help"
OUTCOME_PATH: Final = "/outcome"

HEALTH: Final = ("well", "hurt", "dying", "dead")
_COLUMN_WIDTH: Final = 3.9  # width of a name in rows; a row is as high as a dot with its name

HELP: Final = Path(__file__).with_name("help.md").read_text(encoding="utf-8")


@dataclass(frozen=True, kw_only=True)
class OutcomePage:
    """How one or two runs came out, and where two first differ, as computed elsewhere."""

    heads: Sequence[str]  # what the recordings are called, one or two
    rows: Sequence[tuple[str, ...]]  # what is counted, then its value in each recording
    first_step: int | None = None  # of the first difference of two runs, None where there is none
    first_sentence: str = ""  # the first difference in words

    @property
    def markdown(self) -> str:
        """The first difference, if there are two runs, and a table."""
        heads, lines = list(self.heads), []
        if len(heads) > 1:
            first = f"First difference: {self.first_sentence}." if self.first_sentence else "The runs are the same."
            lines += [first, ""]
            heads = [f"{letter}: {head}" for letter, head in zip("AB", heads, strict=True)]
        lines += [_row(("", *heads)), _row(["---"] * (len(heads) + 1)), *map(_row, self.rows)]
        return "\n".join(lines) + "\n"


def entries(*, comparing: bool, acting: bool = True) -> list[list[tuple[str, colors.Rgb]]]:
    """Return rows of names and colors of everything on the map; `acting`: it is known what brigades do."""
    buildings = list(zip(FIERYNESS, colors.FIERYNESS_RGB, strict=True))
    names = [f"brigade {activity}".replace("driving-to", "to") for activity in ACTIVITIES]
    brigades = list(zip(names, colors.ACTIVITY_RGB, strict=True))
    rows = [
        buildings[:4],
        buildings[4:8],
        [buildings[8], ("refuge", colors.REFUGE_RGB), ("hydrant", colors.HYDRANT_RGB), ("hot air", colors.AIR_RGB[1])],
        [*brigades[:3], ("water", colors.WATER_RGB)],
        [*brigades[3:], ("fire can spread", colors.FREE_SIDE_RGB)],
        list(zip([f"civilian, {name}" for name in HEALTH], colors.HEALTH_RGB, strict=True)),
    ]
    if not acting:  # of imported logs: no activities, no targets, no fire sites, no air
        rows[2:5] = [rows[2][:3], [("brigade", colors.BRIGADE_UNKNOWN_RGB)], []]
    if comparing:
        rows.append(list(zip(("B is better", "the same", "B is worse"), colors.DIFFERENCE_RGB, strict=True)))
    return rows


def bounds(*, comparing: bool) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the part of the legend's plane that is shown: its range in x and in y."""
    rows = entries(comparing=comparing)
    n_columns = max(map(len, rows))
    return (-_COLUMN_WIDTH / 2, _COLUMN_WIDTH * (n_columns - 0.5)), (-0.4, len(rows) - 0.1)


def log_legend(stream: rerun.RecordingStream, *, comparing: bool, acting: bool = True, map_by: str = "") -> None:
    """Send the legend, as dots in rows with their names below them, and the page of help with whom the map is by."""
    import rerun

    rows = entries(comparing=comparing, acting=acting)
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
    log_page(stream, HELP_PATH, f"{HELP}\nMap: {one_line(map_by)}\n" if map_by else HELP)


def log_page(stream: rerun.RecordingStream, path: str, text: str) -> None:
    """Send a page of text in Markdown."""
    import rerun

    stream.log(path, rerun.TextDocument(text, media_type=rerun.MediaType.MARKDOWN), static=True)


def _row(cells: Sequence[str]) -> str:
    """Write a row of a table; a bar would end the cell."""
    return f"| {' | '.join(cell.replace('|', '/') for cell in cells)} |"
