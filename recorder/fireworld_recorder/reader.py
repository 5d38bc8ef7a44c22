"""Read a log step by step: only committed steps whose hash fits, of complete, cut-off and damaged files alike."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from fireworld.errors import LogError
from fireworld.records import STEP_TOPICS, Array, CityRecord, RecordingBase, RunHeader, Snapshot, StepRecord
from fireworld_recorder.codec import decode, decode_field, decode_snapshot
from fireworld_recorder.fit import check_city, check_field, check_record, counts_of
from fireworld_recorder.scan import Scan, State, TopicSize, messages, scan
from fireworld_recorder.schema import Commit, message_of
from fireworld_recorder.source import unreadable

RawStep = list[tuple[str, memoryview]]
"""Topic and payload of every message of a step, /commit last."""

_TYPES: Final = {topic.topic: topic for topic in STEP_TOPICS}


def open_log(path: Path | str, *, partial: bool = False) -> Log:
    """Open a log: every checksum and every step's hash is checked now, the steps are read when asked for.

    Args:
        path: the log.
        partial: accept a cut-off or damaged log too; it ends at its last good step, and has its `damage` in words.

    Raises:
        LogError: the file is not a log of this format, has lost its header or city, or (unless `partial`) is
            cut off or damaged; with how far it is good.
    """
    log = Log(scan(Path(path)))
    if log.damage is not None and not partial:
        raise LogError(f"{path}: {log.damage}; try `fireworld recover {path}`")
    return log


def raw_commits(found: Scan, first: int = 0) -> Iterator[RawStep]:
    """Yield the commits of a log, of whatever kind, as they lie in the file.

    Args:
        found: what the scan of the log has found.
        first: position of the commit to begin with.

    Raises:
        LogError: the log changed since it was scanned.
    """
    raw, left = RawStep(), len(found.steps) - first
    if left == 0:
        return
    try:
        with found.file.open("rb") as file:
            for topic, payload in messages(file, found.n_bytes, found.starts[first], found.channels):
                raw.append((topic, payload))
                if topic == found.kind.commit_type.topic:
                    yield raw
                    raw, left = RawStep(), left - 1
                    if left == 0:
                        return
    except OSError as error:
        raise unreadable(found.path, error) from error
    except LogError as error:
        raise LogError(f"{found.path}: {error}; it has changed since it was opened") from error


class Log(RecordingBase):
    """A recorded run, a `fireworld.records.StoredRun`. Made by `open_log`.

    Only the places of the steps are held in memory; every access reads the file again.
    """

    def __init__(self, found: Scan) -> None:
        self.path = found.path
        self.found = found
        self.header: RunHeader = found.header
        self._unknown = _unknown_values(self.header)
        city = decode(CityRecord, found.first)
        try:
            check_city(city, self.header.lacks)
        except LogError as error:
            raise LogError(f"{self.path}: {error}") from None
        self.city: CityRecord = self._without_invention(city)
        self._counts = counts_of(self.city)
        self.digest = found.hash.hex()
        """The hash of the last committed step: the identity of the run up to there, 64 hexadecimal digits."""
        self.state: State = found.state
        """Whether the log is complete, partial (cut off, or under way) or damaged."""
        self.damage = found.damage
        """What is wrong and how far the log is good; None if nothing is wrong."""
        self.snapshots: Sequence[int] = found.snapshots
        """Steps after which a snapshot was recorded."""
        self.topics: Mapping[str, TopicSize] = found.topics
        """Messages and their bytes before compression, by topic."""

    @property
    def steps(self) -> Array:
        """(k,) int64: the committed steps, rising."""
        return np.array(self.found.steps, dtype=np.int64)

    def __iter__(self) -> Iterator[StepRecord]:
        for raw in self.raw_steps():
            yield self._record(raw)

    def step(self, number: int) -> StepRecord:
        """Read one step.

        Raises:
            LogError: the log has no such step, or changed since it was opened.
        """
        try:
            first = self.position(number)
        except LogError as error:
            raise LogError(f"{self.path}: {error}") from None
        return self._record(next(self.raw_steps(first)))

    def values(self, record_type: type[Any], item: dataclasses.Field[Any]) -> Iterator[Any]:
        """Yield a field of every step, decoding nothing else."""
        field = next(one for one in message_of(record_type).fields if one.name == item.name)
        for step, raw in zip(self.found.steps, self.raw_steps(), strict=False):
            value = decode_field(record_type, field.number, dict(raw).get(record_type.topic, b""))
            try:
                check_field(record_type, field, value, self._counts, self.header.lacks)
            except LogError as error:
                raise LogError(f"{self.path}: step {step}: {error}") from None
            yield self._unknown.get(record_type, {}).get(item.name, value)

    def raw_steps(self, first: int = 0) -> Iterator[RawStep]:
        """Yield the committed steps as they lie in the file.

        Args:
            first: position in `steps` of the step to begin with.

        Raises:
            LogError: the log changed since it was opened.
        """
        return raw_commits(self.found, first)

    def _record(self, raw: RawStep) -> StepRecord:
        payloads = dict(raw)
        commit = decode(Commit, payloads[Commit.topic])
        try:
            topics: dict[str, Any] = {
                topic[1:]: decode(record_type, payloads.get(topic, b"")) for topic, record_type in _TYPES.items()
            }
            for record in topics.values():
                check_record(record, self._counts, self.header.lacks)
            snapshot = decode_snapshot(payloads[Snapshot.topic]) if Snapshot.topic in payloads else None
        except LogError as error:
            raise LogError(f"{self.path}: step {commit.step}: {error}") from error
        if self._unknown:
            topics = {name: self._without_invention(record) for name, record in topics.items()}
        return StepRecord(
            step=commit.step, terminated=commit.terminated, truncated=commit.truncated, snapshot=snapshot, **topics
        )

    def _without_invention(self, record: Any) -> Any:
        """Return a record in which numbers that an imported log does not have are no numbers, instead of zero."""
        unknown = self._unknown.get(type(record))
        return dataclasses.replace(record, **unknown) if unknown else record


def _unknown_values(header: RunHeader) -> dict[type[Any], dict[str, float]]:
    """Return NaN for each single number of the record types that a log does not have; nothing for most logs.

    Whole numbers stay 0: `header.lacks` says whether they mean anything.
    """
    if not header.not_recorded:
        return {}
    unknown: dict[type[Any], dict[str, float]] = {}
    kinds: tuple[type[Any], ...] = (CityRecord, *STEP_TOPICS)
    for kind in kinds:
        single = [item for item in message_of(kind).fields if item.wire == "double" and not item.repeated]
        absent = {item.name: math.nan for item in single if header.lacks(f"{kind.topic[1:]}.{item.name}")}
        unknown |= {kind: absent} if absent else {}
    return unknown
