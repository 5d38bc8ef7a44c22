"""Golden recordings as files: the recording and its text, or the digest alone."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from fireworld_recorder.reader import open_log
from fireworld_recorder.writer import LogWriter

from fireworld.errors import LogError, expected
from fireworld.files import read_text_file, write_file
from fireworld.recording.golden.digest import DIGEST_SUFFIX, write_digest
from fireworld.recording.golden.text import golden_text
from fireworld.recording.golden.training import store_training, training_text
from fireworld.recording.inputs import is_training
from fireworld.recording.run import Run
from fireworld.training.log.reader import open_training
from fireworld.training.log.verify import TrainedAgain

SUFFIX: Final = ".mcap"
TEXT_SUFFIX: Final = ".txt"
STORING: Final = ".storing"
"""What the name of a golden ends in until it is whole."""
LARGE_BYTES: Final = 2_000_000
"""Size of a recording from which on it is worth a word that every accepted change commits all of it again."""
LARGE_HINT: Final = "every accepted change commits it anew: keep its digest only, or use Git LFS"


def text_path(path: Path) -> Path:
    """Return where the text of a golden is."""
    return path.with_suffix(TEXT_SUFFIX)


def digest_path(path: Path) -> Path:
    """Return where the golden is if it is a digest only."""
    return path.with_suffix(DIGEST_SUFFIX)


def recording_path(path: Path) -> Path:
    """Return where the golden is if it is a recording."""
    return path.with_suffix(SUFFIX)


def is_digest(path: Path) -> bool:
    """Return whether a golden is a digest only."""
    return path.suffix == DIGEST_SUFFIX


def store_golden(path: Path, fresh: Run | TrainedAgain, *, free: bool = False) -> None:
    """Write a golden and its text; each is written beside and renamed, replacing what is there (OutputError).

    Args:
        path: of the recording, or of the digest.
        fresh: the run, or what is trained.
        free: there must be no golden of that name.

    Raises:
        LogError: a digest is to be kept of what is compared by tolerances, or of a training.
    """
    if is_digest(path):
        write_digest(path, _only_run(fresh))
        return
    store_recording(path, fresh, free=free)
    store_text(path)


def _only_run(fresh: Run | TrainedAgain) -> Run:
    if isinstance(fresh, TrainedAgain):
        raise LogError(expected("digest-only golden", "", "a run", "a training", "keep its log; it is short"))
    return fresh


def store_recording(path: Path, fresh: Run | TrainedAgain, *, free: bool = False) -> None:
    """Write a recording, `free` as for `store_golden`; a training is trained for it (OutputError)."""
    if isinstance(fresh, TrainedAgain):
        store_training(path, fresh, free=free, scratch_suffix=STORING)
        return
    with LogWriter(path, fresh.header, fresh.city, force=not free, scratch_suffix=STORING) as writer:
        for record in fresh:
            writer.write(record)


def store_text(path: Path) -> bool:
    """Write the text of a golden if it is missing or outdated; return whether it was. A digest has none.

    Raises:
        LogError: the golden cannot be read.
        OutputError: the text cannot be written.
    """
    if is_digest(path):
        return False
    text = training_text(open_training(path)) if is_training(path) else golden_text(open_log(path))
    beside, content = text_path(path), text.encode()
    if beside.is_file() and read_text_file(beside).encode() == content:
        return False
    write_file(beside, content)
    return True
