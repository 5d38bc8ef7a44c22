"""Official logs of 2022 and later as 7z archives: an entry for each record, named `time/kind`, or the kind alone."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import IO, Final

from fireworld.errors import LogError
from fireworld.recording.official_log.parts import End, Form, Parts
from fireworld.recording.official_log.protobuf_form import RECORD_BYTES_MAX, parse_record
from fireworld.recording.official_log.seven_zip import Archive
from fireworld.recording.official_log.seven_zip_header import ArchivedFile

_FIRST: Final = ("INITIAL_CONDITIONS", "CONFIG")
_LAST: Final = "END_OF_LOG"
_UPDATES: Final = "UPDATES"
_TURNS_MAX: Final = 1000
"""How often an archive of files that are packed together may be unpacked anew, since they are not in their order."""


def read_parts(file: IO[bytes], form: Form) -> Parts:
    """Yield the parts of a log; of a kernel's archive only entries that are needed are unpacked.

    Raises:
        LogError: the archive is cut off or damaged, or an entry makes no sense.
    """
    form.text = "protobuf in a 7z archive"
    archive = Archive(file)
    for entry in _in_order(archive.files):
        if entry.n_bytes > RECORD_BYTES_MAX:
            raise LogError(f"{entry.name}: expected at most {RECORD_BYTES_MAX} bytes, got {entry.n_bytes}")
        try:
            part = parse_record(archive.read(entry), form)
        except LogError as error:
            text = str(error)
            raise LogError(text if entry.name in text else f"{entry.name}: {text}") from None
        if part is not None:
            yield part
    if any(entry.name == _LAST for entry in archive.files):
        yield End()


def _in_order(files: Sequence[ArchivedFile]) -> Iterator[ArchivedFile]:
    """Yield the entries to read, in their order in the run."""
    named = {entry.name: entry for entry in files}
    steps: dict[int, ArchivedFile] = {}
    for name, entry in named.items():
        time, _, kind = name.partition("/")
        if kind == _UPDATES and time.isdecimal() and len(time) < 10:
            steps[int(time)] = entry
    if _FIRST[0] not in named:
        raise LogError(f"expected an entry {_FIRST[0]}, got an archive without one; it is no official log")
    wanted = [named[name] for name in _FIRST if name in named]
    wanted += [steps[time] for time in sorted(steps)]
    n_turns = sum(b.folder == a.folder and b.offset < a.offset for a, b in pairwise(wanted))
    if n_turns > _TURNS_MAX:
        raise LogError("the entries are packed together in another order than that of the run; pack them one by one")
    yield from wanted
