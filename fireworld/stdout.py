"""Standard output that may go away: what nobody reads is no verdict, what a full disk does not take is an error."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Iterator
from typing import Any, TextIO


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
            return self.stream.write(text)
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


def be_patient() -> None:
    """Make standard output patient."""
    if not isinstance(sys.stdout, PatientOutput):
        sys.stdout = PatientOutput(sys.stdout)
