"""Ctrl-C that lets what is under way be finished first."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event


@contextmanager
def gentle_interrupt() -> Iterator[Event]:
    """Let the first Ctrl-C but set an event, so that what is under way is done and kept; a second one stops it."""
    asked = Event()
    previous = signal.getsignal(signal.SIGINT)
    if previous is not signal.default_int_handler:  # ignored, as below nohup, or somebody else's concern
        yield asked
        return

    def note(number: int, frame: object) -> None:
        del number, frame
        asked.set()
        signal.signal(signal.SIGINT, previous)

    signal.signal(signal.SIGINT, note)
    try:
        yield asked
    finally:
        signal.signal(signal.SIGINT, previous)
