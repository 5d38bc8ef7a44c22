"""Official logs of 2022 and later as 7z archives: an entry for each record, named `time/kind`, as py7zr reads them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

from fireworld.errors import LogError
from fireworld.recording.official_log.parts import End, Form, Parts
from fireworld.recording.official_log.protobuf_form import RECORD_BYTES_MAX, parse_record

_FIRST: Final = ("INITIAL_CONDITIONS", "CONFIG")
_LAST: Final = "END_OF_LOG"
_UPDATES: Final = "UPDATES"
_AT_ONCE: Final = 16
"""Entries that are unpacked together: each pass goes through the list of all of them."""
_ENTRIES_MAX: Final = 10_000_000


def read_parts(path: Path, form: Form) -> Parts:
    """Yield the parts of a log; only entries that are needed are unpacked.

    Raises:
        LogError: py7zr is not installed, the archive is damaged, or an entry makes no sense.
    """
    if find_spec("py7zr") is None:
        raise LogError("a 7z archive needs py7zr; try pip install 'fireworld[7z]', or unpack it with 7z and pack it anew")
    import lzma

    import py7zr

    form.text = "protobuf in a 7z archive"
    try:
        with py7zr.SevenZipFile(path, "r") as archive:
            listed = archive.getnames()
            if len(listed) > _ENTRIES_MAX:
                raise LogError(f"expected at most {_ENTRIES_MAX} entries, got {len(listed)}")
            for entry, data in _unpacked(archive, _wanted(listed)):
                try:
                    part = parse_record(data, form)
                except LogError as error:
                    raise LogError(f"{entry}: {error}") from None
                if part is not None:
                    yield part
            if _LAST in listed:
                yield End()
    except (py7zr.exceptions.ArchiveError, lzma.LZMAError, EOFError, ValueError, OSError) as error:
        raise LogError(f"the archive cannot be unpacked: {str(error) or type(error).__name__}") from None


def _wanted(listed: Sequence[str]) -> list[str]:
    """Return the entries to read, in their order in the run."""
    first = [name for name in _FIRST if name in listed]
    steps = {}
    for name in listed:
        time, _, kind = name.partition("/")
        if kind == _UPDATES and time.isdecimal():
            steps[int(time)] = name
    if not first:
        raise LogError(f"expected an entry {_FIRST[0]}, got an archive without one; it is no official log")
    return [*first, *(steps[time] for time in sorted(steps))]


def _unpacked(archive: Any, wanted: Sequence[str]) -> Iterator[tuple[str, bytes]]:
    """Yield the names and contents of entries."""
    from py7zr.io import BytesIOFactory

    for start in range(0, len(wanted), _AT_ONCE):
        some = wanted[start : start + _AT_ONCE]
        factory = BytesIOFactory(RECORD_BYTES_MAX)
        archive.reset()
        archive.extract(targets=[*some], factory=factory)
        for name in some:
            yield name, factory.products[name].read()
