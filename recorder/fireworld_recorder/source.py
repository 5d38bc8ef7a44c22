"""Where the bytes of a log come from, and of what it is the log: a file, or what comes from a pipe, read only once."""

from __future__ import annotations

import stat
import tempfile
from pathlib import Path
from typing import IO, Final

from fireworld.errors import LogError, expected
from fireworld_recorder.container import MAGIC, read_header, records
from fireworld_recorder.kind import NOUNS

PIPE_BYTES_MAX: Final = 4 << 30
_PIECE_BYTES: Final = 1 << 20
_HEADER_BYTES_MAX: Final = 256
"""Up to the end of the header of a log; those of other tools may be longer."""

_OWN_FILES: Final = Path("/proc/self/fd")
_copies: Final[list[IO[bytes]]] = []
"""Copies of what came from pipes: files without a name, which no kill leaves behind."""
_looked_at: Final[dict[Path, Path]] = {}
"""Copies by pipe, from `noun_of` to `take`."""


def noun_of(path: Path) -> str:
    """Return what a file is the log of by its first bytes, as in NOUNS; "run" for whatever is none: to be refused.

    Raises:
        LogError: it cannot be read.
    """
    file = take(path)
    if file != path:
        _looked_at[path] = file
    try:
        with file.open("rb") as opened:
            if opened.read(len(MAGIC)) != MAGIC:
                return "run"
            _, library = read_header(next(records(opened, _HEADER_BYTES_MAX)).body)
    except OSError as error:
        raise unreadable(path, error) from error
    except LogError:
        return "run"
    return NOUNS.get(library.partition("/")[0], "run")


def take(path: Path) -> Path:
    """Return a file that can be read in any order: the log itself, or the private copy of what comes from a pipe.

    Raises:
        LogError: it is a folder or a device, cannot be read, or more comes than a log is.
    """
    if path in _looked_at:
        return _looked_at.pop(path)
    try:
        mode = path.stat().st_mode
        if stat.S_ISREG(mode):
            return path
        if not (stat.S_ISFIFO(mode) or stat.S_ISSOCK(mode)):
            what = "a folder" if stat.S_ISDIR(mode) else "a device"
            raise LogError(expected(str(path), "", "a recording", what))
        copy = tempfile.TemporaryFile(buffering=0)  # noqa: SIM115 - open as long as the process lives
        with path.open("rb") as pipe:
            while data := pipe.read(_PIECE_BYTES):
                if copy.tell() > PIPE_BYTES_MAX:
                    raise LogError(expected(str(path), "", f"at most {PIPE_BYTES_MAX} bytes from a pipe", "more"))
                copy.write(data)
        _copies.append(copy)
        return _OWN_FILES / str(copy.fileno())
    except OSError as error:
        raise unreadable(path, error) from error


def unreadable(path: Path, error: OSError) -> LogError:
    """Return the error of a log that the system does not let be read."""
    return LogError(f"{path}: cannot be read: {error.strerror or error}")
