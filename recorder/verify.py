"""Hold a recording against a replay of itself."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from fireworld.records import Array, CityRecord, Recording, RunHeader, StepRecord
from recorder.diff import Difference, compare


def verify(log: Recording, replay: Iterable[StepRecord]) -> Difference | None:
    """Compare every step of a log with its replay, exactly.

    Args:
        log: the recording.
        replay: the steps of the same scenario, seed and decisions, run again; taken one by one.

    Returns:
        How they differ, the log's values as `a`; None if they do not.

    Raises:
        LogError: the log cannot be read.
    """
    difference = compare(log, _Replay(log, replay))
    return None if difference.same else difference


class _Replay:
    """Steps that are computed while they are compared, as a recording."""

    def __init__(self, log: Recording, records: Iterable[StepRecord]) -> None:
        self._log = log
        self._records = records

    @property
    def header(self) -> RunHeader:
        return self._log.header

    @property
    def city(self) -> CityRecord:
        return self._log.city

    @property
    def steps(self) -> Array:
        return np.asarray(self._log.steps)

    def __iter__(self) -> Iterator[StepRecord]:
        return iter(self._records)

    def column(self, topic: str, name: str) -> Array:
        raise NotImplementedError("a replay is only walked through")

    def ragged(self, topic: str, name: str) -> Sequence[Array]:
        raise NotImplementedError("a replay is only walked through")
