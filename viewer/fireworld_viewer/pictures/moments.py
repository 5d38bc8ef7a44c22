"""Which steps of one recording, or of two side by side, are to be pictured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from fireworld.errors import ViewError, expected
from fireworld.records import Recording, StepRecord
from fireworld_viewer.rerun_view.comparison import check_same_city, common_steps

LAST: Final = -1
"""In place of a step: the last one."""


@dataclass(frozen=True)
class Moment:
    """A step of all recordings that are shown; of one that ended before, its last."""

    step: int
    records: tuple[StepRecord, ...]


def moments_at(recordings: Sequence[Recording], steps: Sequence[int]) -> list[Moment]:
    """Read single steps, in the order given.

    Args:
        recordings: one, or two of the same city.
        steps: steps, or LAST.

    Raises:
        ViewError: there is no such step, or the cities differ.
    """
    held = shown_steps(recordings)
    chosen = [int(held[-1]) if step == LAST else step for step in steps]
    for step in chosen:
        if step not in held:
            raise ViewError(expected("pictures", "step", f"a step from {held[0]} to {held[-1]}", step))
    by_step = {moment.step: moment for moment in _read(recordings, sorted(set(chosen)))}
    return [by_step[step] for step in chosen]


def moments_between(
    recordings: Sequence[Recording], *, first: int | None = None, last: int | None = None, every: int = 1
) -> list[Moment]:
    """Read the steps from `first` to `last`, both included, and of these each `every`-th, and the last one anyway.

    Raises:
        ViewError: no step is left, or the cities differ.
    """
    held = shown_steps(recordings)
    low = int(held[0]) if first is None else first
    high = int(held[-1]) if last is None else last
    between = held[(held >= low) & (held <= high)]
    if len(between) == 0:
        wanted = f"steps from {held[0]} to {held[-1]}"
        raise ViewError(expected("pictures", "--from and --to", wanted, f"steps {low} to {high}"))
    chosen = [*between[::every].tolist(), int(between[-1])]
    return _read(recordings, sorted(set(chosen)))


def evenly(recordings: Sequence[Recording], n: int) -> list[int]:
    """Return n steps spread evenly from the first to the last, each once."""
    held = shown_steps(recordings)
    places = [round(k * (len(held) - 1) / max(1, n - 1)) for k in range(n)]
    return [int(held[place]) for place in sorted(set(places))]


def shown_steps(recordings: Sequence[Recording]) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """(k,) int64: the steps that can be shown.

    Raises:
        ViewError: there is none, or the cities differ.
    """
    if len(recordings) == 1:
        steps = recordings[0].steps
        if len(steps) == 0:
            raise ViewError(expected("pictures", "", "a recording with steps", "one without"))
        return steps
    first, second = recordings
    check_same_city(first.city, second.city)
    return common_steps(first.steps, second.steps)[0]


def _read(recordings: Sequence[Recording], steps: Sequence[int]) -> list[Moment]:
    """Read every recording once; only what is shown is kept."""
    found = [_states_at(recording, steps) for recording in recordings]
    return [Moment(step, records) for step, records in zip(steps, zip(*found, strict=True), strict=True)]


def _states_at(recording: Recording, steps: Sequence[int]) -> list[StepRecord]:
    """Return the record of each step, or the last one before; `steps` rise and none is before the first."""
    own = recording.steps
    wanted = own[np.searchsorted(own, steps, side="right") - 1].tolist()
    kept = {record.step: record for record in recording if record.step in set(wanted)}
    return [kept[step] for step in wanted]
