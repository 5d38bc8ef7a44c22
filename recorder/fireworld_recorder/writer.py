"""Write a run to a log that survives a kill at any moment: a step is a commit, and the name comes at the end."""

from __future__ import annotations

import contextlib
import errno
import functools
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Final, Protocol, Self

from fireworld.errors import OutputError, expected
from fireworld.files import check_output, give_name
from fireworld.records import CityRecord, RunHeader, Snapshot, StepRecord, absent_names
from fireworld_recorder.chain import TOPICS_OF_A_STEP, Chain, step_messages
from fireworld_recorder.codec import encode, encode_snapshot
from fireworld_recorder.container import CHUNK_BYTES_MAX
from fireworld_recorder.container_writer import ContainerWriter
from fireworld_recorder.header import PROFILE, to_metadata
from fireworld_recorder.kind import RUN, LogKind
from fireworld_recorder.schema import PACKAGE, TOPICS, Channel, Commit, Field, channel_of

PARTIAL_SUFFIX: Final = ".partial"
CHUNK_PAYLOAD_MAX: Final = CHUNK_BYTES_MAX - (1 << 20)
"""Bytes of the messages of a chunk; the rest is for their heads, and for the schemas in the first one."""
_MEDIA_TYPES: Final = {".yaml": "application/yaml", ".json": "application/json"}


class Scene(Protocol):
    """What else a log holds, for tools that draw its steps: topics below /scene/, derived from the records."""

    @property
    def channels(self) -> Sequence[Channel]:
        """The topics, in fixed order."""

    def messages(self, record: StepRecord) -> Sequence[tuple[str, bytes]]:
        """Encode what is to be drawn of a step; steps come in rising order."""


@functools.cache
def own_channels(*, imported: bool = False, not_recorded: str = "") -> tuple[Channel, ...]:
    """Return the channels of a new log, in their fixed order.

    Args:
        imported: whether it is made from the log of another program.
        not_recorded: topics and fields that it does not have, as in `RunHeader.not_recorded`.
    """
    absent = absent_names(not_recorded)

    def channel(topic: type[Any]) -> Channel:
        """Return the channel of a topic with the fields that the log can have."""
        prefix = topic.topic[1:]

        def declared(item: Field) -> bool:
            return (imported or not item.imported) and f"{prefix}.{item.name}" not in absent

        return channel_of(topic, PACKAGE, declared=declared)

    return tuple(channel(topic) for topic in TOPICS if topic.topic[1:] not in absent)


