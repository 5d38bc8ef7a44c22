"""One pass over a log that checks every checksum and the chain, and finds its committed steps and its first fault."""

from __future__ import annotations

import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import IO, Any, Final, Literal, NamedTuple

import zstandard
from mcap.opcode import Opcode

from fireworld.errors import LogError, expected
from fireworld.records import Snapshot
from fireworld_recorder import container
from fireworld_recorder.chain import SCENE_PREFIX, Chain
from fireworld_recorder.codec import decode
from fireworld_recorder.container import ChannelRecord, Fields, Record, SchemaRecord, TruncatedError
from fireworld_recorder.header import PROFILE, ForeignError, check_format, from_metadata
from fireworld_recorder.kind import RUN, LogKind
from fireworld_recorder.source import take, unreadable

State = Literal["complete", "partial", "damaged"]
# Plain integers, because comparing enumeration members takes as long as decoding a message.
_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK = (
    int(opcode) for opcode in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE, Opcode.CHUNK)
)
_HINTS: Final = {
    b"\x1f\x8b": "it is compressed: unpack it with gzip -d",
    b"(\xb5/\xfd": "it is compressed: unpack it with zstd -d",
    b"version ": "it is a pointer of Git LFS: fetch the file with git lfs pull",
    b"PK": "it is an archive: unpack it",
}
"""What to do with files that begin so."""
_BARE: Final = frozenset({_SCHEMA, _CHANNEL, _MESSAGE})


class Start(NamedTuple):
    """Where a message begins: the offset of a record in the file, and a position inside its uncompressed chunk."""

    offset: int
    position: int


@dataclass
class TopicSize:
    """How much of a log one topic takes, before compression."""

    n_messages: int = 0
    n_bytes: int = 0


@dataclass
class Scan:
    """What one pass over a log has found; it grows step by step, or part by part of a training.

    Its bytes are in `file`: the log at `path`, or the copy of what came from a pipe.
    """

    path: Path
    file: Path
    kind: LogKind
    n_bytes: int
    metadata: Mapping[str, str]
    header: Any
    first: bytes
    schemas: Mapping[int, SchemaRecord]
    channels: Mapping[int, ChannelRecord]
    hash: bytes
    state: State = "complete"
    fault: str | None = None
    steps: list[int] = field(default_factory=list)
    starts: list[Start] = field(default_factory=list)
    snapshots: list[int] = field(default_factory=list)
    topics: dict[str, TopicSize] = field(default_factory=dict)

    @property
    def damage(self) -> str | None:
        """What is wrong and how far the log is good; None if nothing is wrong."""
        if self.fault is None:
            return None
        unit = self.kind.unit
        good = f"good up to {unit} {self.steps[-1]}" if self.steps else f"no {unit} is good"
        return f"{self.state}: {self.fault}; {good}"

    def add(self, commit: Any, start: Start, sizes: Mapping[str, TopicSize]) -> None:
        """Add a step whose hash fits."""
        unit = self.kind.unit
        if not 0 <= commit.step <= (2**64 - 1) // (self.kind.seconds * 1_000_000_000):  # what a message's time can hold
            raise LogError(f"a {unit} has the number {commit.step}")
        if self.steps and commit.step <= self.steps[-1]:
            raise LogError(f"{unit} {commit.step} follows {unit} {self.steps[-1]}")
        self.hash = commit.hash
        self.steps.append(commit.step)
        self.starts.append(start)
        for topic, found in sizes.items():
            size = self.topics.setdefault(topic, TopicSize())
            size.n_messages += found.n_messages
            size.n_bytes += found.n_bytes
            if topic == Snapshot.topic:
                self.snapshots.append(commit.step)


def scan(path: Path, kind: LogKind = RUN) -> Scan:
    """Read a whole log once, holding one chunk at a time.

    Raises:
        LogError: the file cannot be read, is no log of this kind, or its header or city are lost.
    """
    file = take(path)
    try:
        with file.open("rb") as opened:
            n_bytes = opened.seek(0, 2)
            opened.seek(0)
            return _scan(path, file, _Stream(opened, n_bytes, kind))
    except OSError as error:
        raise unreadable(path, error) from error


