"""Golden recordings as files: the recording and its text, written together."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from fireworld_recorder.reader import open_log
from fireworld_recorder.writer import LogWriter

from fireworld.errors import OutputError
from fireworld.files import write_file
from fireworld.recording.golden.text import golden_text
from fireworld.records import Steps

SUFFIX: Final = ".mcap"
TEXT_SUFFIX: Final = ".txt"


def text_path(path: Path) -> Path:
    """Return where the text of a golden is."""
    return path.with_suffix(TEXT_SUFFIX)


def store_golden(path: Path, fresh: Steps) -> None:
    """Write a golden and its text, replacing what is there; each is written beside and renamed.

    Raises:
        OutputError: they cannot be written.
    """
    store_recording(path, fresh)
    store_text(path)


def store_recording(path: Path, fresh: Steps) -> None:
    """Write a recording, replacing what is there.

    Raises:
        OutputError: it cannot be written.
    """
    with LogWriter(path, fresh.header, fresh.city, force=True) as writer:
        for record in fresh:
            writer.write(record)


def store_text(path: Path) -> bool:
    """Write the text of a golden if it is missing or outdated; return whether it was.

    Raises:
        LogError: the golden cannot be read.
        OutputError: the text cannot be written.
    """
    text, beside = golden_text(open_log(path)).encode(), text_path(path)
    if beside.is_file() and beside.read_bytes() == text:
        return False
    write_file(beside, text)
    return True


def make_folder(folder: Path) -> None:
    """Make a folder, if it is not there.

    Raises:
        OutputError: it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: cannot be made: {error.strerror or error}") from None
