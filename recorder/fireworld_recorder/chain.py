"""The chained hash of a run: every commit seals the steps before it, and the last hash is the run's identity."""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Mapping
from typing import Any, Final

from fireworld.records import STEP_TOPICS, CityRecord, StepRecord, filled
from fireworld_recorder.codec import Buffer, encode
from fireworld_recorder.kind import RUN, LogKind
from fireworld_recorder.schema import Commit

SCENE_PREFIX: Final = "/scene/"
"""What the topics begin with that show a step to other tools: derived from it, not chained, any number in a step."""

TOPICS_OF_A_STEP: Final[Mapping[str, str]] = {topic.topic: topic.topic[1:] for topic in STEP_TOPICS}
"""Topics without snapshot and commit, and what they are called in a `StepRecord`."""
_LENGTH: Final = struct.Struct("<Q")


class Chain:
    """The chain of hashes of a run or a training, message by message.

    h_0 = sha256(format name, /city); h_t = sha256(h_(t-1), then topic, zero byte, length as 8 little-endian bytes
    and bytes of every message of step t but /snapshot and /scene/..., and at last of its /commit without the hash).
    A training has /plan instead of /city, and parts instead of steps, of which /tables are left out.
    """

    def __init__(self, first: Buffer, kind: LogKind = RUN) -> None:
        self.hash = hashlib.sha256(kind.format.encode() + bytes(first)).digest()
        self._unchained = kind.unchained
        self._heads: dict[str, bytes] = {}  # what comes before the messages of a topic, empty if it is left out
        self._parts: list[Buffer] = []  # of the step under way: one long call of the hash beats many short ones

    def add(self, topic: str, data: Buffer) -> None:
        """Add a message of the step under way but /commit; what follows from others and the scene are left out."""
        head = self._heads.get(topic)
        if head is None:
            chained = topic not in self._unchained and not topic.startswith(SCENE_PREFIX)
            head = self._heads[topic] = _head(topic) if chained else b""
        if head:
            self._parts.append(head)
            self._parts.append(_LENGTH.pack(len(data)))
            self._parts.append(data)

    def commit(self, *, step: int, terminated: bool, truncated: bool) -> Commit:
        """End the step under way and return its commit."""
        commit: Commit = self.seal(Commit(step=step, terminated=terminated, truncated=truncated, hash=b""))
        return commit

    def seal(self, commit: Any) -> Any:
        """End what is under way with a commit whose hash is empty; return the commit with its hash."""
        data = encode(commit)
        parts = (self.hash, *self._parts, _head(commit.topic), _LENGTH.pack(len(data)), data)
        self.hash = hashlib.sha256(b"".join(parts)).digest()
        self._parts.clear()
        return filled(type(commit), vars(commit) | {"hash": self.hash})


def _head(topic: str) -> bytes:
    return topic.encode() + b"\0"


def step_messages(record: StepRecord, topics: Mapping[str, str] = TOPICS_OF_A_STEP) -> list[tuple[str, bytes]]:
    """Encode the topics of a step in the order in which things happen, without snapshot and commit.

    Args:
        record: the step.
        topics: which ones: what they are called in a record, by topic.
    """
    parts = vars(record)
    return [(topic, encode(parts[name])) for topic, name in topics.items()]


class Digest:
    """The digest of a run that is not written to a file: the same as its log would have."""

    def __init__(self, city: CityRecord) -> None:
        self._chain = Chain(encode(city))

    def write(self, record: StepRecord) -> None:
        """Add the next step."""
        for topic, data in step_messages(record):
            self._chain.add(topic, data)
        self._chain.commit(step=record.step, terminated=record.terminated, truncated=record.truncated)

    @property
    def digest(self) -> str:
        """The digest of the run so far, 64 hexadecimal digits."""
        return self._chain.hash.hex()
