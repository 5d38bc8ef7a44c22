"""Recover a cut-off or damaged log: write a complete log that ends at its last good step."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from fireworld.errors import LogError
from fireworld.files import check_output
from fireworld_recorder.container import SchemaRecord
from fireworld_recorder.kind import RUN, LogKind
from fireworld_recorder.reader import raw_commits
from fireworld_recorder.scan import Scan, scan
from fireworld_recorder.schema import Channel
from fireworld_recorder.writer import StepFile


@dataclass(frozen=True)
class Recovery:
    """What was recovered."""

    n_steps: int
    last_step: int | None
    damage: str | None
    """What was wrong; None if the log was good already."""
    digest: str
    unit: str = "step"


def recover(path: Path | str, output: Path | str, *, force: bool = False, kind: LogKind = RUN) -> Recovery:
    """Copy the committed steps of a log, byte for byte, into a log of their own.

    The new log is what a run that ended there would have written.

    Args:
        path: the log, whatever its state.
        output: the log to make.
        force: replace an existing output.
        kind: of the log.

    Raises:
        LogError: the log holds no good step, or cannot be read at all.
        OutputError: the output exists, its folder does not, or it cannot be written.
    """
    check_output(Path(output), force=force)
    found = scan(Path(path), kind)
    if not found.steps:
        raise LogError(f"{path}: {found.damage or f'it holds no {kind.unit}s'}; there is nothing to recover")
    copy = StepFile(
        Path(output),
        metadata=found.metadata,
        attachments=found.header.attachments,
        channels=channels_of(found),
        city=found.first,
        force=force,
        kind=kind,
        scratch_suffix=".recovering",
    )
    with copy:
        for step, raw in zip(found.steps, raw_commits(found), strict=True):
            copy.commit(step, [(topic, bytes(payload)) for topic, payload in raw])
    return Recovery(len(found.steps), found.steps[-1], found.damage, found.hash.hex(), kind.unit)


def channels_of(found: Scan) -> list[Channel]:
    """List the topics of a log with their schemas as it carries them, those of a later version too."""
    none = SchemaRecord(0, "", "", b"")
    pairs = [(item, found.schemas.get(item.schema_id, none)) for _, item in sorted(found.channels.items())]
    return [Channel(item.topic, schema.name, schema.data) for item, schema in pairs]
