"""Which steps are shown of one recording, or of two in one city, and which buildings of two are worse off."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import Field, dataclass, replace
from itertools import product
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fireworld.errors import ViewError, expected
from fireworld.records import Array, Buildings, CityRecord, MemoryRecording, Recording, RecordingBase, StepRecord

LAST: Final = -1  # in place of a step: the last one
DAMAGE_ORDER: Final = (0, 4, 5, 1, 6, 2, 7, 3, 8)
"""Fieryness codes from the least damage to the most: by the official score's factors; 8 comes after 3, both count 0."""

HELD_MAX: Final = 6_000_000
"""Buildings times steps that are held in memory whole, at 21 bytes each."""
_NUMBERS: Final = ("temperature", "energy", "fuel_share", "water_litres")
_NONE: Final[Array] = np.zeros(0)

_DAMAGE: Final = np.argsort(np.array(DAMAGE_ORDER)).astype(np.int8)  # (9,) place of each code in that order


@dataclass(frozen=True)
class ShownStep:
    """A step of every recording that is shown; of a run that ended earlier, its last step.

    Its records are without snapshots and the numbers of buildings: no picture shows them, and of many steps of a large
    city they would fill the memory.
    """

    step: int
    records: tuple[StepRecord, ...]


class SelectedSteps(RecordingBase):
    """Some steps of a recording, in memory but for what fills it: that is read again whenever it is asked for.

    What fills it are the numbers of buildings, all but their codes, and snapshots.
    """

    def __init__(self, recording: Recording, steps: Collection[int]) -> None:
        self.header, self.city = recording.header, recording.city
        self._recording, self._chosen = recording, frozenset(steps)
        self._light = [without_numbers(record) for record in self]

    @property
    def steps(self) -> Array:
        """(k,) int64: the chosen steps, rising."""
        return np.array([record.step for record in self._light], dtype=np.int64)

    def __iter__(self) -> Iterator[StepRecord]:
        """Read the chosen steps, whole."""
        return (record for record in self._recording if record.step in self._chosen)

    def values(self, record_type: type[Any], item: Field[Any]) -> Iterator[Any]:
        """Yield a field of every step."""
        records = self if record_type is Buildings and item.name in _NUMBERS else self._light
        return (getattr(getattr(record, record_type.topic[1:]), item.name) for record in records)


def without_numbers(record: StepRecord) -> StepRecord:
    """Return a step without its snapshot and the numbers of its buildings."""
    return replace(record, snapshot=None, buildings=replace(record.buildings, **dict.fromkeys(_NUMBERS, _NONE)))


def select_steps(
    recording: Recording, *, first: int | None = None, last: int | None = None, every: int = 1
) -> MemoryRecording | SelectedSteps:
    """Read the steps from `first` to `last`, both included, and of these every `every`-th.

    They are in memory then; of many steps of a large city only what does not fill it. Events and choices of steps that
    are left out are left out, too. ViewError if no step is left.
    """
    chosen = set(_between(recording.steps, first, last)[::every].tolist())
    if len(chosen) * len(recording.city.building_id) > HELD_MAX:
        return SelectedSteps(recording, chosen)
    return MemoryRecording(recording.header, recording.city, [one for one in recording if one.step in chosen])


def read_steps(recordings: Sequence[Recording], steps: Sequence[int]) -> list[ShownStep]:
    """Read single steps, or LAST, of one recording or two, in the order given.

    Raises:
        ViewError: there is no such step, or the cities differ.
    """
    held = steps_of(recordings)
    chosen = [int(held[-1]) if step == LAST else step for step in steps]
    for step in chosen:
        if step not in held:
            raise ViewError(expected("step", "", f"a step from {held[0]} to {held[-1]}", step))
    by_step = {shown.step: shown for shown in _read(recordings, sorted(set(chosen)))}
    return [by_step[step] for step in chosen]


