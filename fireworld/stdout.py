"""Standard output that may go away: what nobody reads is no verdict, what a full disk does not take is an error."""

from __future__ import annotations

import contextlib
import os
import sys
from typing import Any, TextIO


class StandardOutputError(Exception):
    """Standard output cannot be written: a full disk, say."""


class PatientOutput:
    """A text stream that forgets what is written once nobody reads it any more.

    Raises:
        StandardOutputError: it cannot be written for another reason.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: Any) -> int:
        """Write a text."""
        try:
            return self._stream.write(text)
        except BrokenPipeError:
            forget(self._stream)
            return len(text)
        except OSError as error:
            forget(self._stream)
            raise StandardOutputError(error.strerror or str(error)) from error

    def flush(self) -> None:
        """Hand over what was written."""
        try:
            self._stream.flush()
        except BrokenPipeError:
            forget(self._stream)
        except OSError as error:
            forget(self._stream)
            raise StandardOutputError(error.strerror or str(error)) from error

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def forget(stream: Any) -> None:
    """Let what a stream still holds, and all that follows, go nowhere: the interpreter would complain at its end."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)


def be_patient() -> None:
    """Make standard output patient."""
    if not isinstance(sys.stdout, PatientOutput):
        sys.stdout = PatientOutput(sys.stdout)