def holds_nothing(path: Path, kind: LogKind = RUN) -> bool:
    """Return whether a log was cut off before anything was committed, its header maybe not even whole.

    Raises:
        LogError: it is no log, or a damaged one.
    """
    try:
        return not scan(path, kind).steps
    except LogError as error:
        start = None
        if path.is_file():
            with path.open("rb") as opened:
                start = opened.read(len(container.MAGIC))
        if isinstance(error.__cause__, TruncatedError) or start in (b"", container.MAGIC[: len(start or b"")]):
            return True
        raise


def _scan(path: Path, file: Path, stream: _Stream) -> Scan:
    stream_of_messages, kind = stream.messages(), stream.kind
    try:
        first = _read_first(stream_of_messages, kind.first_type)
        header = from_metadata(stream.metadata, stream.attachments, kind)
    except ForeignError as error:
        raise LogError(f"{path}: {error}") from error
    except LogError as error:
        lost = f"header and {kind.first_type.topic.removeprefix('/')}"
        raise LogError(f"{path}: {error}; without {lost} nothing can be read") from error
    chain = Chain(first, kind)
    found = Scan(
        path=path,
        file=file,
        kind=kind,
        n_bytes=stream.n_bytes,
        metadata=stream.metadata,
        header=header,
        first=first,
        schemas=stream.schemas,
        channels=stream.channels,
        hash=chain.hash,
        topics={kind.first_type.topic: TopicSize(1, len(first))},
    )
    try:
        _follow(found, chain, stream_of_messages)
    except LogError as error:
        found.state = "partial" if isinstance(error, TruncatedError) else "damaged"
        found.fault = str(error)
    return found


def _read_first(stream_of_messages: Iterator[tuple[str, memoryview, Start]], first_type: type[Any]) -> bytes:
    """Take the first message, which must be of a type: the city of a run."""
    for topic, payload, _ in stream_of_messages:
        if topic != first_type.topic:
            raise LogError(f"expected {first_type.topic} first, got {topic!r}")
        decode(first_type, payload)
        return bytes(payload)
    raise LogError(f"expected {first_type.topic} first, got no message")


def _follow(found: Scan, chain: Chain, stream_of_messages: Iterator[tuple[str, memoryview, Start]]) -> None:
    """Read step after step; LogError is the first fault, and what was found before it is good."""
    start: Start | None = None
    sizes: dict[str, TopicSize] = {}
    for topic, payload, place in stream_of_messages:
        start = start or place
        if topic in sizes and not topic.startswith(SCENE_PREFIX):
            raise LogError(f"a {found.kind.unit} holds {topic} twice")
        size = sizes.setdefault(topic, TopicSize())
        size.n_messages += 1
        size.n_bytes += len(payload)
        if topic != found.kind.commit_type.topic:
            chain.add(topic, payload)
            continue
        commit = decode(found.kind.commit_type, payload)
        if chain.seal(replace(commit, hash=b"")).hash != commit.hash:
            raise LogError(f"the hash of {found.kind.unit} {commit.step} does not fit")
        found.add(commit, start, sizes)
        start = None
        sizes.clear()
    if start is not None:
        raise LogError(f"the last {found.kind.unit} is not committed")


def messages(
    file: IO[bytes], n_bytes: int, start: Start, channels: Mapping[int, ChannelRecord]
) -> Iterator[tuple[str, memoryview]]:
    """Yield topic and payload of every message from a step's start on; LogError if the log is damaged there."""
    decompressor = zstandard.ZstdDecompressor()
    file.seek(start.offset)
    for record in container.records(file, n_bytes):
        position = start.position if record.offset == start.offset else 0
        for _, opcode, body in container.split(_block(record, decompressor), position):
            if opcode == _MESSAGE:
                yield _topic_and_payload(body, channels)


def _block(record: Record, decompressor: zstandard.ZstdDecompressor) -> bytes:
    """Return the records that a record of the file stands for: those in a chunk, or itself, or none."""
    if record.opcode == _CHUNK:
        return container.unpack_chunk(record.body, decompressor)
    return record.head + record.body if record.opcode in _BARE else b""


