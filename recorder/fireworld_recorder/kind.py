"""Kinds of logs: how the log of a training differs from that of a run; container, chain and guard are one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from fireworld.records import FORMAT, STEP_SECONDS, CityRecord, RunHeader, Snapshot
from fireworld_recorder.schema import TOPICS, Commit

NOUNS: Final = {"fireworld-log": "run", "fireworld-training": "training"}
"""What there are logs of, by the name of the format."""


@dataclass(frozen=True)
class LogKind:
    """One kind of log.

    Attributes:
        rescue: what to do with the log of one that did not end.
        format: its name and major version, as the file has it.
        metadata_name: of the metadata that holds the header.
        header_type: a dataclass of texts and whole numbers, and `attachments` by name.
        commit_type: the record that ends a commit; it has a `step`, its number, and a `hash`.
        first_type: the record that comes before all commits.
        topics: record types of all topics that this version knows.
        unchained: topics that follow from others, and are no part of the digest.
        unit: what a commit holds.
        seconds: of log time from one commit to the next.
    """

    rescue: str
    format: str
    metadata_name: str
    header_type: type[Any]
    commit_type: type[Any]
    first_type: type[Any]
    topics: tuple[type[Any], ...]
    unchained: frozenset[str]
    unit: str
    seconds: int

    @property
    def noun(self) -> str:
        """What it is the log of."""
        return NOUNS[self.format.partition("/")[0]]


RUN: Final = LogKind(
    rescue="`fireworld recover` to keep its steps, or --force to replace it",
    format=FORMAT,
    metadata_name="fireworld.run",
    header_type=RunHeader,
    commit_type=Commit,
    first_type=CityRecord,
    topics=TOPICS,
    unchained=frozenset({Snapshot.topic}),
    unit="step",
    seconds=STEP_SECONDS,
)
