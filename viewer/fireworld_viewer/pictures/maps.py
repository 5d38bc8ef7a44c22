"""Still maps with matplotlib, in the same colors as the Rerun view: of a city, of a step, of steps in a strip."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from fireworld.errors import one_line
from fireworld.records import CityRecord, Recording, RunHeader, StepRecord
from fireworld_viewer.pictures.city_map import WIDTH_INCHES, Crews, MapState, state_of
from fireworld_viewer.pictures.figure_files import png_bytes, save_figure
from fireworld_viewer.pictures.moments import Moment, moments_at
from fireworld_viewer.pictures.sheet import Cell, Sheet

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["draw_map", "draw_steps", "png_bytes", "save_figure"]

PAIR_INCHES: Final = 5.4
"""Width of each of two maps side by side."""
_STRIP_INCHES: Final = (3.0, 4.4)
"""Least and greatest width of a map in a strip."""
_STRIP_WIDTH_INCHES: Final = 12.0
_STRIP_COLUMNS: Final = 5
_NAME_LETTERS: Final = 48


def draw_map(
    city: CityRecord,
    *,
    fieryness: NDArray[Any] | None = None,
    brigades_xy: NDArray[Any] | None = None,
    civilian_hp: NDArray[Any] | None = None,
    title: str = "",
) -> Figure:
    """Draw a city from above: buildings, streets, refuges, hydrants, civilians and brigades.

    Args:
        city: what to draw; civilians stand where it has them.
        fieryness: (n,) official codes 0..8; none burns if left out.
        brigades_xy: (n_brigades, 2) positions in metres; none are drawn if left out.
        civilian_hp: (n_civilians,) health points; those of the start if left out.
        title: heading; the city's name if left out.

    Raises:
        ViewError: matplotlib is not installed.
    """
    crews = None
    if brigades_xy is not None:
        crews = Crews(xy_m=np.asarray(brigades_xy, dtype=np.float64).reshape(-1, 2))
    state = MapState(
        fieryness=np.zeros(len(city.building_id), dtype=np.uint8) if fieryness is None else np.asarray(fieryness),
        civilian_hp=np.asarray(city.civilian_hp) if civilian_hp is None else np.asarray(civilian_hp),
        crews=crews,
    )
    return Sheet([Cell(city=city, state=state, title=one_line(title or city.name))]).figure


def draw_steps(recordings: Sequence[Recording], steps: Sequence[int]) -> Figure:
    """Draw one step of a run, or a strip of several; of two runs side by side, or in two rows.

    Args:
        recordings: one, or two of the same city.
        steps: steps, or moments.LAST.

    Raises:
        ViewError: there is no such step, the cities differ, or matplotlib is not installed.
    """
    moments = moments_at(recordings, steps)
    if len(moments) == 1:
        inches = WIDTH_INCHES if len(recordings) == 1 else PAIR_INCHES
        return Sheet(cells_of(recordings, moments[0]), columns=len(recordings), map_inches=inches).figure
    cells = [
        _strip_cell(recording.city, moment, row, letter=letter)
        for row, (recording, letter) in enumerate(zip(recordings, _letters(recordings), strict=True))
        for moment in moments
    ]
    columns = len(moments)
    if len(recordings) == 1:
        columns = -(-columns // -(-columns // _STRIP_COLUMNS))  # as few rows as will do, evenly filled
    names = (
        f"{letter}: {name_of(one.header)}" if letter else name_of(one.header)
        for one, letter in zip(recordings, _letters(recordings), strict=True)
    )
    least, greatest = _STRIP_INCHES
    inches = min(max(_STRIP_WIDTH_INCHES / columns, least), greatest)
    return Sheet(cells, columns=columns, map_inches=inches, heading="     ".join(names)).figure


def cells_of(recordings: Sequence[Recording], moment: Moment) -> list[Cell]:
    """Return the maps of a moment, one for each recording, headed by what it is a recording of."""
    return [
        Cell(
            city=one.city,
            state=state_of(one.city, record),
            title=f"{letter}: {name_of(one.header)}" if letter else name_of(one.header),
            facts=facts_of(record, moment.step),
        )
        for one, record, letter in zip(recordings, moment.records, _letters(recordings), strict=True)
    ]


def name_of(header: RunHeader) -> str:
    """Name a run: scenario, policy, seed."""
    scenario, policy = (one_line(name) for name in (header.scenario, header.policy))
    return f"{_shortened(scenario)}, {_shortened(policy)}, seed {header.seed}"


def facts_of(record: StepRecord, step: int) -> str:
    """Say how things stand at a step; `record` is an earlier one where the run has ended."""
    score = record.score
    when = f"step {step}" if record.step == step else f"step {step} (ended at {record.step})"
    standing = f"score {score.score:.2f} of {score.score_max:.0f}"
    return f"{when}   {standing}   {score.n_burning} burning, {score.n_burnt_out} burnt out"


def _strip_cell(city: CityRecord, moment: Moment, row: int, *, letter: str) -> Cell:
    record = moment.records[row]
    _, standing, buildings = facts_of(record, moment.step).split("   ")
    ended = "" if record.step == moment.step else f" (ended at {record.step})"
    title = f"{letter}: step {moment.step}{ended}" if letter else f"step {moment.step}{ended}"
    return Cell(city=city, state=state_of(city, record), title=title, facts=f"{standing}, {buildings}")


def _letters(recordings: Sequence[Recording]) -> Sequence[str]:
    return ("A", "B") if len(recordings) > 1 else ("",)


def _shortened(name: str) -> str:
    return name if len(name) <= _NAME_LETTERS else f"…{name[1 - _NAME_LETTERS :]}"
