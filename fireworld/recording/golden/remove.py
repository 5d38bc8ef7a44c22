"""Goldens listed and removed, with what killed commands and renamed tests leave in their folder."""

from __future__ import annotations

import shutil
from collections.abc import Collection, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from fireworld_recorder.reader import open_log
from fireworld_recorder.writer import PARTIAL_SUFFIX

from fireworld.errors import FireworldError, OutputError
from fireworld.files import read_text_file
from fireworld.recording.golden.digest import read_digest
from fireworld.recording.golden.find import FOLDER, find_goldens
from fireworld.recording.golden.spec import hash_line
from fireworld.recording.golden.store import STORING, SUFFIX, TEXT_SUFFIX, is_digest, recording_path, text_path
from fireworld.recording.inputs import is_training
from fireworld.training.log.reader import open_training


@dataclass(frozen=True)
class GoldenEntry:
    """A golden as it lies in its folder; nothing of it is run."""

    name: str
    what: str
    """The scenario, or the curriculum; "" where the recording cannot be read."""
    by: str
    """The policy, or the method."""
    seed: int
    n_steps: int
    """Steps of a run, episodes or generations of a training; without the state before the first."""
    kind: str
    """recording, digest or training."""
    n_bytes: int
    digest: str
    error: str = ""
    """Why it cannot be read."""

    def to_dict(self) -> dict[str, Any]:
        """Return plain values."""
        return asdict(self)


def list_goldens(folder: Path = FOLDER) -> list[GoldenEntry]:
    """Return the goldens of a folder, sorted by name; OutputError if there are none."""
    return [_entry(path) for path in find_goldens(folder)]


def _entry(path: Path) -> GoldenEntry:
    n_bytes = path.stat().st_size
    kind = "digest" if is_digest(path) else "recording"
    try:
        if kind == "digest":
            kept = read_digest(path)
            run, n_steps = kept.header, len(kept.steps) - 1
            return GoldenEntry(path.stem, run.scenario, run.policy, run.seed, n_steps, kind, n_bytes, kept.digest)
        if is_training(path):
            training = open_training(path)
            one = training.header
            kind, n_parts = "training", len(training)
            return GoldenEntry(path.stem, one.curriculum, one.method, one.seed, n_parts, kind, n_bytes, training.digest)
        log = open_log(path)
        run, n_steps = log.header, int(log.steps.max(initial=0))
        return GoldenEntry(path.stem, run.scenario, run.policy, run.seed, n_steps, kind, n_bytes, log.digest)
    except FireworldError as error:
        return GoldenEntry(path.stem, "", "", 0, 0, kind, n_bytes, "", str(error))


def leftovers_of(folder: Path = FOLDER) -> list[Path]:
    """Return what is no golden but was made for one: partial recordings, scratch folders, texts of none."""
    partial = [path for ending in (PARTIAL_SUFFIX, STORING) for path in folder.glob(f"*{SUFFIX}{ending}")]
    partial += folder.glob(".fireworld-*/")
    texts = [
        path for path in folder.glob(f"*{TEXT_SUFFIX}") if not recording_path(path).exists() and _is_golden_text(path)
    ]
    return sorted([*partial, *texts])


def _is_golden_text(path: Path) -> bool:
    lines = read_text_file(path).splitlines() if path.is_file() else []
    return bool(lines) and lines[-1].startswith(hash_line(""))


def remove_goldens(folder: Path = FOLDER, names: Collection[str] = (), *, leftovers: bool = False) -> list[Path]:
    """Remove goldens, each with its text.

    Args:
        folder: of the goldens.
        names: of those to remove.
        leftovers: remove what `leftovers_of` finds, too.

    Returns:
        The files that are gone.

    Raises:
        OutputError: there is no such golden, nothing is removed then; or one cannot be removed.
    """
    paths: Sequence[Path] = find_goldens(folder, names) if names else ()
    gone = [*(one for path in paths for one in (path, text_path(path)) if one.exists())]
    gone += leftovers_of(folder) if leftovers else []
    for path in gone:
        try:
            if path.is_dir():
                shutil.rmtree(path)
            else:
                path.unlink()
        except OSError as error:
            raise OutputError(f"{path}: cannot be removed: {error.strerror or error}") from None
    return gone