class StepFile:
    """A log under way: encoded steps go in, or parts of a training; each is on the disk when `commit` returns.

    Args:
        path: the log to make.
        metadata: the header as text.
        attachments: files by name.
        channels: topics that will be written; the first is that of the kind's first record, as /city.
        city: that record, encoded.
        kind: of the log.
        force: replace an existing log.
        scratch_suffix: what the name ends in until the log is complete, for a copy that nobody needs before: a
            leftover of that name is replaced, and an error leaves none. Without it the partial log is kept.
    """

    def __init__(
        self,
        path: Path,
        *,
        metadata: Mapping[str, str],
        attachments: Mapping[str, bytes],
        channels: Iterable[Channel],
        city: bytes,
        force: bool,
        kind: LogKind = RUN,
        scratch_suffix: str = "",
    ) -> None:
        self.path, self.kind = path, kind
        self.partial = path.with_name(path.name + (scratch_suffix or PARTIAL_SUFFIX))
        self._final, self._scratch = path.absolute(), self.partial.absolute()  # a policy may change the current folder
        self.n_commits = 0
        self._force = force
        self._keep_partial = not scratch_suffix
        self._open = False
        replace_partial = force or not self._keep_partial
        check_output(path, force=force)
        with self._guard():
            if not replace_partial and self.partial.exists():
                raise OutputError(
                    f"{self.partial}: a {self.kind.noun} that did not end left this, or one is under way;"
                    f" try {self.kind.rescue}"
                )
            self._file = _begin_file(self.partial, replace=replace_partial)
            self._open = True
            self._writer = ContainerWriter(self._file, profile=PROFILE, library=kind.format)
            self._writer.add_metadata(kind.metadata_name, metadata)
            for name in sorted(attachments):
                media_type = _MEDIA_TYPES.get(Path(name).suffix, "application/octet-stream")
                self._writer.add_attachment(name, media_type, attachments[name])
            self._channel_ids = {
                channel.topic: self._writer.register(
                    channel.topic, schema_name=channel.schema_name, schema=channel.schema, encoding="protobuf"
                )
                for channel in channels
            }
            self._write(0, [(kind.first_type.topic, city)])

    def commit(self, step: int, messages: Iterable[tuple[str, bytes]]) -> None:
        """Write the messages of a step, /commit last; when this returns a kill cannot lose them.

        Raises:
            OutputError: the disk is full, or another fault of the output.
        """
        try:  # as `_guard` does, which takes longer
            self._write(step, messages)
        except BaseException as error:
            self._fail(error)
            raise
        self.n_commits += 1

    def close(self) -> None:
        """Write the index and give the log its name.

        Raises:
            OutputError: the disk is full, or another log has taken the name meanwhile.
        """
        if not self._open:
            return
        with self._guard():
            self._writer.finish()
            os.fsync(self._file.fileno())
            self._file.close()
            check_output(self._final, force=self._force)
            give_name(self._scratch, self._final, free=not self._force)
            self._open = False

    def keep_partial(self) -> None:
        """From now on this is the partial log of its path, and is kept: what it took the place of was copied.

        Raises:
            OutputError: another process is writing the partial log.
        """
        partial = self.path.with_name(self.path.name + PARTIAL_SUFFIX)
        place = self._final.with_name(partial.name)
        with self._guard(), _nobody_writes(place):
            self._scratch.replace(place)
        self.partial, self._scratch, self._keep_partial = partial, place, True

    def abort(self) -> None:
        """Stop here; the partial file stays if it holds a step."""
        if not self._open:
            return
        self._open = False
        with contextlib.suppress(OSError):  # a full disk complains again; what it could not hold is lost anyway
            self._file.close()
        if not self._holds_steps:
            self._scratch.unlink(missing_ok=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if kind is None:
            self.close()
        else:
            self.abort()

    @property
    def _holds_steps(self) -> bool:
        """Whether the partial file is kept."""
        return self._keep_partial and self.n_commits > 0

    def _write(self, step: int, messages: Iterable[tuple[str, bytes]]) -> None:
        """Write messages as a chunk."""
        chunk = [(self._channel_ids[topic], data) for topic, data in messages]
        n_bytes = sum([len(data) for _, data in chunk])
        if n_bytes > CHUNK_PAYLOAD_MAX:  # a reader would not accept it
            unit = self.kind.unit
            wanted = f"at most {CHUNK_PAYLOAD_MAX} bytes in a {unit}"
            raise OutputError(expected(str(self.path), f"{unit} {step}", wanted, f"{n_bytes} bytes"))
        self._writer.write_chunk(chunk, time=step * self.kind.seconds * 1_000_000_000, sequence=step)

    @contextlib.contextmanager
    def _guard(self) -> Iterator[None]:
        """Turn faults of the output into one-line errors, and stop writing after one."""
        try:
            yield
        except BaseException as error:
            self._fail(error)
            raise

    def _fail(self, error: BaseException) -> None:
        """Stop writing; raise OutputError if the error is one of the system's."""
        self.abort()
        if isinstance(error, OSError):
            reason = "no space is left on the disk" if error.errno == errno.ENOSPC else error.strerror or str(error)
            kept = f"; {self.n_commits} {self.kind.unit}s are safe in {self.partial}" if self._holds_steps else ""
            raise OutputError(f"{self.path}: cannot be written: {reason}{kept}") from error


def _begin_file(path: Path, *, replace: bool) -> IO[bytes]:
    """Open a new file that this process alone writes; with `replace` in the place of one that nobody writes any more.

    Raises:
        OutputError: it is no regular file, or another process is writing it.
    """
    if replace:
        with _nobody_writes(path):
            path.unlink(missing_ok=True)
    file = path.open("xb")
    _lock(file)
    return file


@contextlib.contextmanager
def _nobody_writes(path: Path) -> Iterator[None]:
    """Keep a file from other writers while it is replaced; there may be none.

    Raises:
        OutputError: it is no regular file, or another process is writing it.
    """
    if path.is_symlink() or (path.exists() and not path.is_file()):
        raise OutputError(expected(str(path), "", "a regular file, or none", "a link or a device"))
    if not path.exists():
        yield
        return
    with path.open("rb") as old:
        if not _lock(old):
            raise OutputError(f"{path}: another process is writing it; try another name, or wait for it")
        yield


def _lock(file: IO[bytes]) -> bool:
    """Lock a file for this process, where the system can; return whether no other process has it."""
    try:
        import fcntl
    except ImportError:
        return True
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # a file system without locks
        return True
    return True


class LogWriter(StepFile):
    """Records a run. Use it as a context manager: an exception inside leaves the committed steps as NAME.partial.

    Args:
        path: the log to make.
        header: what identifies the run.
        city: the city it runs in.
        force: replace an existing log.
        scene: what else to write, for other tools.
        scratch_suffix: as for `StepFile`, for a log that is made anew where its making is cut short.

    Raises:
        OutputError: the log exists, its folder does not, or it cannot be written.
    """

    def __init__(
        self,
        path: Path | str,
        header: RunHeader,
        city: CityRecord,
        *,
        force: bool = False,
        scene: Scene | None = None,
        scratch_suffix: str = "",
    ) -> None:
        encoded_city = encode(city)
        self._chain = Chain(encoded_city)
        self._scene = scene
        self._last_step = -1
        super().__init__(
            Path(path),
            metadata=to_metadata(header),
            attachments=header.attachments,
            channels=[
                *own_channels(imported=header.imported, not_recorded=header.not_recorded),
                *(scene.channels if scene is not None else ()),
            ],
            city=encoded_city,
            force=force,
            scratch_suffix=scratch_suffix,
        )
        self._topics = {topic: name for topic, name in TOPICS_OF_A_STEP.items() if topic in self._channel_ids}

    @property
    def digest(self) -> str:
        """The digest of the run so far, 64 hexadecimal digits."""
        return self._chain.hash.hex()

    def write(self, record: StepRecord) -> None:
        """Write one step; when this returns a kill cannot lose it. Errors are those of `commit`."""
        if record.step <= self._last_step:
            raise ValueError(f"steps are written in rising order, got {record.step} after {self._last_step}")
        messages = step_messages(record, self._topics)
        for topic, data in messages:
            self._chain.add(topic, data)
        if record.snapshot is not None:
            messages.append((Snapshot.topic, encode_snapshot(record.snapshot.arrays)))
        if self._scene is not None:
            messages.extend(self._scene.messages(record))
        commit = self._chain.commit(step=record.step, terminated=record.terminated, truncated=record.truncated)
        messages.append((Commit.topic, encode(commit)))
        self.commit(record.step, messages)
        self._last_step = record.step