def read_steps_between(
    recordings: Sequence[Recording], *, first: int | None = None, last: int | None = None, every: int = 1
) -> list[ShownStep]:
    """Read the steps from `first` to `last`, both included: every `every`-th of them, and always the last one.

    Raises:
        ViewError: no step is left, or the cities differ.
    """
    between = _between(steps_of(recordings), first, last)
    return _read(recordings, sorted({*between[::every].tolist(), int(between[-1])}))


def evenly_spaced(recordings: Sequence[Recording], n: int) -> list[int]:
    """Return n steps spread evenly from the first to the last, each once."""
    held = steps_of(recordings)
    places = [round(k * (len(held) - 1) / max(1, n - 1)) for k in range(n)]
    return [int(held[place]) for place in sorted(set(places))]


def steps_of(recordings: Sequence[Recording]) -> NDArray[np.int64]:
    """Return the steps that can be shown, (k,) int64; errors as in `read_steps`."""
    if len(recordings) == 1:
        if len(recordings[0].steps) == 0:
            raise ViewError(expected("recording", "", "one with steps", "one without"))
        return recordings[0].steps
    first, second = recordings
    check_same_city(first.city, second.city)
    return common_steps(first.steps, second.steps)[0]


def _between(steps: NDArray[np.int64], first: int | None, last: int | None) -> NDArray[np.int64]:
    """Return the steps from `first` to `last`, of which there is at least one."""
    low = int(steps.min(initial=0)) if first is None else first
    high = int(steps.max(initial=0)) if last is None else last
    between = steps[(steps >= low) & (steps <= high)]
    if len(between) == 0:
        held = f"steps from {steps[0]} to {steps[-1]}" if len(steps) else "a recording with steps"
        raise ViewError(expected("--from and --to", "", held, f"steps {low} to {high}"))
    return between


def _read(recordings: Sequence[Recording], steps: Sequence[int]) -> list[ShownStep]:
    """Read every recording once; only what is shown stays in memory. `steps` rise; none is before any recording."""
    columns = []
    for recording in recordings:
        own = recording.steps
        wanted = own[np.searchsorted(own, steps, side="right") - 1].tolist()  # the step, or the last one before it
        chosen = set(wanted)
        found = {record.step: without_numbers(record) for record in recording if record.step in chosen}
        columns.append([found[step] for step in wanted])
    return [ShownStep(step, tuple(records)) for step, *records in zip(steps, *columns, strict=True)]


def compare_damage(fieryness_a: NDArray[np.uint8], fieryness_b: NDArray[np.uint8]) -> NDArray[np.int8]:
    """Compare codes: -1 where the second run has less damage, 1 where it has more, 0 where the codes are equal."""
    signs: NDArray[np.int8] = np.sign(_DAMAGE[fieryness_b] - _DAMAGE[fieryness_a])
    return signs


def common_steps(
    steps_a: NDArray[np.int64], steps_b: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.intp], NDArray[np.intp]]:
    """Align two runs: every step of either once both have begun, (k,), and the row of each run with its state there.

    A run that has ended stays in its last state. ViewError if a run has no steps.
    """
    if len(steps_a) == 0 or len(steps_b) == 0:
        raise ViewError(expected("recordings", "", "two with steps", f"{len(steps_a)} and {len(steps_b)} steps"))
    steps = np.union1d(steps_a, steps_b)
    steps = steps[steps >= max(steps_a[0], steps_b[0])]
    rows_a, rows_b = (np.searchsorted(own, steps, side="right") - 1 for own in (steps_a, steps_b))
    return steps, rows_a, rows_b


def check_same_city(first: CityRecord, *others: CityRecord) -> None:
    """Check that runs took place in the same city; ViewError, with what differs, if one building does."""
    names = ("building_id", "outline_ptr", "outline_x_m", "outline_y_m", "floors")
    for second, name in product(others, names):
        if not np.array_equal(getattr(first, name), getattr(second, name)):
            n, m = len(first.building_id), len(second.building_id)
            cities = f"{first.name!r} with {n} buildings and {second.name!r} with {m}"
            hint = f"{name} differs; try to view them one by one"
            raise ViewError(expected("recordings", "", "two of one city", cities, hint))
