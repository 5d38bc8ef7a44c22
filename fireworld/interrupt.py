"""Ctrl-C that lets what is under way be finished first."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event


class Interrupted(KeyboardInterrupt):
    """Ctrl-C that ended some work; the text says what is left of it."""


def end_like_ctrl_c() -> None:
    """Let SIGTERM, by which CI systems and `timeout` end a process, do what Ctrl-C does."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, signal.default_int_handler)


@contextmanager
def gentle_interrupt(asked: Event | None = None) -> Iterator[Event]:
    """Let the first Ctrl-C only set an event, so that what is under way is done and kept; a second one stops it.

    Args:
        asked: the event; None: a new one.
    """
    asked = asked or Event()
    previous = signal.getsignal(signal.SIGINT)
    in_main = threading.current_thread() is threading.main_thread()
    if not in_main or previous is not signal.default_int_handler:  # ignored, as below nohup, or handled by others
        yield asked
        return

    # SIGTERM too, where it ends a process as Ctrl-C does.
    numbers = [number for number in (signal.SIGINT, signal.SIGTERM) if signal.getsignal(number) is previous]

    def note(number: int, frame: object) -> None:
        del number, frame
        asked.set()
        for one in numbers:
            signal.signal(one, previous)

    for one in numbers:
        signal.signal(one, note)
    try:
        yield asked
    finally:
        for one in numbers:
            signal.signal(one, previous)