def _topic_and_payload(message: memoryview, channels: Mapping[int, ChannelRecord]) -> tuple[str, memoryview]:
    channel_id, payload = container.read_message(message)
    if channel_id not in channels:
        raise LogError("a message belongs to no channel")
    return channels[channel_id].topic, payload


class _Stream:
    """The messages of a file in order; collects what else is in the file on the way, and checks every checksum."""

    def __init__(self, file: IO[bytes], n_bytes: int, kind: LogKind) -> None:
        self.n_bytes = n_bytes
        self.kind = kind
        self.metadata: dict[str, str] = {}
        self.attachments: dict[str, list[bytes]] = {}  # other tools may add some, of whatever name
        self.schemas: dict[int, SchemaRecord] = {}
        self.channels: dict[int, ChannelRecord] = {}
        self._file = file
        self._decompressor = zstandard.ZstdDecompressor()

    def messages(self) -> Iterator[tuple[str, memoryview, Start]]:
        """Yield topic, payload and place of every message; LogError at the first fault of the file."""
        found = self._file.read(len(container.MAGIC))
        if found != container.MAGIC:
            what = f"a file that begins with {found!r}" if found else "an empty file"
            hint = next((f"; {hint}" for start, hint in _HINTS.items() if found.startswith(start)), "")
            raise ForeignError(f"expected an MCAP recording, got {what}{hint}")
        checksum = zlib.crc32(container.MAGIC)
        n_messages, n_messages_max = 0, container.MESSAGES_FREE + self.n_bytes // container.MESSAGE_BYTES_MIN
        n_unpacked, n_unpacked_max = 0, container.UNPACKED_BYTES_FREE + container.UNPACKED_RATIO_MAX * self.n_bytes
        for record in container.records(self._file, self.n_bytes):
            if record.opcode == Opcode.DATA_END:
                self._check_end(record, checksum)
                return
            checksum = zlib.crc32(record.body, zlib.crc32(record.head, checksum))
            self._take(record)
            n_registrations = 0
            block = _block(record, self._decompressor)
            n_unpacked += len(block)
            if n_unpacked > n_unpacked_max:
                raise LogError(f"expected at most {n_unpacked_max} bytes in a log of {self.n_bytes}, got more")
            for position, opcode, body in container.split(block):
                if opcode == _MESSAGE:
                    n_messages += 1
                    if n_messages > n_messages_max:
                        raise LogError(f"expected at most {n_messages_max} messages in {self.n_bytes} bytes, got more")
                    yield *_topic_and_payload(body, self.channels), Start(record.offset, position)
                else:
                    n_registrations += 1
                    if n_registrations > container.REGISTRATIONS_MAX:
                        raise LogError("a chunk holds more schemas and channels than there can be")
                    self._register(opcode, body)
        raise LogError("the data section has no end")

    def _take(self, record: Record) -> None:
        if record.opcode == Opcode.HEADER:
            profile, library = container.read_header(record.body)
            if profile != PROFILE:
                raise ForeignError(expected("profile", "", PROFILE, profile, "this is no fireworld log"))
            if library.startswith("fireworld-"):  # other tools that rewrite a log put their own name here
                check_format(library, self.kind)
        elif record.opcode == Opcode.METADATA:
            fields = Fields(record.body)
            if fields.text() == self.kind.metadata_name:
                self.metadata = fields.mapping()
        elif record.opcode == Opcode.ATTACHMENT:
            name, data = container.read_attachment(record.body)
            self.attachments.setdefault(name, []).append(data)

    def _register(self, opcode: int, body: memoryview) -> None:
        if opcode == _SCHEMA:
            schema = container.read_schema(body)
            self.schemas[schema.id] = schema
        elif opcode == _CHANNEL:
            channel = container.read_channel(body)
            if self.channels.setdefault(channel.id, channel) != channel:
                raise LogError(f"channel {channel.id} changes its topic")

    def _check_end(self, record: Record, checksum: int) -> None:
        (stored,) = Fields(record.body).numbers("<I")
        if stored not in {0, checksum}:  # 0 is none
            raise LogError("bytes outside the steps were changed")
        offset = self._file.tell()
        container.check_tail(self._file.read(), offset)
