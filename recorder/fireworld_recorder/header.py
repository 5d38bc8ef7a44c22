"""The header of a log: as metadata that checks itself, and against the header of another run.

As metadata it is text keys and values, and the hashes of the attachments.
"""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Mapping, Sequence
from typing import Any, Final

from fireworld.errors import LogError, expected
from fireworld.records import RunHeader
from fireworld_recorder.kind import NOUNS, RUN, LogKind

PROFILE: Final = "fireworld"
_ATTACHMENT: Final = "attachment:"
_MAY_LACK: Final = ("simulator_digest",)
"""What older logs do not have."""


class ForeignError(LogError):
    """A file that is no log, or one of another format."""


def to_metadata(header: Any, kind: LogKind = RUN) -> dict[str, str]:
    """Write a header as text, by rising key, with a checksum over all the rest (MCAP has none for metadata)."""
    texts = {item.name: str(getattr(header, item.name)) for item in _fields(kind)}
    if_any = {item.name for item in _fields(kind) if item.metadata.get("if_any")}
    metadata = {name: text for name, text in texts.items() if text or name not in if_any}
    metadata["format"] = kind.format
    for name, data in header.attachments.items():
        metadata[_ATTACHMENT + name] = hashlib.sha256(data).hexdigest()
    metadata["checksum"] = _checksum(metadata)
    return dict(sorted(metadata.items()))


def check_format(found: str, kind: LogKind = RUN) -> None:
    """Check that a log is of the kind and version that are to be read.

    Raises:
        ForeignError: it is not.
    """
    if found == kind.format:
        return
    name, _, major = found.partition("/")
    ours_name, _, ours = kind.format.partition("/")
    newer = name == ours_name and major.isdecimal() and int(major) > int(ours)
    hint = "it was written by a newer fireworld: try to upgrade" if newer else ""
    if name != ours_name and name in NOUNS:
        hint = f"it is the log of a {NOUNS[name]}, not of a {kind.noun}"
        hint += "; `fireworld replay` makes the log of a run of any episode" if kind == RUN else ""
    raise ForeignError(expected("format", "", kind.format, found, hint))


def from_metadata(metadata: Mapping[str, str], attachments: Mapping[str, Sequence[bytes]], kind: LogKind = RUN) -> Any:
    """Read a header and the attachments it names; keys of later versions are ignored.

    Args:
        metadata: that of the log's kind.
        attachments: all attachments of the log by name; what the header does not name, or other tools have added under
            a name of ours, is left out.
        kind: of the log.

    Raises:
        LogError: another format, a value that was changed, an attachment that is lost or was changed.
    """
    check_format(metadata.get("format", ""), kind)
    if metadata.get("checksum") != _checksum(metadata):
        raise LogError(expected(kind.metadata_name, "", "its own checksum", "other bytes", "the header is damaged"))
    values: dict[str, object] = {}
    for item in _fields(kind):
        text = metadata.get(item.name)
        if text is None and item.default is dataclasses.MISSING:
            raise LogError(expected(item.name, "", "a value in the header", "none"))
        if text is not None:
            values[item.name] = _integer(item.name, text) if item.type == "int" else text
    named = {}
    for key, digest in metadata.items():
        if key.startswith(_ATTACHMENT):
            name = key.removeprefix(_ATTACHMENT)
            found = [data for data in attachments.get(name, ()) if hashlib.sha256(data).hexdigest() == digest]
            if not found:
                raise LogError(expected(name, "", "the attachment as it was recorded", "other bytes or none"))
            named[name] = found[0]
    return kind.header_type(**values, attachments=named)


def header_differences(a: RunHeader, b: RunHeader) -> dict[str, tuple[str | int, str | int]]:
    """Return what the runs were asked to do differently; attachments are covered by the digests.

    Where one log does not know its simulator, nothing is said of the other's.
    """
    pairs = {item.name: (getattr(a, item.name), getattr(b, item.name)) for item in _fields(RUN)}
    return {name: pair for name, pair in pairs.items() if pair[0] != pair[1] and not (name in _MAY_LACK and "" in pair)}


def _fields(kind: LogKind) -> tuple[dataclasses.Field[Any], ...]:
    return tuple(item for item in dataclasses.fields(kind.header_type) if item.name != "attachments")


def _integer(key: str, text: str) -> int:
    try:
        number = int(text)
    except ValueError as error:
        raise LogError(expected(key, "", "a whole number", text)) from error
    if not -(2**63) <= number < 2**63:
        raise LogError(expected(key, "", "a whole number of 64 bits", text))
    return number


def _checksum(metadata: Mapping[str, str]) -> str:
    text = "".join(f"{key}\0{value}\0" for key, value in sorted(metadata.items()) if key != "checksum")
    return hashlib.sha256(text.encode()).hexdigest()
