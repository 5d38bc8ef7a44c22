"""Recover a cut-off or damaged log: write a complete log that ends at its last good step."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from fireworld.errors import LogError
from fireworld.files import check_output
from fireworld_recorder.container import SchemaRecord
from fireworld_recorder.reader import Log, open_log
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


def recover(path: Path | str, output: Path | str, *, force: bool = False) -> Recovery:
    """Copy the committed steps of a log, byte for byte, into a log of their own.

    The new log is what a run that ended there would have written.

    Args:
        path: the log, whatever its state.
        output: the log to make.
        force: replace an existing output.

    Raises:
        LogError: the log holds no good step, or cannot be read at all.
        OutputError: the output exists, its folder does not, or it cannot be written.
    """
    check_output(Path(output), force=force)
    log = open_log(path, partial=True)
    if not len(log):
        raise LogError(f"{path}: {log.damage or 'it holds no steps'}; there is nothing to recover")
    copy = StepFile(
        Path(output),
        metadata=log.found.metadata,
        attachments=log.header.attachments,
        channels=channels_of(log),
        city=log.found.first,
        force=force,
        scratch_suffix=".recovering",
    )
    with copy:
        for step, raw in zip(log.found.steps, log.raw_steps(), strict=True):
            copy.commit(step, [(topic, bytes(payload)) for topic, payload in raw])
    return Recovery(n_steps=len(log), last_step=log.found.steps[-1], damage=log.damage, digest=log.digest)


def channels_of(log: Log) -> list[Channel]:
    """List the topics of a log with their schemas as it carries them, those of a later version too."""
    none = SchemaRecord(0, "", "", b"")
    pairs = [(item, log.found.schemas.get(item.schema_id, none)) for _, item in sorted(log.found.channels.items())]
    return [Channel(item.topic, schema.name, schema.data) for item, schema in pairs]
