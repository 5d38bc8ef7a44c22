"""Output streams: standard output may go away, and neither is sent what would control a terminal.

What nobody reads is no verdict, what a full disk does not take is an error. Names and texts from files may hold any
bytes; control characters and halves of pairs are written as Python writes them.
"""

from __future__ import annotations

import contextlib
import os
import re
import sys
from collections.abc import Iterator
from typing import Any, Final, TextIO

_CONTROLS: Final = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff]")
_COLORS: Final = re.compile("(\x1b\\[[0-9;]*m)")
_TERMINAL: Final = re.compile("(\r|\x1b\\[[0-9;?]*[A-Za-z])")
"""What tables send where colors are forced, and what bars send to a terminal: colors and movements, nothing else."""


class StandardOutputError(Exception):
    """Standard output cannot be written: a full disk, say."""


class PatientOutput:
    """A text stream that forgets what is written once nobody reads it any more.

    Raises:
        StandardOutputError: it cannot be written for another reason.
    """

    def __init__(self, stream: TextIO) -> None:
        self.stream = stream
        self._fault = ""  # why it cannot be written any more: whoever swallowed the first error gets the next

    def write(self, text: Any) -> int:
        """Write a text."""
        with self._watched():
            self.stream.write(_harmless(text, self.stream))
        return len(text)

    def flush(self) -> None:
        """Hand over what was written."""
        with self._watched():
            self.stream.flush()

    @contextlib.contextmanager
    def _watched(self) -> Iterator[None]:
        if self._fault:
            raise StandardOutputError(self._fault)
        try:
            yield
        except BrokenPipeError:
            forget(self.stream)
        except OSError as error:
            forget(self.stream)
            self._fault = error.strerror or str(error)
            raise StandardOutputError(self._fault) from error

    def __getattr__(self, name: str) -> Any:
        return getattr(self.stream, name)


class HarmlessOutput:
    """A text stream that nothing but text, and on a terminal colors and bars, is sent to."""

    def __init__(self, stream: TextIO) -> None:
        self.stream = stream

    def write(self, text: Any) -> int:
        """Write a text."""
        self.stream.write(_harmless(text, self.stream))
        return len(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.stream, name)


def _harmless(text: Any, stream: TextIO) -> Any:
    """Return a text without what would control a terminal, or what the stream's encoding does not have."""
    if not isinstance(text, str):
        return text
    if _CONTROLS.search(text):
        allowed = _TERMINAL if stream.isatty() else _COLORS if os.environ.get("FORCE_COLOR") else None
        parts = allowed.split(text) if allowed else [text]  # every second one is what it allows
        parts[::2] = [_CONTROLS.sub(lambda found: repr(found[0])[1:-1], part) for part in parts[::2]]
        text = "".join(parts)
    encoding = getattr(stream, "encoding", None) or "utf-8"
    return text if text.isascii() else text.encode(encoding, "backslashreplace").decode(encoding)


def forget(stream: Any) -> None:
    """Let what a stream still holds, and all that follows, go nowhere: the interpreter would complain at its end."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)


def leave() -> None:
    """Hand over the last of it, and put standard output back as it was; what it does not take by now is lost."""
    if isinstance(sys.stdout, PatientOutput):
        with contextlib.suppress(StandardOutputError, ValueError):
            sys.stdout.flush()
        sys.stdout = sys.stdout.stream
    if isinstance(sys.stderr, HarmlessOutput):
        sys.stderr = sys.stderr.stream


def be_patient() -> None:
    """Make standard output patient, and both streams harmless."""
    if sys.stdout is not None and not isinstance(sys.stdout, PatientOutput):
        sys.stdout = PatientOutput(sys.stdout)
    if sys.stderr is not None and not isinstance(sys.stderr, HarmlessOutput):
        sys.stderr = HarmlessOutput(sys.stderr)
