"""Still maps with matplotlib, in the same colors as the Rerun view: of a city, of a step, of steps in a strip."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from fireworld.errors import one_line
from fireworld.records import CityRecord, Recording, StepRecord
from fireworld_viewer.pictures.city_map import WIDTH_INCHES, BrigadeMarks, MapState, state_of
from fireworld_viewer.pictures.extent import Extent, fire_extent
from fireworld_viewer.pictures.map_grid import MapCell, MapGrid
from fireworld_viewer.story.steps import ShownStep, read_steps

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAIR_INCHES: Final = 5.4  # width of each of two maps side by side
_STRIP_INCHES: Final = (3.0, 4.4)  # least and greatest width of a map in a strip
_STRIP_WIDTH_INCHES: Final = 12.0
_STRIP_COLUMNS: Final = 5
_NAME_LETTERS: Final = 48


def draw_map(
    city: CityRecord,
    *,
    fieryness: NDArray[Any] | None = None,
    brigades_xy: NDArray[Any] | None = None,
    civilian_hp: NDArray[Any] | None = None,
    civilians_xy: NDArray[Any] | None = None,
    title: str = "",
    part: Extent | None = None,
    legend_rows: int = 0,
) -> Figure:
    """Draw a city from above: buildings, streets, refuges, hydrants, civilians and brigades.

    Args:
        city: what to draw.
        fieryness: (n,) official codes 0..8; none burns if left out.
        brigades_xy: (n_brigades, 2) positions in metres; none are drawn if left out.
        civilian_hp: (n_civilians,) health points; those of the start if left out.
        civilians_xy: (n_civilians, 2) positions in metres; those of the start if left out.
        title: heading; the city's name if left out.
        part: what is shown of it; all if left out.
        legend_rows: how many rows there is at least room for in the legend.

    Raises:
        ViewError: matplotlib is not installed.
    """
    brigades = None
    if brigades_xy is not None:
        brigades = BrigadeMarks(xy_m=np.asarray(brigades_xy, dtype=np.float64).reshape(-1, 2))
    state = MapState(
        fieryness=np.zeros(len(city.building_id), dtype=np.uint8) if fieryness is None else np.asarray(fieryness),
        civilian_hp=np.asarray(city.civilian_hp) if civilian_hp is None else np.asarray(civilian_hp),
        brigades=brigades,
        civilian_xy_m=civilians_xy,
    )
    return MapGrid([MapCell(city, state, one_line(title or city.name), part=part)], legend_rows=legend_rows).figure


def draw_record(city: CityRecord, record: StepRecord, *, title: str, part: Extent | None = None) -> Figure:
    """Draw buildings, brigades and civilians after a step, without what the brigades do; errors as in `draw_map`."""
    return draw_map(
        city,
        fieryness=record.buildings.fieryness,
        brigades_xy=np.column_stack([record.brigades.x_m, record.brigades.y_m]),
        civilian_hp=record.civilians.hp,
        civilians_xy=state_of(city, record).civilian_xy_m,
        title=title,
        part=part,
    )


def draw_steps(recordings: Sequence[Recording], steps: Sequence[int], *, whole: bool = False) -> Figure:
    """Draw one step of a run, or a strip of several; of two runs side by side, or in two rows.

    Args:
        recordings: one, or two of the same city.
        steps: steps, or `story.steps.LAST`.
        whole: show the whole city, not only where it burns.

    Raises:
        ViewError: there is no such step, the cities differ, or matplotlib is not installed.
    """
    shown = read_steps(recordings, steps)
    part = None if whole else fire_extent(recordings)
    if len(shown) == 1:
        inches = WIDTH_INCHES if len(recordings) == 1 else PAIR_INCHES
        cells = cells_of(recordings, shown[0], part=part)
        return MapGrid(cells, columns=len(recordings), map_inches=inches, curves=recordings).figure
    cells = [
        MapCell(
            one.city,
            state_of(one.city, record),
            letter + _when(record, step.step),
            ", ".join(facts_of(record)),
            part=part,
        )
        for row, (one, letter) in enumerate(zip(recordings, _letters(recordings), strict=True))
        for step in shown
        for record in [step.records[row]]
    ]
    columns = len(shown)
    if len(recordings) == 1:
        columns = -(-columns // -(-columns // _STRIP_COLUMNS))  # as few rows as possible, evenly filled
    least, greatest = _STRIP_INCHES
    inches = min(max(_STRIP_WIDTH_INCHES / columns, least), greatest)
    return MapGrid(cells, columns=columns, map_inches=inches, heading="     ".join(_names(recordings))).figure


def cells_of(recordings: Sequence[Recording], shown: ShownStep, *, part: Extent | None = None) -> list[MapCell]:
    """Return the maps of a step, one for each recording, headed by what it is a recording of."""
    return [
        MapCell(
            one.city,
            state_of(one.city, record),
            name,
            "   ".join([_when(record, shown.step), *facts_of(record)]),
            step=shown.step,
            part=part,
        )
        for one, record, name in zip(recordings, shown.records, _names(recordings), strict=True)
    ]


def _names(recordings: Sequence[Recording]) -> list[str]:
    """Return scenario, policy and seed of each run."""
    short = [
        replace(one.header, scenario=_shortened(one.header.scenario), policy=_shortened(one.header.policy))
        for one in recordings
    ]
    return [f"{letter}{header.title}" for header, letter in zip(short, _letters(recordings), strict=True)]


def _when(record: StepRecord, step: int) -> str:
    """Name a step; the record is an earlier one where the run has ended."""
    return f"step {step}" if record.step == step else f"step {step} (ended at {record.step})"


def facts_of(record: StepRecord) -> tuple[str, str]:
    """Return the score and the fire after a step in words."""
    score = record.score
    fire = f"{score.n_burning} burning, {score.n_burnt_out} burnt out"
    return f"score {score.score:.2f} of {score.score_max:.0f}", fire


def _letters(recordings: Sequence[Recording]) -> Sequence[str]:
    return ("A: ", "B: ") if len(recordings) > 1 else ("",)


def _shortened(name: str) -> str:
    line = one_line(name)
    return line if len(line) <= _NAME_LETTERS else f"…{line[1 - _NAME_LETTERS :]}"
